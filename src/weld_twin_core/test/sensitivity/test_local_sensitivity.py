# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Derivatives of seam deviations by effects, and runs at few samples, against those at all."""

from dataclasses import replace

import numpy as np
import pytest

from weld_twin_core import sensitivity
from weld_twin_core.arm import catalog
from weld_twin_core.arm.robot import Robot
from weld_twin_core.effects import REGISTRY, Stage, effect_from_mapping
from weld_twin_core.motion.paths import default_seam
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.sensitivity import default_tolerances, local_sensitivity, planned_study
from weld_twin_core.sensitivity.evaluate import draws_at, exact_deviations
from weld_twin_core.sensitivity.local import arc_weights, posture
from weld_twin_core.sensitivity.seam_study import recorded_study

# A bearing's lean is nothing on a wrist that stands at a right angle, nor is what a tool sags by an axis
# that stays level: neither has a slope to compare.
POINTWISE = tuple(
    name
    for name, kind in REGISTRY.items()
    if kind.stage in (Stage.JOINT, Stage.ELASTIC, Stage.LINK, Stage.POSE)
    and name
    not in ('quantization', 'joint_coupling', 'thermal_growth', 'bearing_tilt', 'tool_sag')
    and not kind.needs
    and name not in ('root_pose', 'guide_bend', 'guide_tilt')  # of other robots than these arms
    and all(p.lower < 0.0 for p in kind.parameters)  # else a nominal arm has no other side
)

# Arms that differ in kind; more of a kind would only repeat them.
BUILDS = ('ur5', 'kuka_kr6_r900', 'abb_irb120', 'franka_panda')


@pytest.fixture(scope='module')
def studies():
    """Return a smooth and an aggressive motion of a bundled robot, made once."""
    made = {}

    def study(name, profile='smooth'):
        if (name, profile) not in made:
            robot = catalog.load(name)
            made[name, profile] = planned_study(robot, default_seam(robot), profile, points=40)
        return made[name, profile]

    return study


@pytest.mark.parametrize('name', BUILDS)
def test_analytic_derivative_equals_the_central_difference_of_the_position(studies, name):
    study = studies(name)
    tolerances = default_tolerances(study.robot, POINTWISE)
    found = local_sensitivity(study, tolerances)
    step = np.array([1e-3 * t.distribution.std for t in tolerances])
    ends = [exact_deviations(study, tolerances, sign * np.diag(step)) for sign in (1.0, -1.0)]
    difference = (ends[0] - ends[1]) / (2.0 * step[:, None, None])
    size = np.maximum(np.abs(difference).max(axis=(1, 2), keepdims=True), 1e-9)
    np.testing.assert_allclose(found.vectors / size, difference / size, atol=2e-6)


@pytest.mark.parametrize('name', BUILDS)
def test_slope_of_the_deviation_equals_the_papers_difference(studies, name):
    """At no error, where D is a cone, and at one tolerance, where it is smooth."""
    study = studies(name)
    found = local_sensitivity(study, default_tolerances(study.robot))
    moving = found.peak > 1e-6
    assert moving.sum() > 4 * study.robot.n
    assert found.disagreement[moving].max() < 1e-4
    assert found.offset_disagreement[moving].max() < 1e-4


@pytest.mark.parametrize('name', ['ur5', 'franka_panda'])
def test_slope_of_play_equals_the_difference_where_the_motion_reverses(studies, name):
    study = studies(name, 'aggressive')
    found = local_sensitivity(study, default_tolerances(study.robot, ('backlash',)))
    slope, difference = found.analytic, found.forward
    # A sample may fall so near a reversal that even the smallest gap is not crossed there.
    agree = np.abs(slope - difference) <= 1e-4 * np.maximum(found.peak, 1e-9)[:, None]
    assert agree.mean() > 0.98


def test_weights_of_arc_length_do_not_follow_the_time_law(studies):
    smooth, aggressive = studies('ur5'), studies('ur5', 'aggressive')
    for study in (smooth, aggressive):
        assert arc_weights(study.s).sum() == pytest.approx(1.0)
    # The mean place of a path that is covered evenly is its middle.
    middle = (arc_weights(smooth.s) * smooth.s).sum()
    assert middle == pytest.approx(0.5 * smooth.length, rel=1e-9)


def test_groups_add_up_to_the_whole(studies):
    study = studies('ur5')
    found = local_sensitivity(study, default_tolerances(study.robot))
    whole = (found.contribution**2).sum()
    for by in ('effect', 'site'):
        assert sum(v**2 for v in found.groups(by).values()) == pytest.approx(whole)


def test_manipulability_is_the_product_of_the_singular_values(studies):
    study = studies('kuka_kr6_r900')
    stand = posture(study)
    found = local_sensitivity(study, default_tolerances(study.robot, ('joint_offset',)))
    jacobian = found.vectors[:, 0, :].T
    square = np.linalg.det(jacobian @ jacobian.T)
    assert stand.manipulability[0] == pytest.approx(np.sqrt(square), rel=1e-9)
    assert stand.condition[0] == pytest.approx(np.linalg.cond(jacobian), rel=1e-9)


ROWS = ('joint_offset', 'link_length', 'link_offset', 'link_twist')
FAMILIES = (*ROWS, 'axis_parallelism', 'base_pose', 'tool_pose')


def jumpy(robot):
    """Return a study of a motion on which no sample follows from others."""
    rng = np.random.default_rng(2)
    q = rng.uniform(-1.0, 1.0, (40, robot.n))
    motion = JointMotion(np.arange(40.0), q)
    return recorded_study(robot, Recording('jumpy', motion), points=40)


def seam(robot):
    return sensitivity.planned_study(robot, default_seam(robot), points=100)


def study_of(make, name):
    """Return a study on a bundled arm whose base is turned and away."""
    robot = catalog.load(name)
    base = np.array(
        [[0.0, -1.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.5], [0.0, 0.0, 1.0, 0.2], [0, 0, 0, 1]]
    )
    study = make(robot)
    if make is jumpy:
        study = make(robot.with_frames(base=base))
    return study, sensitivity.default_tolerances(robot, FAMILIES)


def on_rail(robot):
    """Return a study of an arm on a rail that moves along with the seam."""
    rail = {'name': 'rail', 'type': 'prismatic', 'alpha': -np.pi / 2}
    rows = robot.to_mapping()
    longer = Robot.from_mapping({**rows, 'joints': [rail, *rows['joints']], 'links': None})
    motion = sensitivity.planned_study(robot, default_seam(robot), points=100).recording.joints
    q = np.column_stack([np.linspace(0.0, 0.2, 100) ** 2, motion.q])
    return recorded_study(longer, Recording('rail', JointMotion(motion.t, q)), points=100)


def run_at_few(study, tolerances):
    """Return the model, and the deviations of many draws as it runs them and as the twin does."""
    model = sensitivity.model(study, tolerances, exact=True)
    draws = 20.0 * draws_at(tolerances, np.random.default_rng(1).random((60, len(tolerances))))
    wanted = np.moveaxis(exact_deviations(study, tolerances, draws), -1, 0)
    assert np.abs(wanted).max() > 1e-3
    off = np.linalg.norm(wanted, axis=0)
    np.testing.assert_allclose(model(draws).max_m, off.max(axis=-1), rtol=1e-9)
    np.testing.assert_allclose(model._exact(draws), wanted, rtol=0.0, atol=1e-11)
    return model


@pytest.mark.parametrize('name', ['ur5', 'abb_irb120', 'kuka_kr6_r900'])
def test_runs_at_few_samples_are_those_of_the_twin_at_all(name):
    model = run_at_few(*study_of(seam, name))
    assert model.few is not None and len(model.few.samples) < 50


def test_joints_that_slide_and_known_constants_change_nothing():
    study = on_rail(catalog.load('ur5'))
    tolerances = sensitivity.default_tolerances(study.robot, ROWS)
    assert run_at_few(study, tolerances).few is not None
    known = (
        effect_from_mapping({'effect': 'link_twist', 'joint': 'elbow_joint', 'dalpha': 1e-2}),
    )
    assert run_at_few(replace(study, known=known), tolerances).few is not None


@pytest.mark.parametrize('name', ['ur5', 'franka_panda'])
def test_points_that_have_nothing_in_common_are_all_run(name):
    assert run_at_few(*study_of(jumpy, name)).few is None


def test_tolerances_too_wide_for_the_expansion_run_exactly_at_few_samples():
    robot = catalog.load('ur5')
    wide = sensitivity.default_tolerances(robot, ROWS, 300.0)
    model = sensitivity.model(seam(robot), wide)
    assert model.expansion is None and model.few is not None


def test_what_is_not_constant_is_run_everywhere():
    robot = catalog.load('ur5')
    study = seam(robot)
    springs = sensitivity.default_tolerances(robot, ('joint_offset', 'joint_compliance'))
    assert sensitivity.model(study, springs, exact=True).few is None
    slips = sensitivity.default_tolerances(robot, ('joint_slip',))
    assert sensitivity.model(study, slips, exact=True).few is None
    play = (effect_from_mapping({'effect': 'backlash', 'joint': 'elbow_joint', 'width': 1e-3}),)
    plain = sensitivity.default_tolerances(robot, FAMILIES)
    assert sensitivity.model(replace(study, known=play), plain, exact=True).few is None
