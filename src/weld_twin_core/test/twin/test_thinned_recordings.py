# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Long recordings made shorter: evenly, with a note, and true to the motion."""

import numpy as np

from weld_twin_core.recording import JointMotion, Measurements, Recording


def long(static=False):
    t = np.arange(0.0, 40.0, 0.008)
    q = np.stack([np.sin(2.0 * t), np.cos(3.0 * t)], axis=1)
    at = np.arange(0.5, 39.0, 0.02) if not static else t
    measured = Measurements(at, np.stack([at, at, at], axis=1))
    return Recording('long', JointMotion(t, q, static=static), measured, notes=('first',))


def test_a_recording_within_its_bounds_stays_as_it_is():
    recording = long()
    assert recording.thinned(10_000, 10_000) is recording


def test_measurements_are_taken_evenly_from_the_first_to_the_last():
    thin = long().thinned(100, 10_000)
    t = thin.measured.t
    assert t.size == 100
    assert (t[0], t[-1]) == (long().measured.t[0], long().measured.t[-1])
    assert np.ptp(np.diff(t)) < 0.021
    assert thin.joints is not None
    assert thin.joints.t.size == long().joints.t.size
    assert thin.notes == ('first', '100 of 1925 measurements are used, evenly over the recording')


def test_thinned_joints_still_follow_the_motion():
    thin = long().thinned(10_000, 1300)
    assert thin.joints.t.size <= 1301
    assert thin.joints.t[-1] == long().joints.t[-1]
    at = np.linspace(1.0, 39.0, 777)
    q, qd = thin.joints.at(at)
    np.testing.assert_allclose(q, np.stack([np.sin(2 * at), np.cos(3 * at)], 1), atol=2e-6)
    np.testing.assert_allclose(
        qd, np.stack([2 * np.cos(2 * at), -3 * np.sin(3 * at)], 1), atol=1e-3
    )
    assert 'motion above 16 Hz is not seen' in thin.notes[-1]


def test_stations_stay_whole():
    stations = long(static=True)
    assert stations.thinned(10, 10) is stations
