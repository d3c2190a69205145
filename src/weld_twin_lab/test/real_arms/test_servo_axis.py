# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The recording of a servo axis is read as it is published."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.io import savemat

from weld_twin_core.errors import DataError
from weld_twin_lab.real_arms.poor import plain_axis
from weld_twin_lab.real_arms.sources import servo

FILE = 'DATA_EMPS.mat'
LAG = 6.5e-3


@pytest.fixture
def published(tmp_path):
    """Return a directory with an axis that lags, and sticks a little as it turns."""
    t = np.arange(0.0, 6.0, 1e-3)[:, None]
    reference = 0.1 * np.sin(1.3 * t)
    speed = 0.13 * np.cos(1.3 * t)
    measured = reference - LAG * speed - 5e-6 * np.sign(speed)
    (tmp_path / 'emps').mkdir()
    savemat(tmp_path / 'emps' / FILE, {'t': t, 'qg': reference, 'qm': measured})
    return tmp_path


def test_plain_models_leave_less_the_more_they_know(published):
    left = plain_axis(servo(published).recording, 3600)
    assert left['as given'] > 50.0 * left['lag'] > 50.0 * left['lag and sign']
    # A square wave without its fundamental, which the lag takes: sqrt(1 - 8 / pi^2) is left.
    assert left['lag'] == pytest.approx(5e-6 * np.sqrt(1.0 - 8.0 / np.pi**2), rel=0.1)


def test_across_the_axis_everything_is_zero(published):
    recording = servo(published).recording
    assert not recording.measured.position[:, :2].any()
    assert recording.joints.q.shape == (6000, 1)


@pytest.mark.parametrize('content', [None, {'x': [1.0]}])
def test_another_file_is_said_to_be_another(tmp_path, content):
    (tmp_path / 'emps').mkdir()
    if content:
        savemat(tmp_path / 'emps' / FILE, content)
    with pytest.raises(DataError, match=FILE):
        servo(tmp_path)
