# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What belongs to a set-up stays with it; what belongs to the arm goes along."""

from dataclasses import replace

import numpy as np
import pytest

from weld_twin_core.arm import catalog
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, usable
from weld_twin_core.diagnosis.unseen.held_out_shrink import _for_bag
from weld_twin_core.effects import ToolPose, ToolSlip, effect_from_mapping
from weld_twin_core.effects.dated import in_use, of_the_robot, seen_from
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_core.twin.twin import Twin

SECOND = 1_000_000_000
ROBOT = catalog.load('ur10')
EFFECTS = tuple(
    effect_from_mapping(e)
    for e in (
        {'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': 1e-3},
        {'effect': 'setup_settling', 'xyz': [1e-3, 0.0, 0.0], 'time_constant': 40.0, 'start': 0.0},
        {'effect': 'setup_step', 'xyz': [0.0, 5e-4, 0.0], 'time': 60.5},
    )
)


def stations(first, count):
    """Return stations of one arm pose, at seconds after the epoch of the whole recording."""
    q = np.tile([0.1, -1.2, 1.4, -0.3, 1.5, 0.2], (count, 1))
    motion = JointMotion(np.arange(float(count)), q, static=True)
    return Recording('part', motion, epoch_ns=(1000 + first) * SECOND)


def positions(effects, recording):
    return Twin(ROBOT, effects).poses(recording).position


@pytest.mark.parametrize('first', [0, 30, 61])
def test_a_part_of_the_recording_sees_the_set_up_as_it_stood_then(first):
    whole = stations(0, 100)
    part = stations(first, 100 - first)
    carried = seen_from(EFFECTS, whole.epoch_ns, whole.span_ns, part)
    np.testing.assert_allclose(
        positions(carried, part), positions(EFFECTS, whole)[first:], atol=1e-15
    )


@pytest.mark.parametrize('first', [-500, 5000])
def test_another_day_sees_the_arm_alone(first):
    whole, other = stations(0, 100), stations(first, 20)
    carried = seen_from(EFFECTS, whole.epoch_ns, whole.span_ns, other)
    assert carried == of_the_robot(EFFECTS) == EFFECTS[:1]


@pytest.mark.parametrize('slipped', ['before', 'after', 'in it'])
@pytest.mark.parametrize('epoch', [0, 5000])
def test_a_held_out_recording_without_a_date_has_the_slip_where_it_was(slipped, epoch):
    """Tables and simulated time begin at zero again, whenever they were recorded."""
    slip = ToolSlip(xyz=[1e-3, 0.0, 0.0], time=50.0)
    there = {'before': ToolPose(slip.xyz), 'after': ToolPose(), 'in it': replace(slip, time=10.0)}
    # A part of the one diagnosed has the slip at its own stamps; nothing tells it of another.
    first = 40 if slipped == 'in it' else epoch
    other = stations(first, 20)
    seen = Twin(ROBOT, [there[slipped]]).poses(other)
    measured = other.with_measured(Measurements(other.joints.t, seen.position))
    problem = Problem((usable(measured),), frozenset())
    model = Model(ROBOT, (ROBOT.T_world_base,), found=(slip,))
    own = _for_bag(problem, model, (stations(0, 100),), 1.0)
    assert np.abs(problem.residuals(own)[0][:3]).max() < 1e-9


DATE = 1_700_000_000


@pytest.mark.parametrize(
    ('epoch', 'first', 'same', 'slipped', 'told'),
    [
        # Tables and simulated time: both begin near zero, and one began after the other all the same.
        (0, 0, False, 20 * [True], 'recorded after that, for stamps without a date'),
        (0, 0, True, 10 * [False] + 10 * [True], ''),
        (DATE, DATE + 3, False, 7 * [False] + 13 * [True], ''),
        (DATE, DATE + 5000, False, 20 * [True], 'recorded after that.'),
        (DATE, DATE - 5000, False, 20 * [False], 'recorded before that.'),
        (DATE, 0, False, 20 * [True], 'recorded after that, for stamps without a date'),
    ],
)
def test_a_tool_that_slipped_stays_slipped(epoch, first, same, slipped, told):
    slip = effect_from_mapping({'effect': 'tool_slip', 'xyz': [1e-3, 0.0, 0.0], 'time': 10.0})
    other = stations(first - 1000, 20)
    span = tuple(epoch * SECOND + end * SECOND for end in (0, 100))
    carried, said = in_use([slip], epoch * SECOND, span, other, same=same)
    moved = np.linalg.norm(positions(carried, other) - positions((), other), axis=1)
    np.testing.assert_array_equal(moved > 5e-4, slipped)
    assert [told in sentence for sentence in said] == ([True] if told else [])


@pytest.mark.parametrize(('lasted', 'told'), [(19, False), (10, True)])
def test_growing_longer_than_anybody_saw_is_told(lasted, told):
    drift = effect_from_mapping({'effect': 'drift', 'xyz_rate': [1e-6, 0.0, 0.0]})
    _, said = in_use([drift], 0, (0, lasted * SECOND), stations(0, 20), same=False)
    assert [f'lasted {lasted} s' in s and 'lasts 19 s' in s for s in said] == [True] * told
