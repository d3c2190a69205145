# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Nodes with keys, and others who have none or the wrong ones."""
