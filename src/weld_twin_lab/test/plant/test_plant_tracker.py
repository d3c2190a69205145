# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Instruments: noise, clocks, losses."""

from dataclasses import replace

import numpy as np
import pytest
from plant_cells import UR5, dh_positions, record, stations, weave
from scipy.spatial.transform import Rotation

from weld_twin_lab.plant.exponentials import Command
from weld_twin_lab.plant.tracker import Tracker


def test_noise_of_position_and_orientation():
    command = weave(UR5, 20.0)
    got = record(UR5, [], command, Tracker(sigma=3e-5, sigma_orientation=1e-4))
    clean = record(UR5, [], command)
    turn = Rotation.from_quat(clean.quaternion).inv() * Rotation.from_quat(got.quaternion)
    assert np.std(got.position - clean.position) == pytest.approx(3e-5, rel=0.05)
    assert np.std(turn.as_rotvec()) == pytest.approx(1e-4, rel=0.05)
    assert record(UR5, [], command, Tracker(orientation=False)).quaternion is None


def test_rates_drops_and_clocks():
    command = weave(UR5, 20.0)
    got = record(
        UR5,
        [],
        command,
        Tracker(
            rate=50.0,
            drop=0.2,
            jitter=1e-3,
            clock_offset=0.5,
            joint_rate=100.0,
            joint_jitter=1e-3,
            velocity=False,
        ),
    )
    assert 700 < len(got.t_measured) < 900
    assert 1990 < len(got.t_joint) <= 2000
    assert (np.diff(got.t_measured) > 0.0).all()
    assert (np.diff(got.t_joint) > 0.0).all()
    assert 0.5 <= got.t_measured[0] < 0.6
    assert got.qd is None
    assert got.wrench is None


def test_outliers():
    command = weave(UR5, 20.0)
    got = record(UR5, [], command, Tracker(outlier_share=0.02, outlier_size=0.01))
    off = np.linalg.norm(got.position - dh_positions(UR5, command.q), axis=1)
    assert 20 < np.sum(off > 5e-3) < 90
    assert off[off > 5e-3] == pytest.approx(0.01)


def test_lost_stations_are_lost_on_both_sides():
    got = record(UR5, [], stations(UR5, 100), Tracker(drop=0.3))
    assert len(got.t_joint) == len(got.t_measured) < 90
    assert np.allclose(got.position, dh_positions(UR5, got.q))


def test_a_slow_thermometer():
    t = np.arange(0.0, 100.0, 0.1)
    q = np.tile(weave(UR5, 1.0).q[0], (len(t), 1))
    command = Command(t, q, temperature=20.0 + 0.1 * t)
    got = record(UR5, [], command, Tracker(temperature_rate=2.0, temperature_lag=10.0))
    assert len(got.temperature) == 200
    late = got.temperature_t[-1] - 10.0
    assert got.temperature[-1] == pytest.approx(20.0 + 0.1 * late, abs=0.05)


@pytest.mark.parametrize(
    't, q, match',
    [
        ([0.0, 1.0, 1.0, 2.0], np.zeros((4, 6)), 'increasing'),
        ([0.0, 1.0, 3.0, 4.0], np.zeros((4, 6)), 'evenly'),
        ([0.0, 1.0, 2.0, 3.0], np.zeros((3, 6)), 'q must be'),
        ([0.0, 1.0, 2.0, 3.0], np.full((4, 6), np.nan), 'finite'),
    ],
)
def test_bad_commands_are_refused(t, q, match):
    with pytest.raises(ValueError, match=match):
        Command(np.array(t), q)


def test_a_motion_recorded_again_is_what_a_fresh_simulation_says():
    """The physics of a motion is simulated once; instruments and their draws are not."""
    lot = [
        {'effect': 'backlash', 'joint': 'j1', 'width': 1e-3},
        {'effect': 'servo_lag', 'joint': 'j2', 'time_constant': 0.02},
        {'effect': 'friction_wander', 'joint': 'j3', 'amplitude': 1e-4, 'time_constant': 1.0},
    ]
    command = weave(UR5, 1.0)
    record(UR5, lot, command)
    record(UR5, lot[:1], command)
    again = record(UR5, lot, command, Tracker(sigma=3e-5, drop=0.1), seed=5)
    fresh = record(UR5, lot, replace(command), Tracker(sigma=3e-5, drop=0.1), seed=5)
    np.testing.assert_array_equal(again.position, fresh.position)
    np.testing.assert_array_equal(again.t_measured, fresh.t_measured)
