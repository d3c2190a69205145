# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects with a closed form: gearing, frames in time, instrument, load on the tool."""

import numpy as np
import pytest
from plant_cells import UR5, dh_pose, dh_positions, record, stations, weave

from weld_twin_lab.plant.flaws import heated


def _shifted(command, joint, delta):
    q = command.q.copy()
    q[:, joint] += delta
    return dh_positions(UR5, q)


def test_gear_ratio():
    command = stations(UR5, 10)
    got = record(UR5, [{'effect': 'gear_ratio', 'joint': 'j2', 'scale': 2e-4}], command)
    assert np.allclose(got.position, _shifted(command, 2, 2e-4 * command.q[:, 2]), atol=1e-12)


def test_transmission_ripple_of_several_orders():
    command = weave(UR5, 2.0)
    ripple = {
        'effect': 'transmission_ripple',
        'joint': 'j1',
        'amplitude': [3e-4, 1e-4],
        'order': [2, 31],
        'phase': [0.4, 1.0],
    }
    got = record(UR5, [ripple], command)
    q = command.q[:, 1]
    delta = 3e-4 * np.sin(2 * q + 0.4) + 1e-4 * np.sin(31 * q + 1.0)
    assert np.allclose(got.position, _shifted(command, 1, delta), atol=1e-9)


def test_joint_coupling():
    command = stations(UR5, 10)
    coupling = {'effect': 'joint_coupling', 'joint': 'j5', 'source': 'j4', 'ratio': 1e-3}
    got = record(UR5, [coupling], command)
    assert np.allclose(got.position, _shifted(command, 5, 1e-3 * command.q[:, 4]), atol=1e-12)


@pytest.mark.parametrize('make', [stations, lambda robot, _: weave(robot, 2.0)])
def test_quantization(make):
    command, step = make(UR5, 10), 1e-3
    got = record(UR5, [{'effect': 'quantization', 'joint': 'j1', 'step': step}], command)
    rounded = step * np.round(command.q[:, 1] / step)
    assert np.allclose(got.position, _shifted(command, 1, rounded - command.q[:, 1]), atol=1e-12)


def test_time_delay_makes_stamps_late():
    command = weave(UR5, 2.0)
    got = record(UR5, [{'effect': 'time_delay', 'delay': 0.013}], command)
    assert np.allclose(got.t_measured, command.t + 0.013)
    assert np.allclose(got.position, dh_positions(UR5, command.q), atol=1e-10)


def test_a_clock_that_runs_fast_gains_in_proportion():
    command = weave(UR5, 2.0)
    got = record(UR5, [{'effect': 'clock_rate', 'rate': 8e-5}], command, richness=0.0)
    since = command.t - command.t[0]
    assert np.allclose(got.t_measured, command.t + 8e-5 * since, rtol=0.0, atol=6e-7)
    assert np.allclose(got.position, dh_positions(UR5, command.q), atol=1e-10)


def test_drift_starts_at_the_first_stamp():
    command = stations(UR5, 5)
    got = record(UR5, [{'effect': 'drift', 'xyz_rate': [1e-6, -2e-6, 0.0]}], command)
    want = dh_positions(UR5, command.q) + np.outer(command.t - 100.0, [1e-6, -2e-6, 0.0])
    assert np.allclose(got.position, want, atol=1e-12)


def test_a_gear_by_direction_turns_further_one_way():
    command = stations(UR5, 10)
    ratio = {'effect': 'gear_ratio_by_direction', 'joint': 'j1', 'difference': 2e-3}
    got = record(UR5, [ratio], command, richness=0.0)
    q = command.q[:, 1]
    assert np.allclose(
        got.position, _shifted(command, 1, 1e-3 * np.sign(np.diff(q, prepend=q[0])) * q), atol=1e-8
    )


def test_a_link_that_a_motor_heats_nears_its_length_as_still_air_lets_it():
    t = np.array([0.0, 0.1, 1.0, 5.0, 60.0])
    warm = heated(10.0 * t, 10.0)
    assert warm[0] == pytest.approx(0.0, abs=1e-6) and warm[-1] == pytest.approx(1.0, abs=1e-5)
    # At first nothing is lost; near the end a quarter more than in proportion.
    assert warm[1] == pytest.approx(0.1, rel=0.04)
    assert np.abs(warm - (1.0 - np.exp(-t))).max() < 0.06
    command = stations(UR5, 5)
    grown = {'effect': 'link_warm_up', 'joint': 'j2', 'strain': 1e-3, 'warming_time': 3.0}
    got = record(UR5, [grown], command)
    for q, share, position in zip(
        command.q, heated(command.t - command.t[0], 3.0), got.position, strict=True
    ):
        built = {'j2': {key: 1e-3 * share * UR5['joints'][2][key] for key in ('a', 'd')}}
        assert np.allclose(position, dh_pose(UR5, q, built)[:3, 3], atol=1e-12)


def test_measurement_scale():
    command = stations(UR5, 5)
    got = record(UR5, [{'effect': 'measurement_scale', 'scale': 5e-5}], command)
    assert np.allclose(got.position, 1.00005 * dh_positions(UR5, command.q), atol=1e-12)


@pytest.mark.parametrize('extra, at', [({}, 20.0), ({'reference': 25.0}, 25.0)])
def test_thermal_growth_of_all_links(extra, at):
    temperature = np.linspace(20.0, 35.0, 6)
    command = stations(UR5, 6, temperature=temperature)
    growth = {'effect': 'thermal_growth', 'coefficient': 2e-5, **extra}
    got = record(UR5, [growth], command)
    for q, warm, position in zip(command.q, temperature - at, got.position, strict=True):
        built = {
            joint['name']: {'a': 2e-5 * warm * joint['a'], 'd': 2e-5 * warm * joint['d']}
            for joint in UR5['joints']
        }
        assert np.allclose(position, dh_pose(UR5, q, built)[:3, 3], atol=1e-12)
    assert np.array_equal(got.temperature, temperature)


def test_thermal_growth_of_one_link_by_a_curve():
    command = stations(UR5, 3)
    growth = {
        'effect': 'thermal_growth',
        'coefficient': 2e-5,
        'links': ['j1'],
        'rise': 10.0,
        'time_constant': 15.0,
    }
    got = record(UR5, [growth], command)
    warm = 10.0 * (1.0 - np.exp(-20.0 / 15.0))
    want = dh_pose(UR5, command.q[2], {'j1': {'a': -0.425 * 2e-5 * warm}})[:3, 3]
    assert np.allclose(got.position[2], want, atol=1e-12)


def test_thermal_growth_needs_a_temperature():
    with pytest.raises(ValueError, match='temperature'):
        record(UR5, [{'effect': 'thermal_growth', 'coefficient': 1e-5}], stations(UR5, 3))


def test_cartesian_compliance_is_in_the_tool_frame():
    wrench = np.tile([10.0, -20.0, 30.0, 0.0, 0.0, 0.0], (5, 1))
    command = stations(UR5, 5, wrench=wrench)
    got = record(
        UR5, [{'effect': 'cartesian_compliance', 'compliance': [1e-6, 2e-6, 3e-6]}], command
    )
    for q, position in zip(command.q, got.position, strict=True):
        pose = dh_pose(UR5, q)
        give = pose[:3, :3] @ [1e-5, -4e-5, 9e-5]
        assert np.allclose(position, pose[:3, 3] + give, atol=1e-12)
    assert np.array_equal(got.wrench, wrench)


def test_measurement_noise():
    command = weave(UR5, 20.0)
    got = record(UR5, [{'effect': 'measurement_noise', 'sigma': 5e-5}], command)
    scatter = got.position - dh_positions(UR5, command.q)
    assert np.std(scatter) == pytest.approx(5e-5, rel=0.05)
