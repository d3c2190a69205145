# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The cell of the fault campaign, its faults, and what is asked of each node."""
