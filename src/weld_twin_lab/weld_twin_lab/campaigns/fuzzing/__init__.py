# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Broken files of every kind, and what happens when they are read."""
