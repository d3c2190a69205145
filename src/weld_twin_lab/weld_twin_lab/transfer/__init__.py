# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings that are poor on purpose: does the diagnosis ever do worse than a plain fit?"""
