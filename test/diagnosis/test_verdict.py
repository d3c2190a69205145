# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What can be looked for in data, and what is left that no effect explains."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cells import effect, known_scale, tiny

from weld_twin_core.diagnosis.algebra.fit import fit
from weld_twin_core.diagnosis.algebra.problem import Problem
from weld_twin_core.diagnosis.algebra.workspace import Role
from weld_twin_core.diagnosis.beliefs import Beliefs
from weld_twin_core.diagnosis.hypotheses.library import build
from weld_twin_core.diagnosis.unseen.unseen_stretches import Unseen
from weld_twin_core.diagnosis.unseen.where import structure
from weld_twin_core.recording import Measurements


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
    assert found.absent['thermal_growth'] == 'no temperature was recorded'
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
