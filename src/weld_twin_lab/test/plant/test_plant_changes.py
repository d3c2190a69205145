# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings of the plant on two days: what changed between them is found, and nothing else."""

import numpy as np
import pytest
from plant_cells import UR5

import weld_twin_core as wt
from weld_twin_core.arm.robot import Robot
from weld_twin_core.effects import REGISTRY
from weld_twin_lab.plant.exponentials import Command
from weld_twin_lab.plant.plant import run
from weld_twin_lab.plant.tracker import Tracker

COMMON = [
    {'effect': 'link_twist', 'joint': 'j2', 'dalpha': 6e-4},
    {'effect': 'joint_compliance', 'joint': 'j2', 'compliance': 1e-5},
]
REST = [name for name in REGISTRY if name not in ('link_twist', 'joint_compliance')]


def day(seed, *changed):
    """Return seventy stations at rest as a tracker saw them."""
    rng = np.random.default_rng(seed)
    q = np.array([0, -1.2, 1.3, -1.2, -1.5, 0]) + rng.uniform(-0.8, 0.8, (70, 6))
    command = Command(4.0 * np.arange(70), q, static=True)
    seen = run(UR5, [*COMMON, *changed], command, Tracker(sigma=2e-5), rng)
    joints = wt.JointMotion(seen.t_joint, seen.q, None, True)
    measured = wt.Measurements(seen.t_measured, seen.position)
    return wt.Recording(f'day {seed}', joints, measured)


@pytest.mark.parametrize(
    ('changed', 'told'),
    [
        ([], []),
        (
            [
                {'effect': 'joint_offset', 'joint': 'j3', 'offset': 7e-4},
                {'effect': 'tool_pose', 'xyz': [1e-3, 0.0, 5e-4]},
            ],
            [('joint_offset', 'j3'), ('tool_pose', None)],
        ),
    ],
)
def test_what_the_plant_changed_between_two_days(changed, told):
    """The truth of the second day stands in the answer, within four standard errors."""
    found = wt.diagnose(
        [day(1), day(2, *changed)],
        Robot.from_mapping(UR5),
        exclude=REST,
        may_change='joint_offset,tool_pose,base_pose',
        experiment=False,
    )
    entries = sorted(found.as_dict()['changed'], key=lambda entry: entry['effect'])
    assert [(e['effect'], e['joint']) for e in entries] == told
    for truth, entry in zip(changed, entries, strict=True):
        if entry['joint']:
            assert entry['value'] == pytest.approx(truth['offset'], abs=4 * entry['std'])
        else:
            off = np.abs(np.array(entry['value']['xyz']) - truth['xyz'])
            assert (off < 4 * np.array(entry['std']['xyz'])).all()
