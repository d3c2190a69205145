# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Derivatives of seam deviations by effects, against differences and the formula of the paper."""

import numpy as np
import pytest

from weld_twin_core.arm import catalog
from weld_twin_core.effects import REGISTRY, Stage
from weld_twin_core.motion.paths import default_seam
from weld_twin_core.sensitivity import default_tolerances, local_sensitivity, planned_study
from weld_twin_core.sensitivity.evaluate import exact_deviations
from weld_twin_core.sensitivity.local import arc_weights, posture

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
