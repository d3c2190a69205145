# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Dozens of small errors at once: kinds whose size is learned, named as families."""
