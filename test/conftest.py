# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Make the helper modules of these folders, the small cells of the core, and messages importable."""

import sys
from pathlib import Path

import pytest

from weld_twin_core import TwinError, catalog
from weld_twin_lab.campaigns.message_packages import messages_importable

HERE = Path(__file__).parent
FOLDERS = ('diagnosis', 'house', 'serve', 'soundness')
sys.path[:0] = [str(HERE), *(str(HERE / folder) for folder in FOLDERS)]
CORE = HERE.parent / 'src/weld_twin_core/test'
sys.path[:0] = [str(CORE), str(CORE / 'soundness')]


@pytest.fixture
def ur5():
    return catalog.load('ur5')


@pytest.fixture(scope='module')
def packages():
    """Let packages of messages that have no wheels be imported, from where they were built."""
    try:
        with messages_importable():
            yield
    except TwinError as error:
        pytest.skip(str(error))
