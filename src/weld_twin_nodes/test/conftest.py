# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line in this process, with what it prints, and a cell of live nodes."""

import sys
from pathlib import Path

import pytest

from weld_twin_nodes.cli.in_process import weld_twin as run

sys.path.insert(0, str(Path(__file__).parent))  # what lies beside the tests can be imported


@pytest.fixture
def weld_twin():
    """Return a function that runs the command line and returns exit code and output."""
    return run


@pytest.fixture
def cell(tmp_path):
    from weld_twin_nodes.harness import Cell  # needs ROS 2

    with Cell(tmp_path / 'cell') as cell:
        yield cell
