# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Whole cells of the plant, and real pixels: is what moves the torch told as on one arm?"""
