# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Arms of the plant that are off by a little everywhere, with play in one gear: play is named."""

import numpy as np
from diagnosis_cells import all_but, recorded

from weld_twin_core.arm.catalog import load
from weld_twin_core.diagnosis import diagnose
from weld_twin_lab.blind.blind_cell import as_recording
from weld_twin_lab.plant.exponentials import Command
from weld_twin_lab.plant.plant import run
from weld_twin_lab.plant.tracker import Tracker

LITTLE = 2e-5
"""What every joint of a good arm is off by [rad]; links as much at half a metre."""
LOST = ('backlash', 'friction', 'hysteresis', 'loaded_play', 'gear_ratio_by_direction')


def flaws(robot, play, joint, seed):
    """Return play in one gear, a wrong zero, a twisted link, and what each joint is off by."""
    causes = [
        {'effect': 'backlash', 'joint': joint, 'width': play},
        {'effect': 'joint_offset', 'joint': robot.joint_names[2], 'offset': 8e-4},
        {'effect': 'link_twist', 'joint': robot.joint_names[0], 'dalpha': 5e-4},
    ]
    rng = np.random.default_rng(seed)
    for joint in robot.joint_names:
        zero, twist, longer, *wheels = LITTLE * rng.normal(size=5)
        causes += [
            {'effect': 'joint_offset', 'joint': joint, 'offset': zero},
            {'effect': 'link_twist', 'joint': joint, 'dalpha': twist},
            {'effect': 'link_length', 'joint': joint, 'da': 0.5 * longer},
        ]
        for order, wheel in enumerate(wheels, 1):
            wave = {'amplitude': abs(wheel), 'order': order, 'phase': rng.uniform(-3.0, 3.0)}
            causes.append({'effect': 'transmission_ripple', 'joint': joint, **wave})
    return causes


def lost_motion(diagnosis, joint):
    """Return the names of what depends on direction at a joint."""
    told = [c for c in diagnosis.causes if c.dependence and c.dependence[0][0] == 'direction']
    (cause,) = [c for c in told if c.place[0][0] == joint and c.probability > 0.5]
    return {site.effect for site, _ in cause.name if site.joint == joint}


def test_play_is_named_where_a_field_of_small_errors_is_left_beside_it():
    robot = load('kuka_kr16_2')
    seen = recorded(robot, flaws(robot, 6e-4, 'joint_a4', 3), seed=3)
    found = diagnose([seen], robot, experiment=False)
    assert found.status in ('identified', 'ambiguous')
    assert lost_motion(found, 'joint_a4') == {'backlash'}


def test_play_is_among_the_names_where_friction_may_take_a_wrong_zero_along():
    """The joint never rests: what friction loses more of one way is a constant, as its zero is."""
    robot, rng = load('ur5'), np.random.default_rng(2)
    play, joint = rng.uniform(3e-4, 7e-4), robot.joint_names[0]
    t = np.arange(0.0, 15.0, 0.025)
    home = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
    pace, turn = rng.uniform(0.5, 1.3, 6), rng.uniform(0.0, 2.0 * np.pi, 6)
    command = Command(t, home + 0.6 * np.sin(np.outer(t, pace) + turn))
    made = run(
        robot.to_mapping(), flaws(robot, play, joint, 2), command, Tracker(sigma=2e-5), rng, 0.0
    )
    others = all_but(*LOST, 'joint_offset', 'link_twist', 'link_length', 'transmission_ripple')
    told = diagnose([as_recording('run', made)], robot, exclude=others, experiment=False)
    assert 'backlash' in lost_motion(told, joint)
