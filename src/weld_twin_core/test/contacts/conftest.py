# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The arm that touches."""

import numpy as np
import pytest

import weld_twin_core as wt


@pytest.fixture(scope='module')
def robot():
    """Return an arm with a torch on its flange that points aside."""
    tool = np.eye(4)
    tool[:3, 3] = [0.02, 0.03, 0.12]
    return wt.load('ur5').with_frames(tool=tool)
