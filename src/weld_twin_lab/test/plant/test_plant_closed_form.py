# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The plant against the product of its rows, the twin and values by hand."""

from dataclasses import fields

import numpy as np
import pytest
from plant_cells import EXACT, ROBOTS, UR5, dh_pose, dh_positions, record, stations, weave
from scipy.spatial.transform import Rotation

from weld_twin_core import Twin, catalog, effects_from_list
from weld_twin_core.effects import REGISTRY
from weld_twin_lab.blind import blind_cell
from weld_twin_lab.blind.blind_cell import (
    BlindCell,
    Take,
    as_recording,
    deviation,
    exact,
    motion,
)
from weld_twin_lab.blind.cause_sizes import FAMILIES, MOVING, draw
from weld_twin_lab.blind.scoring import rms
from weld_twin_lab.plant.exponentials import Command
from weld_twin_lab.plant.flaws import heated
from weld_twin_lab.plant.tracker import Tracker

CLOSED = {
    'joint_offset', 'link_length', 'link_offset', 'link_twist', 'axis_parallelism', 'base_pose',
    'tool_pose', 'gear_ratio', 'transmission_ripple', 'joint_coupling', 'cartesian_compliance',
    'thermal_growth', 'measurement_scale',
}  # fmt: skip
"""Families with one formula; the plant makes their motion between samples by a spline."""
NEAR = {
    'servo_lag': 0.01, 'drift': 0.01, 'quantization': 0.01, 'refraction': 0.01, 'time_delay': 0.02,
    'clock_rate': 0.03, 'backlash': 0.03, 'joint_compliance': 0.03,
    'pedestal_tilt': 0.03, 'vibration': 0.06,
}  # fmt: skip
"""How far others may be apart, in shares of what they do: springs and gaps of the plant have inertia.
Where nothing is said it is a tenth: lost motion and warming have laws of the plant's own."""


def of_the_third_joint(name, robot):
    """Return a cause of typical size on joint 3, with a spring where it shows through one alone."""
    cause = draw(name, robot, 6.0, np.random.default_rng(7))
    joint, source = robot.joint_names[2], robot.joint_names[1]
    cause = {key: {'joint': joint, 'source': source}.get(key, cause[key]) for key in cause}
    if name == 'loaded_play':
        cause['torque'] = 5.0  # of friction that holds the flank
    spring = {'effect': 'joint_compliance', 'joint': joint, 'compliance': 2e-6}
    return [cause, *([spring] if name == 'payload' else [])]


def read_by_both(name, robot):
    known = {field.name for field in fields(REGISTRY[name])} | {'effect'}
    return set(of_the_third_joint(name, robot)[0]) <= known


@pytest.fixture(scope='module', params=[('ur5', False), ('franka_panda', True)])
def seen(request):
    """Return a moving arm, or one of the other convention at rest, loaded and warming up."""
    robot, static, rng = catalog.load(request.param[0]), request.param[1], np.random.default_rng(3)
    moved = motion('free', robot, 6.0, rng)
    t, q = (10.0 * np.arange(40), rng.uniform(-1.2, 1.2, (40, robot.n))) if static else moved[:2]
    warm = np.linspace(20.0, 32.0, len(t))
    load = np.tile([10.0, -20.0, 30.0, 1.0, 2.0, -3.0], (len(t), 1))
    taken = Take(Command(t, q, static=static, temperature=warm, wrench=load), 11)
    cell = BlindCell(robot, Tracker(rate=60.0))
    clean = as_recording('clean', blind_cell.record(cell, (), taken, exact(cell.tracker)))
    nominal = Twin(robot).poses(clean, clean.measured.t)
    np.testing.assert_allclose(clean.measured.position, nominal.position, atol=2e-6)
    np.testing.assert_allclose(clean.measured.rotation, nominal.rotation, atol=5e-6)
    return cell, taken, clean


BOTH = [name for name in FAMILIES if read_by_both(name, catalog.load('ur5'))]


@pytest.mark.parametrize('name', BOTH)
def test_twin_and_plant_move_the_tool_alike(name, seen):
    cell, taken, clean = seen
    if clean.joints.static and name in MOVING:
        pytest.skip('it shows in motion alone')
    both = of_the_third_joint(name, cell.robot)

    def by_twin(causes):
        twin = Twin(cell.robot, effects_from_list(causes, cell.robot))
        return twin.poses(clean, clean.measured.t).position

    off = by_twin(both) - by_twin(both[1:])
    by_plant = deviation(cell, both, taken) - deviation(cell, both[1:], taken)
    assert rms(off - by_plant) < (1e-5 if name in CLOSED else NEAR.get(name, 0.1)) * rms(by_plant)


def test_a_link_that_a_motor_heats_nears_its_length_as_still_air_lets_it():
    t = np.array([0.0, 0.1, 1.0, 5.0, 60.0])
    warm = heated(10.0 * t, 10.0)
    assert warm[0] == pytest.approx(0.0, abs=1e-6) and warm[-1] == pytest.approx(1.0, abs=1e-5)
    # At first nothing is lost; near the end a quarter more than in proportion.
    assert warm[1] == pytest.approx(0.1, rel=0.04)
    assert np.abs(warm - (1.0 - np.exp(-t))).max() < 0.06


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


def test_measurement_noise():
    command = weave(UR5, 20.0)
    got = record(UR5, [{'effect': 'measurement_noise', 'sigma': 5e-5}], command)
    scatter = got.position - dh_positions(UR5, command.q)
    assert np.std(scatter) == pytest.approx(5e-5, rel=0.05)


@pytest.mark.parametrize('name', ROBOTS)
def test_clean_stations_are_the_dh_product(name):
    robot = ROBOTS[name]
    command = stations(robot, 40)
    got = record(robot, [], command)
    for q, position, quaternion in zip(command.q, got.position, got.quaternion, strict=True):
        want = dh_pose(robot, q)
        assert np.abs(position - want[:3, 3]).max() < 1e-12
        assert np.abs(Rotation.from_quat(quaternion).as_matrix() - want[:3, :3]).max() < 1e-12
    assert got.static
    assert np.array_equal(got.t_measured, command.t)


@pytest.mark.parametrize('name', ROBOTS)
def test_clean_motion_is_the_dh_product(name):
    robot = ROBOTS[name]
    command = weave(robot, 2.0)
    got = record(robot, [], command)
    assert np.abs(got.position - dh_positions(robot, command.q)).max() < 1e-10
    assert np.allclose(got.q, command.q, rtol=0.0, atol=1e-14)
    assert np.allclose(got.qd[1:-1], np.gradient(command.q, command.t, axis=0)[1:-1], atol=2e-3)


def test_between_samples_the_motion_is_smooth():
    command, fine = weave(UR5, 1.5), weave(UR5, 1.5, rate=1000.0)
    got = record(UR5, [], command, Tracker(rate=77.0))
    want = np.stack(
        [np.interp(got.t_measured, fine.t, column) for column in dh_positions(UR5, fine.q).T],
        axis=1,
    )
    assert np.abs(got.position - want).max() < 2e-6


def test_unknown_names_are_refused():
    with pytest.raises(ValueError, match='unknown effect'):
        record(UR5, [{'effect': 'gremlins'}], stations(UR5, 3), EXACT)
    with pytest.raises(ValueError, match='no joint'):
        record(UR5, [{'effect': 'backlash', 'joint': 'knee', 'width': 1e-4}], stations(UR5, 3))
