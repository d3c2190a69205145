# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Verdicts name what data can show: kinds, frames, and what is absent."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cells import SIGMA, effect, known_scale, recorded, sites, tiny
from scipy.spatial.transform import Rotation
from small_arm import small_arm

from weld_twin_core import Beliefs, DataError, JointMotion, Measurements, Recording, diagnose, load
from weld_twin_core.diagnosis.algebra.fit import fit
from weld_twin_core.diagnosis.algebra.problem import Problem
from weld_twin_core.diagnosis.algebra.workspace import Role
from weld_twin_core.diagnosis.hypotheses.library import build
from weld_twin_core.diagnosis.unseen.unseen_stretches import Unseen
from weld_twin_core.diagnosis.unseen.where import structure


def with_bend(size):
    """Return a problem whose elbow turns out wrong by a bump that no family has."""
    problem, model = tiny(count=600)
    recording = problem.recordings[0]
    measured = recording.measured
    q = recording.joints.q
    bump = size * np.exp(-0.5 * ((q[:, 2] - 0.7) / 0.2) ** 2)
    features = problem.features(model)[0]
    moved = features.column(('q', 2))[:3] * bump
    bent = Measurements(measured.t, measured.position + moved.T, measured.rotation)
    return Problem((recording.with_measured(bent),)), model


@pytest.mark.parametrize(('size', 'seen'), [(3e-4, True), (0.0, False)])
def test_what_depends_on_the_angle_of_a_joint_is_said_to_and_noise_is_not(size, seen):
    problem, model = with_bend(size)
    scale = known_scale(problem)
    bare = fit(problem, model, scale)
    found = structure(Unseen.of(problem, scale, bare, np.zeros(0)), model, bare, Beliefs())
    assert (found.gain > 0.03 and found.sure > 3.0) is seen
    assert (found.depends_on[:1] == ('angle at elbow_joint',)) is seen


def library(problem, model, exclude=()):
    return build(problem, model, known_scale(problem), exclude)


def test_families_taken_out_only_stand_beside_and_are_said_to_be_absent():
    problem, model = tiny()
    found = library(problem, model, ('joint_offset',))
    roles = {unit.role for unit in found.units if unit.site.effect == 'joint_offset'}
    assert roles == {Role.TAKEN_OUT}
    assert found.absent['joint_offset'] == 'excluded by the user'
    assert any(unit.site.effect == 'joint_offset' for unit in library(problem, model).units)


def test_what_the_data_cannot_show_is_absent_with_its_reason():
    found = library(*tiny())
    assert found.absent['servo_lag'] == 'static stations carry no velocity'
    assert found.absent['cartesian_compliance'] == 'no tool wrench was recorded'


@pytest.mark.parametrize(
    ('align', 'gone'), [(('base',), {'base_pose'}), (('tool',), {'tool_pose'}), ((), set())]
)
def test_frames_fitted_as_nuisance_are_no_cause(align, gone):
    found = library(*tiny(align=align))
    names = {unit.site.effect for unit in found.units}
    assert {'base_pose', 'tool_pose'} - names == gone


def test_the_columns_of_a_unit_are_the_change_of_pose_its_effect_makes():
    problem, model = tiny()
    found = library(problem, model)
    scale = known_scale(problem)
    for family, joint, key, step in (
        ('link_twist', 'elbow_joint', 'dalpha', 1e-6),
        ('gear_ratio', 'wrist_1_joint', 'scale', 1e-6),
        ('joint_compliance', 'shoulder_lift_joint', 'compliance', 1e-9),
    ):
        unit = next(unit for unit in found.units if unit.site == (family, joint))
        moved = model.with_found((effect(family, joint=joint, **{key: step}),))
        change = problem.whitened(problem.residuals(model), scale) - problem.whitened(
            problem.residuals(moved), scale
        )
        column = found.columns.written_out()[unit.columns[0][0]]
        assert np.linalg.norm(column * step - change) < 1e-3 * np.linalg.norm(change)


def test_a_tool_that_slipped_is_told_from_a_base_that_moved():
    problem, model = tiny(count=400)
    recording = problem.recordings[0]
    measured = recording.measured
    slip = measured.rotation @ np.array([3e-4, 0.0, 0.0])
    slip[: measured.t.size // 2] = 0.0
    slipped = Measurements(measured.t, measured.position + slip, measured.rotation)
    problem = Problem((recording.with_measured(slipped),))
    scale = known_scale(problem)
    bare = fit(problem, model, scale)
    found = structure(Unseen.of(problem, scale, bare, np.zeros(0)), model, bare, Beliefs())
    assert found.depends_on[0].endswith('at tool')


def test_every_joint_that_hardly_moves_is_named_with_the_family_it_cannot_show():
    problem, model = tiny()
    recording = problem.recordings[0]
    q = recording.joints.q.copy()
    q[:, 3:5] = q[:1, 3:5]
    still = replace(recording, joints=replace(recording.joints, q=q))
    found = library(Problem((still,)), model)
    names = model.robot.joint_names
    assert found.absent['gear_ratio'] == f'the joint hardly moves ({names[3]}, {names[4]})'


FLOOR = np.sqrt(3.0) * SIGMA
SPRING = {'effect': 'joint_compliance', 'joint': 'shoulder_lift_joint', 'compliance': 1.2e-5}


def frame(seed):
    """Return a frame that an instrument and a probe may put anywhere."""
    rng = np.random.default_rng(seed)
    out = np.eye(4)
    out[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    out[:3, 3] = rng.uniform(-1.0, 1.0, 3) * (3.0 if seed < 10 else 0.2)
    return out


def test_arbitrary_base_and_tool_frames_are_found_and_the_cause_with_them():
    """Each recording has a base of its own, and both the tool."""
    robot, bases, tool = small_arm(), (frame(2), frame(3)), frame(11)
    recordings = [
        recorded(
            robot.with_frames(base=base, tool=tool), [SPRING], seed, static=40, name=f'{seed}'
        )
        for seed, base in enumerate(bases)
    ]
    answer = diagnose(recordings, robot, align=frozenset({'base', 'tool'}), experiment=False)
    assert sites(answer) == [{('joint_compliance', 'shoulder_lift_joint')}]
    (spring,) = answer.effects
    assert abs(spring.effect.compliance - 1.2e-5) < 4.0 * spring.std['compliance'] + 2.4e-7
    for found, base in zip(answer.model.bases, bases, strict=True):
        np.testing.assert_allclose(found, base, atol=1e-4)
    np.testing.assert_allclose(answer.model.robot.T_flange_tool, tool, atol=1e-4)
    assert not any(c.site.effect in ('base_pose', 'tool_pose') for c in answer.candidates)
    assert answer.shrink.rms_after_m == pytest.approx(FLOOR, rel=0.1)


@pytest.mark.parametrize('measured', [None, Measurements(np.zeros(0), np.zeros((0, 3)))])
def test_a_recording_without_measurements_is_refused_by_name(measured):
    recording = Recording('odd', JointMotion(np.arange(9.0), np.zeros((9, 6))), measured)
    with pytest.raises(DataError, match='odd holds no measured poses or points'):
        diagnose([recording], load('ur5'), experiment=False)
