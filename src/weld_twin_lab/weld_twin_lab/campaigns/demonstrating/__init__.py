# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Running the demo and comparing what it leaves."""
