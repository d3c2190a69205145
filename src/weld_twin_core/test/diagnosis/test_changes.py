# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Several recordings of one arm: what changed between them, and that nothing did."""

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core import Beliefs, ModelError
from weld_twin_core.diagnosis.algebra.fit import robust_scale
from weld_twin_core.diagnosis.algebra.problem import Change, Problem
from weld_twin_core.diagnosis.frames.aligned import aligned
from weld_twin_core.diagnosis.frames.changes import (
    _evidence,
    _sure,
    list_changes,
    list_undetectable,
    with_changes,
)
from weld_twin_core.effects import REGISTRY, Backlash, JointOffset, LinkTwist, ToolPose

NOISE = 3e-5
COMMON = (JointOffset('elbow_joint', 8e-4), LinkTwist('shoulder_lift_joint', 6e-4))
ALL = ('joint_offset', 'tool_pose', 'base_pose')


@pytest.fixture(scope='module')
def robot():
    return wt.load('ur5')


def day(robot, seed, *changed, base=(0.0, 0.0, 0.0), turned=False, near=0.0):
    """Return sixty stations of one arm on one day."""
    rng = np.random.default_rng(seed)
    middle = np.array([0.0, -1.2, 1.3, -1.2 + near, -1.5, near])
    t = 5.0 * np.arange(60)
    stations = wt.JointMotion(t, middle + rng.uniform(-0.8, 0.8, (60, 6)), static=True)
    placed = np.array(robot.T_world_base)
    placed[:3, 3] += base
    commanded = wt.Recording(f'day {seed}', stations)
    poses = wt.Twin(robot.with_frames(base=placed), (*COMMON, *changed)).poses(commanded, t)
    noise = NOISE * rng.standard_normal(poses.position.shape)
    rotation = poses.rotation if turned else None
    return commanded.with_measured(wt.Measurements(t, poses.position + noise, rotation))


def seen(robot, recordings, families, align=''):
    """Return what is told to have changed, on top of the errors that all have in common."""
    problem, model = aligned(recordings, robot, align, COMMON)
    problem, model = with_changes(problem, model, families, Beliefs())
    scale = robust_scale(problem, problem.residuals(model))
    return list_changes(problem, model, scale, np.zeros(0), families)


def test_nothing_changed(robot):
    """Noise alone is no change, with frames known and fitted."""
    pair = [day(robot, 1), day(robot, 2)]
    assert seen(robot, pair, ALL) == ()
    assert seen(robot, pair, ('joint_offset',), 'base,tool') == ()


@pytest.mark.parametrize('align', ['', 'base', 'base,tool'])
def test_a_joint_that_was_mastered_anew(robot, align):
    """Joint, recording and value are right, within what its standard error says."""
    found = seen(
        robot, [day(robot, 1), day(robot, 2, JointOffset('elbow_joint', 1e-3))], ALL[:2], align
    )
    (only,) = found
    assert (only.recording, only.effect.site) == (1, 'elbow_joint')
    std = only.std['offset']
    assert 1e-6 < std < 1e-4
    assert only.effect.offset == pytest.approx(1e-3, abs=4 * std)


def test_another_tool(robot):
    """A tool that was changed by centimetres is no crowd of outliers."""
    (only,) = seen(robot, [day(robot, 1), day(robot, 2, ToolPose((5e-2, 0, 2e-3)))], ALL, 'base')[
        :1
    ]
    assert only.effect.name == 'tool_pose'
    assert only.effect.xyz == pytest.approx((5e-2, 0.0, 2e-3), abs=1e-4)


def test_bases_that_are_fitted_are_compared(robot):
    """The instrument stood elsewhere: told by how much, although bases are fitted anyway."""
    (only,) = seen(robot, [day(robot, 1), day(robot, 2, base=(2e-3, 0, 1e-3))], ALL, 'base')
    assert only.effect.name == 'base_pose'
    assert only.effect.xyz == pytest.approx((2e-3, 0.0, 1e-3), abs=1e-4)


def test_what_cannot_be_told_is_listed(robot):
    """A base that is fitted is the zero of the first joint; the last turns a point on its axis."""
    problem, model = aligned([day(robot, 1), day(robot, 2)], robot, 'base', COMMON)
    hidden = ['joint_offset of shoulder_pan_joint', 'joint_offset of wrist_3_joint']
    names = list_undetectable(problem, model, ('joint_offset', 'tool_pose'))
    assert names == [*hidden, 'tool_pose (in part)']


def test_one_recording_changes_nothing(robot):
    """There is nothing to compare a lone recording with."""
    problem, model = aligned([day(robot, 1)], robot, '', COMMON)
    assert with_changes(problem, model, ALL, Beliefs()) == (problem, model)
    assert isinstance(problem, Problem)


def test_only_constant_errors_may_change(robot):
    """Play that grew is no constant error; the sentence lists those that are."""
    with pytest.raises(ModelError, match="may_change: 'backlash' is no error that stays the same"):
        wt.diagnose([day(robot, 1), day(robot, 2)], robot, may_change='backlash', experiment=False)


def test_a_change_shows_once_the_play_that_hid_it_is_found(robot):
    """What differs is asked for again after the search: before it, play is larger than a change."""
    play, anew = Backlash('shoulder_lift_joint', 5e-3), JointOffset('elbow_joint', 3e-4)
    pair = [day(robot, 1, play), day(robot, 2, play, anew, near=0.5)]
    rest = [name for name in REGISTRY if name not in ('joint_offset', 'link_twist', 'backlash')]
    found = wt.diagnose(pair, robot, exclude=rest, may_change='joint_offset', experiment=False)
    (entry,) = found.as_dict()['changed']
    assert (entry['recording'], entry['joint']) == (1, 'elbow_joint')
    assert entry['value'] == pytest.approx(3e-4, abs=3e-5)


@pytest.mark.parametrize('parts', [[], [1], [2], [1, 2]])
def test_evidence_is_what_is_left_of_a_likelihood_once_all_values_are_summed_over(parts):
    """On a grid of eight standard deviations about the middle, whatever is not fitted at zero."""
    columns = np.random.default_rng(6).normal(size=(3, 9))
    normal, right = columns @ columns.T, columns @ np.linspace(-2.0, 3.0, 9)
    ridge = np.array([0.0, 0.5, 2.0])
    normal += np.diag(ridge)
    index = [0, *parts]
    own = normal[np.ix_(index, index)]
    middle, spread = np.linalg.solve(own, right[index]), np.sqrt(np.diag(np.linalg.inv(own)))
    axes = [m + s * np.linspace(-8.0, 8.0, 81) for m, s in zip(middle, spread, strict=True)]
    x = np.stack(np.meshgrid(*axes, indexing='ij')).reshape(len(index), -1)
    likely = np.exp(right[index] @ x - 0.5 * (x * (own @ x)).sum(axis=0))
    cell = np.prod([axis[1] - axis[0] for axis in axes])
    believed = np.sqrt(ridge[parts] / (2.0 * np.pi)).prod() / np.sqrt(2.0 * np.pi)
    told = _evidence(normal, right, ridge, np.array([0]), [np.array([k]) for k in parts])
    assert told == pytest.approx(np.log(likely.sum() * cell * believed), abs=1e-6)


@pytest.mark.parametrize(('times', 'sure'), [(2.95, False), (3.05, True)])
def test_a_change_is_reported_from_three_standard_errors_of_all_its_numbers(times, sure):
    rng = np.random.default_rng(7)
    root = rng.normal(size=(6, 6))
    way = root @ rng.choice([-1.0, 1.0], 6)  # one standard deviation along every axis
    pose = ToolPose().fit.with_coordinates(1e-4 * times * way)
    assert _sure(Change(1, pose), 1e-8 * root @ root.T) is sure
