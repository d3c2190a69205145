# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How sure an instrument is, by its name or its certificate."""

import numpy as np
import pytest

from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_msgs_py.files.instruments import instrument, measured_by

POINTS = np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 2.0]])
"""Five and two metres away."""


def recording():
    t = np.arange(2.0)
    return Recording(
        'cell', JointMotion(t, np.zeros((2, 6)), static=True), Measurements(t, POINTS)
    )


@pytest.mark.parametrize(
    ('told', 'sigma'),
    [
        # Half of 15 um and 6 um for every metre.
        ('at960', [22.5e-6, 13.5e-6]),
        ('AT960@3', [16.5e-6, 16.5e-6]),
        ('0.015+0.006/m', [22.5e-6, 13.5e-6]),
        ('0.1+0.02/m@1', [60e-6, 60e-6]),
        ('0.05', [25e-6, 25e-6]),
    ],
)
def test_a_standard_deviation_is_half_of_what_is_permitted(told, sigma):
    seen = measured_by(recording(), instrument(told), own_frame=True).measured
    np.testing.assert_allclose(seen.sigma, sigma, rtol=1e-12)
    np.testing.assert_array_equal(seen.position, POINTS)


@pytest.mark.parametrize('told', ['at96', '', '0.015+', '-0.1', '0', '1..2', '20', 'at960@x'])
def test_what_is_no_instrument_is_refused_in_a_sentence(told):
    with pytest.raises(DataError, match='such as 0') as said:
        instrument(told)
    assert '\n' not in str(said.value)


def test_a_distance_is_asked_for_where_the_frame_is_not_the_instruments():
    with pytest.raises(DataError, match='at960@3'):
        measured_by(recording(), instrument('at960'), own_frame=False)
    plain = measured_by(recording(), instrument('0.06'), own_frame=False)
    assert plain.measured.sigma is not None
