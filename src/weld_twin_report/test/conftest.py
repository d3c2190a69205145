# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The command line in this process, with what it prints."""

import pytest

from weld_twin_nodes.cli.in_process import weld_twin as run


@pytest.fixture
def weld_twin():
    """Return a function that runs the command line and returns exit code and output."""
    return run
