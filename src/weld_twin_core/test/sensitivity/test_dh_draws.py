# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Exact runs of nothing but DH values are those of the twin, whatever the motion and the arm."""

import numpy as np
import pytest

from weld_twin_core import sensitivity
from weld_twin_core.arm import catalog
from weld_twin_core.effects import effect_from_mapping
from weld_twin_core.motion.paths import default_seam
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.sensitivity.evaluate import draws_at, exact_deviations
from weld_twin_core.sensitivity.seam_study import recorded_study, with_known

FAMILIES = ('joint_offset', 'link_length', 'link_offset', 'link_twist')


def jumpy(robot):
    """Return a study of a motion on which no sample follows from others."""
    rng = np.random.default_rng(2)
    q = rng.uniform(-1.0, 1.0, (40, robot.n))
    motion = JointMotion(np.arange(40.0), q)
    return recorded_study(robot, Recording('jumpy', motion), points=40)


def seam(robot):
    return sensitivity.planned_study(robot, default_seam(robot), points=50)


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


@pytest.mark.parametrize('make', [seam, jumpy])
@pytest.mark.parametrize('name', ['ur5', 'abb_irb120'])
def test_fast_runs_are_those_of_the_twin(make, name):
    study, tolerances = study_of(make, name)
    model = sensitivity.model(study, tolerances, exact=True)
    assert model.fast is not None
    draws = 20.0 * draws_at(tolerances, np.random.default_rng(1).random((60, len(tolerances))))
    wanted = np.moveaxis(exact_deviations(study, tolerances, draws), -1, 0)
    assert np.abs(wanted).max() > 1e-3
    np.testing.assert_allclose(model.fast.deviations(draws), wanted, rtol=0.0, atol=1e-11)
    off = np.linalg.norm(wanted, axis=0)
    np.testing.assert_allclose(model(draws).max_m, off.max(axis=-1), rtol=1e-9)


def test_tolerances_too_wide_for_the_expansion_run_fast_and_exactly():
    robot = catalog.load('ur5')
    study = seam(robot)
    wide = sensitivity.default_tolerances(robot, FAMILIES, 300.0)
    model = sensitivity.model(study, wide)
    assert model.expansion is None and model.fast is not None
    draws = draws_at(wide, np.random.default_rng(1).random((20, len(wide))))
    wanted = np.moveaxis(exact_deviations(study, wide, draws), -1, 0)
    np.testing.assert_allclose(model.fast.deviations(draws), wanted, rtol=0.0, atol=1e-11)


def test_what_is_not_a_dh_value_goes_through_the_twin():
    robot = catalog.load('ur5')
    study = seam(robot)
    mixed = sensitivity.default_tolerances(robot, ('joint_offset', 'base_pose'))
    assert sensitivity.model(study, mixed, exact=True).fast is None
    play = (effect_from_mapping({'effect': 'backlash', 'joint': 'elbow_joint', 'width': 1e-3}),)
    plain = sensitivity.default_tolerances(robot, FAMILIES)
    assert sensitivity.model(with_known(study, play), plain, exact=True).fast is None
    panda = catalog.load('franka_panda')  # modified rows
    assert (
        sensitivity.model(
            seam(panda), sensitivity.default_tolerances(panda, FAMILIES), exact=True
        ).fast
        is None
    )
