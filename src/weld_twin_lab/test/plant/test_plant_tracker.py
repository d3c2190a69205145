# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Flaws that no library knows, and the tracker of the plant."""

from dataclasses import replace

import numpy as np
import pytest
from plant_cells import (
    UR5,
    dh_positions,
    joint_displacement,
    record,
    stations,
    weave,
)
from scipy.spatial.transform import Rotation

from weld_twin_lab.plant.exponentials import Command
from weld_twin_lab.plant.plant import KNOWN
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


CASES = {
    'bearing_tilt': {'joint': 'j1', 'tilt': 1e-3},
    'station_step': {'time': 3.0, 'xyz': [1e-3, 0.0, 0.0]},
    'tool_slip': {'time': 3.0, 'xyz': [1e-3, 0.0, 0.0]},
    'quadratic_scale': {'coefficient': 1e-4},
    'column_bend': {'rotvec': [1e-3, 0.0, 0.0], 'time_constant': 5.0},
    'stick_slip': {'joint': 'j2', 'amplitude': 1e-3},
    'friction_wander': {'joint': 'j2', 'amplitude': 5e-4, 'time_constant': 3.0},
    'loaded_play': {'joint': 'j1', 'width': 1e-3},
    'dress_pack': {'joint': 'j4', 'amplitude': 1e-3},
}


@pytest.mark.parametrize('effect', CASES)
@pytest.mark.parametrize('static', [False, True])
def test_each_moves_the_tool_a_little(effect, static):
    assert effect in KNOWN
    command = stations(UR5, 15) if static else weave(UR5, 6.0)
    got = record(UR5, [{'effect': effect, **CASES[effect]}], command)
    gap = np.linalg.norm(got.position - dh_positions(UR5, command.q), axis=1)
    assert 1e-5 < np.sqrt(np.mean(gap**2)) < 3e-3


def test_a_step_a_scale_and_a_sticking_joint_are_as_told():
    command = weave(UR5, 6.0)
    step = {'effect': 'station_step', **CASES['station_step']}
    gap = record(UR5, [step], command).position - dh_positions(UR5, command.q)
    assert np.allclose(gap[command.t < 3.0], 0.0, atol=1e-9)
    assert np.allclose(gap[command.t >= 3.0], [1e-3, 0.0, 0.0], atol=1e-9)
    command = stations(UR5, 5)
    got = record(UR5, [{'effect': 'quadratic_scale', 'coefficient': 1e-4}], command)
    p = dh_positions(UR5, command.q)
    stretched = p * (1.0 + 1e-4 * np.linalg.norm(p, axis=1, keepdims=True))
    assert np.allclose(got.position, stretched, atol=1e-12)
    moved = joint_displacement(
        UR5, [{'effect': 'stick_slip', **CASES['stick_slip']}], weave(UR5, 6.0), 'j2'
    )
    assert 0.7e-3 < np.abs(moved).max() < 1.5e-3


@pytest.mark.parametrize(
    ('effect', 'joint', 'known'),
    [('loaded_play', 'j1', {'torque': 5.0}), ('dress_pack', 'j2', {'middle': 0.1, 'reach': 1.5})],
)
def test_what_is_given_is_the_same_in_every_recording(effect, joint, known):
    """What friction holds, and where a hose hangs."""
    whole = stations(UR5, 15)
    part = replace(whole, t=whole.t[:4], q=whole.q[:4])
    cause = {'effect': effect, **CASES[effect], 'joint': joint}
    for given, alike in ((known, True), ({}, False)):
        first, again = (
            joint_displacement(UR5, [{**cause, **given}], command, joint)
            for command in (whole, part)
        )
        assert np.allclose(first[:4], again, atol=1e-9) is alike


def test_bearing_tilt_is_no_row_error():
    command = stations(UR5, 60)
    got = record(UR5, [{'effect': 'bearing_tilt', 'joint': 'j1', 'tilt': 1e-3}], command)
    gap = (got.position - dh_positions(UR5, command.q)).ravel()
    columns = []
    for joint in ('j0', 'j1'):
        for key in ('a', 'd', 'alpha', 'beta', 'theta_offset'):
            moved = dh_positions(UR5, command.q, {joint: {key: 1e-6}})
            columns.append((moved - dh_positions(UR5, command.q)).ravel() / 1e-6)
    rest = gap - np.stack(columns, 1) @ np.linalg.lstsq(np.stack(columns, 1), gap, rcond=None)[0]
    assert np.linalg.norm(rest) > 0.15 * np.linalg.norm(gap)
