# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A cell of live nodes."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # what lies beside the tests can be imported


@pytest.fixture
def cell(tmp_path):
    from weld_twin_nodes.harness import Cell  # needs ROS 2

    with Cell(tmp_path / 'cell') as cell:
        yield cell
