# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Dozens of small errors at once: kinds held to a size that is learned, named as families."""
