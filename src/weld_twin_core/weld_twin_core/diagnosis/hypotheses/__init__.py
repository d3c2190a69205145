# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which effects could have done it: their library, the search among them, and their alternatives."""
