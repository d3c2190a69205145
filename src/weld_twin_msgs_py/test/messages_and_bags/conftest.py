# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from weld_twin_core import JointMotion, Measurements, Recording, Robot, Signal
from weld_twin_core.arm.rotation import rotation_matrix


@pytest.fixture
def robot():
    return Robot.from_mapping(
        {
            'name': 'two',
            'joints': [
                {'name': 'shoulder', 'a': 1.0, 'alpha': 0.3, 'd': 0.2, 'max_velocity': 3.0},
                {'name': 'elbow', 'a': 0.5, 'lower': -3.0, 'upper': 3.0},
            ],
        }
    )


@pytest.fixture
def recording():
    """Numbers without meaning, so that nothing but copying can reproduce them."""
    rng = np.random.default_rng(7)
    t = np.arange(400) * 0.008
    tm = np.arange(90) * 0.033 + 0.0021
    return Recording(
        'cell',
        JointMotion(t, rng.normal(size=(400, 2)), rng.normal(size=(400, 2))),
        Measurements(
            tm,
            rng.normal(size=(90, 3)),
            rotation_matrix(rng.normal(size=(90, 3))),
            rng.uniform(1e-5, 3e-5, 90),
        ),
        Signal(t[::2], rng.normal(size=(200, 6))),
        'base',
        Signal(t[::100], rng.uniform(20.0, 30.0, 4)),
        epoch_ns=1_700_000_000_123_456_789,
    )
