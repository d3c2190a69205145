# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The published tables of two arms under a laser tracker."""

from __future__ import annotations

from pathlib import Path

from weld_twin_core.arm import catalog
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.tables import read_table

TABLES = {'ur5': 'grid.csv', 'ur10': 'series_c_random_poses.csv'}
"""What the stations of each arm are in."""


def stations(robot: str, directory: Path) -> Recording:
    """
    Return the stations of one of the two arms, in the order they were measured.

    Raises DataError: the table is missing or cannot be read.
    """
    return read_table(directory / TABLES[robot], catalog.load(robot)).recording
