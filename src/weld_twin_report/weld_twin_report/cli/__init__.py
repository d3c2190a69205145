# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The commands that write pages."""
