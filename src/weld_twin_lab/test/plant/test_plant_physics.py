# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects with physics: what comes out of MuJoCo against the parameters stated."""

import time

import numpy as np
import pytest
from plant_cells import (
    PANDA_ON_TRACK,
    ROBOTS,
    UR5,
    dh_pose,
    dh_positions,
    gravity_torque,
    joint_displacement,
    record,
    stations,
    weave,
)
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from weld_twin_lab.plant.exponentials import Command


def _ramp(joint, speed, duration=3.0):
    """Return one joint sweeping at a constant speed after a smooth start."""
    t = np.arange(0.0, duration, 0.008)
    q = np.tile([0.3, -1.2, 1.4, -1.7, -1.5, 0.2], (len(t), 1))
    late = np.clip(t - 0.5, 0.0, None)
    q[:, joint] += speed * (late - 0.25 * (1.0 - np.exp(-late / 0.25)))
    return Command(t, q)


@pytest.mark.parametrize('richness', [0.0, 1.0])
@pytest.mark.parametrize('constant', [0.004, 0.02, 0.08])
def test_servo_lag_on_a_ramp(constant, richness):
    lag = {'effect': 'servo_lag', 'joint': 'j2', 'time_constant': constant}
    moved = joint_displacement(UR5, [lag], _ramp(2, 0.4), 'j2', richness)
    assert moved[-1] == pytest.approx(-0.4 * constant, rel=0.01)


def test_servo_lag_on_every_joint_is_a_delay():
    command = weave(UR5, 6.0, frequency=0.05)
    effects = [{'effect': 'servo_lag', 'joint': f'j{i}', 'time_constant': 0.01} for i in range(6)]
    got = record(UR5, effects, command)
    late = CubicSpline(command.t, dh_positions(UR5, command.q))(command.t - 0.01)
    gap = np.abs(got.position - dh_positions(UR5, command.q)).max()
    assert np.abs(got.position - late)[200:].max() < 0.02 * gap


@pytest.mark.parametrize('richness, share', [(0.0, 0.01), (1.0, 0.06)])
def test_vibration_follows_its_equation(richness, share):
    command = weave(UR5, 6.0)
    omega, zeta, gain = 2.0 * np.pi * 9.0, 0.04, 0.7
    shake = {'effect': 'vibration', 'joint': 'j1', 'frequency': 9.0, 'damping': zeta, 'gain': gain}
    moved = joint_displacement(UR5, [shake], command, 'j1', richness)
    qdd = CubicSpline(command.t, command.q[:, 1]).derivative(2)
    sol = solve_ivp(
        lambda s, y: [y[1], -gain * qdd(s) - 2 * zeta * omega * y[1] - omega**2 * y[0]],
        (0.0, command.t[-1]),
        [0.0, 0.0],
        t_eval=command.t,
        max_step=1e-3,
    )
    error = np.sqrt(np.mean((moved - sol.y[0]) ** 2))
    assert error < share * np.sqrt(np.mean(sol.y[0] ** 2))


@pytest.mark.parametrize('width', [5e-5, 5e-4, 3e-3])
@pytest.mark.parametrize('joint', [0, 2, 5])
def test_backlash_effective_width(joint, width):
    command = weave(UR5, 10.0)
    play = {'effect': 'backlash', 'joint': f'j{joint}', 'width': width}
    moved = joint_displacement(UR5, [play], command, f'j{joint}')
    rate = np.gradient(command.q[:, joint], command.t)
    settled = np.abs(rate) > 0.5 * np.abs(rate).max()
    up, down = settled & (rate > 0), settled & (rate < 0)
    measured = np.median(moved[down]) - np.median(moved[up])
    assert measured == pytest.approx(width, rel=0.03)


def test_backlash_of_every_joint_stays_close_to_the_textbook():
    command = weave(UR5, 20.0)
    play = [{'effect': 'backlash', 'joint': f'j{i}', 'width': 5e-4} for i in range(6)]
    clean = record(UR5, [], command).position
    ideal = record(UR5, play, command, richness=0.0).position - clean
    rich = record(UR5, play, command).position - clean
    assert np.sqrt(np.mean((rich - ideal) ** 2)) < 0.02 * np.sqrt(np.mean(ideal**2))
    assert np.abs(rich - ideal).max() > 1e-6


def test_backlash_holds_its_place_in_a_dwell():
    t = np.arange(0.0, 24.0, 0.008)
    q = np.tile([0.3, -1.2, 1.4, -1.7, -1.5, 0.2], (len(t), 1))
    # up and down, then down by half a gap, so that the link is left in the middle of it
    q[:, 1] += 0.1 * np.sin(np.pi * np.clip(t / 2.0, 0.0, 1.0)) ** 2
    rest = np.clip((t - 3.0) / 1.0, 0.0, 1.0)
    q[:, 1] += 5e-4 * rest**3 * (10.0 - 15.0 * rest + 6.0 * rest**2)
    play = {'effect': 'backlash', 'joint': 'j1', 'width': 1e-3}
    moved = joint_displacement(UR5, [play], Command(t, q), 'j1')
    assert np.abs(moved[t > 4.5]).max() < 1e-4
    assert abs(moved[-1] - moved[t > 4.5][0]) < 3e-5


def test_backlash_at_rest_follows_the_approach():
    q = np.tile([0.3, -1.2, 1.4, -1.7, -1.5, 0.2], (4, 1))
    q[:, 1] += [0.0, 0.1, -0.1, -0.1 + 4e-4]
    command = Command(np.arange(4.0), q, static=True)
    play = {'effect': 'backlash', 'joint': 'j1', 'width': 1e-3}
    moved = joint_displacement(UR5, [play], command, 'j1')
    assert moved == pytest.approx([0.0, -5e-4, 5e-4, 1e-4], abs=1e-6)


@pytest.mark.parametrize('name', ROBOTS)
@pytest.mark.parametrize('richness, share', [(0.0, 1e-3), (1.0, 0.02)])
def test_static_sag_is_compliance_times_torque(name, richness, share):
    robot, command = ROBOTS[name], stations(ROBOTS[name], 12)
    springs = [
        {'effect': 'joint_compliance', 'joint': joint['name'], 'compliance': 2e-6}
        for joint in robot['joints']
    ]
    got = record(robot, springs, command, richness=richness).position
    clean = dh_positions(robot, command.q)
    sagged = command.q + 2e-6 * np.array([gravity_torque(robot, q) for q in command.q])
    want = dh_positions(robot, sagged) - clean
    assert np.abs(got - clean - want).max() < share * np.abs(want).max()


@pytest.mark.parametrize('moving', [False, True])
def test_tool_wrench_bends_the_joints(moving):
    robot = {key: value for key, value in UR5.items() if key not in ('links', 'payload')}
    make = (
        (lambda **rest: weave(robot, 1.0, reach=0.0, **rest))
        if moving
        else (lambda **rest: stations(robot, 125, **rest))
    )
    load = np.array([20.0, -30.0, 40.0, 1.0, 2.0, -3.0])
    command = make(wrench=np.tile(load, (125, 1)))
    springs = [
        {'effect': 'joint_compliance', 'joint': f'j{i}', 'compliance': 5e-6} for i in range(6)
    ]
    got = record(robot, springs, command).position[-1]
    q = command.q[-1]
    sagged = q + 5e-6 * _wrench_torque(robot, q, load)
    want = dh_pose(robot, sagged)[:3, 3] - dh_pose(robot, q)[:3, 3]
    error = np.linalg.norm(got - dh_pose(robot, q)[:3, 3] - want)
    assert error < 0.03 * np.linalg.norm(want)


def _wrench_torque(robot, q, load):
    """Return the torque of the wrench on each joint by virtual work."""
    turn, out, step = dh_pose(robot, q)[:3, :3], np.zeros(len(q)), 1e-6
    for i in range(len(q)):
        one, two = (dh_pose(robot, q + sign * step * np.eye(len(q))[i]) for sign in (1.0, -1.0))
        spin = (one[:3, :3] - two[:3, :3]) / (2.0 * step) @ turn.T
        moved = (one[:3, 3] - two[:3, 3]) / (2.0 * step)
        turned = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
        out[i] = (turn @ load[:3]) @ moved + (turn @ load[3:]) @ turned
    return out


def test_payload_is_seen_through_compliance_only():
    command = stations(UR5, 8)
    heavy = {'effect': 'payload', 'mass': 1.5, 'com': [0.02, 0.0, 0.1]}
    spring = {'effect': 'joint_compliance', 'joint': 'j1', 'compliance': 1e-5}
    assert np.allclose(record(UR5, [heavy], command).position, dh_positions(UR5, command.q))
    moved = joint_displacement(UR5, [heavy, spring], command, 'j1')
    want = [1e-5 * gravity_torque(UR5, q, (1.5, [0.02, 0.0, 0.1]))[1] for q in command.q]
    assert np.abs(moved - want).max() < 0.03 * np.abs(want).max()


def test_richness_sets_how_much_inertia_a_spring_feels():
    command = weave(UR5, 10.0, frequency=0.3)
    springs = [
        {'effect': 'joint_compliance', 'joint': f'j{i}', 'compliance': 5e-6} for i in range(6)
    ]
    ideal = record(UR5, springs, command, richness=0.0).position
    gaps = [
        np.sqrt(np.mean((record(UR5, springs, command, richness=rich).position - ideal) ** 2))
        for rich in (0.05, 0.5, 1.0)
    ]
    assert gaps[0] < 0.15 * gaps[2]
    assert gaps[1] == pytest.approx(0.5 * gaps[2], rel=0.1)


def test_springs_of_a_slide_and_of_light_joints_hold_together():
    command = weave(PANDA_ON_TRACK, 5.0, reach=0.3)
    springs = [
        {'effect': 'joint_compliance', 'joint': joint['name'], 'compliance': c}
        for joint, c in zip(
            PANDA_ON_TRACK['joints'], (1e-7, 1e-7, 1e-7, 1e-6, 1e-4, 1e-5, 1e-3, 1e-6), strict=True
        )
    ]
    got = record(PANDA_ON_TRACK, springs, command).position
    assert np.abs(got - dh_positions(PANDA_ON_TRACK, command.q)).max() < 2e-2


def test_gap_and_spring_in_one_joint_add():
    command = weave(UR5, 10.0, frequency=0.08)
    gap = {'effect': 'backlash', 'joint': 'j2', 'width': 5e-4}
    spring = {'effect': 'joint_compliance', 'joint': 'j2', 'compliance': 1e-5}
    both = joint_displacement(UR5, [gap, spring], command, 'j2')
    ideal = joint_displacement(UR5, [gap, spring], command, 'j2', 0.0)
    assert np.sqrt(np.mean((both - ideal) ** 2)) < 0.05 * np.sqrt(np.mean(ideal**2))


def test_a_minute_takes_seconds():
    effects = [
        {'effect': name, 'joint': joint, **rest}
        for name, joint, rest in (
            ('backlash', 'j2', {'width': 5e-4}),
            ('joint_compliance', 'j1', {'compliance': 1e-5}),
            ('servo_lag', 'j0', {'time_constant': 0.02}),
        )
    ]
    command = weave(UR5, 60.0)
    start = time.process_time()
    record(UR5, effects, command)
    assert time.process_time() - start < 5.0
