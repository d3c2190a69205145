# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Causes outside the library: each does what its line in the table says."""

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

from weld_twin_lab.plant.plant import KNOWN

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


def test_station_step_is_a_step():
    command = weave(UR5, 6.0)
    step = {'effect': 'station_step', **CASES['station_step']}
    gap = record(UR5, [step], command).position - dh_positions(UR5, command.q)
    assert np.allclose(gap[command.t < 3.0], 0.0, atol=1e-9)
    assert np.allclose(gap[command.t >= 3.0], [1e-3, 0.0, 0.0], atol=1e-9)


def test_quadratic_scale():
    command = stations(UR5, 5)
    got = record(UR5, [{'effect': 'quadratic_scale', 'coefficient': 1e-4}], command)
    p = dh_positions(UR5, command.q)
    stretched = p * (1.0 + 1e-4 * np.linalg.norm(p, axis=1, keepdims=True))
    assert np.allclose(got.position, stretched, atol=1e-12)


def test_stick_slip_stays_within_its_amplitude():
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
