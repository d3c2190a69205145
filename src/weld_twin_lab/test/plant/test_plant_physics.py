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
    dh_positions,
    gravity_torque,
    joint_displacement,
    record,
    stations,
    weave,
)

from weld_twin_lab.plant.exponentials import Command


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


def test_payload_is_seen_through_compliance_only():
    command = stations(UR5, 8)
    heavy = {'effect': 'payload', 'mass': 1.5, 'com': [0.02, 0.0, 0.1]}
    assert np.allclose(record(UR5, [heavy], command).position, dh_positions(UR5, command.q))


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
