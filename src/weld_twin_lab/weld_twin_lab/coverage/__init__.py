# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Do regions of predicted poses hold what they say, where it was recorded and elsewhere?"""
