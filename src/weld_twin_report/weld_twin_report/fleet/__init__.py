# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings of many cells, diagnosed side by side into one database."""

from .running import Listed, read_list, run_fleet

__all__ = ['Listed', 'read_list', 'run_fleet']
