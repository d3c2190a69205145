# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A cell with a compensator in it: arms with drawn causes, goals, and what becomes of them."""

NOTHING = 'nothing'
"""The change that is none."""
