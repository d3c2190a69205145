# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What measured efforts are told to differ by is what was put in, and as sure as least squares are."""

from dataclasses import replace

import numpy as np
import pytest
from measured_cells import moving, recorded, stations

from weld_twin_core.arm.catalog import load
from weld_twin_core.diagnosis.soundness.efforts import _fitted, compared
from weld_twin_core.effects.curves import AT_REST
from weld_twin_core.twin.features import with_expected_effort

ROBOT = load('ur10e')
ELBOW = np.arange(6) == 2
NOISE = 0.05
"""Of every effort [N m]: what torque sensors of an arm of this size are good for."""
MADE = {
    ('payload', None, 2.0): replace(ROBOT, payload_mass=ROBOT.payload_mass + 2.0),
    ('torque_constant', 'elbow_joint', 1.2): ROBOT,
    ('link_mass', 'elbow_joint', 1.3): replace(ROBOT, mass=ROBOT.mass * (1.0 + 0.3 * ELBOW)),
    ('link_masses', None, 1.1): replace(ROBOT, mass=1.1 * ROBOT.mass),
}


def reported(kind, real, factor, unit=1.0, seed=3):
    """Return a recording with efforts of a real arm, the elbow's times a factor, all in a unit."""
    rng = np.random.default_rng(seed)
    run = with_expected_effort(recorded(ROBOT, kind(ROBOT, rng), rng, points=True), real, 1.0)
    rubs = 0.0
    if kind is moving:
        speed = run.joints.velocity
        rubs = 3.0 * np.tanh(speed / AT_REST) + 2.0 * speed
    torque = run.effort.value * np.where(ELBOW, factor, 1.0) + rubs + 0.7
    torque = torque + NOISE * rng.normal(size=torque.shape)
    return replace(run, effort=replace(run.effort, value=unit * torque))


@pytest.mark.parametrize('kind', [stations, moving])
@pytest.mark.parametrize('cause', MADE, ids=lambda cause: cause[0])
def test_one_cause_of_a_difference_is_told_with_its_size_beside_friction_and_offsets(kind, cause):
    name, joint, value = cause
    factor = value if name == 'torque_constant' else 1.0
    found = compared([reported(kind, MADE[cause], factor)], ROBOT)
    first, *others = found.causes
    assert (first.name, first.joint) == (name, joint)
    assert abs(first.value - value) < 4.0 * first.std < 0.02 * value
    assert first.left < 0.1 and all(other.left > first.left for other in others)
    by_joint = {each.joint: each for each in found.joints}
    if name == 'torque_constant' and kind is stations:
        assert by_joint['elbow_joint'].factor == pytest.approx(value, rel=0.01)
        assert (
            by_joint['elbow_joint'].difference_rms > 5.0 * by_joint['wrist_1_joint'].difference_rms
        )


def test_joints_are_told_by_what_all_recordings_have():
    runs = [reported(stations, ROBOT, 1.2, seed=seed) for seed in (4, 5)]
    model = [with_expected_effort(run, ROBOT, 1.0).effort.value for run in runs]
    model, seen = (np.concatenate(v) for v in (model, [run.effort.value for run in runs]))
    found = compared(runs, ROBOT)
    about, gap = model - model.mean(axis=0), seen - model
    both = about.ravel(), (seen - seen.mean(axis=0)).ravel()
    assert found.correlation == pytest.approx(np.corrcoef(*both)[0, 1])
    assert found.difference == pytest.approx(np.sqrt((gap**2).mean() / (about**2).mean()))
    for i, told in enumerate(found.joints):
        sizes = model[:, i].std(), np.sqrt((gap[:, i] ** 2).mean())
        assert (told.model_rms, told.difference_rms) == pytest.approx(sizes)
        assert (told.factor is None) is bool(sizes[0] < 0.2 * model.std(axis=0).max())
        if told.factor is not None:
            slope, _ = np.polyfit(model[:, i], seen[:, i], 1)
            assert told.factor == pytest.approx(slope)


def test_in_another_unit_of_torque_the_same_is_told():
    """Newton metres or kilopond metres, where the masses are told in theirs."""
    cause, unit = ('link_mass', 'elbow_joint', 1.3), 1.0 / 9.80665
    lighter = replace(ROBOT, mass=unit * ROBOT.mass, payload_mass=unit * ROBOT.payload_mass)
    one = compared([reported(stations, MADE[cause], 1.0)], ROBOT)
    other = compared([reported(stations, MADE[cause], 1.0, unit)], lighter)
    assert other.correlation == pytest.approx(one.correlation, rel=1e-9)
    assert other.difference == pytest.approx(one.difference, rel=1e-9)
    for before, after in zip(one.joints, other.joints, strict=True):
        assert (after.model_rms, after.difference_rms) == pytest.approx(
            (unit * before.model_rms, unit * before.difference_rms)
        )
        assert after.factor == (None if before.factor is None else pytest.approx(before.factor))
    assert [(c.name, c.joint, c.value) for c in other.causes] == [
        (c.name, c.joint, pytest.approx(c.value)) for c in one.causes
    ]


def test_coefficients_are_as_sure_as_those_of_a_straight_line():
    x, noise = np.random.default_rng(4).normal(size=(2, 9))
    line, covariance = np.polyfit(x, 2.0 * x + noise, 1, cov=True)
    values, spread, left = _fitted(np.stack([x, np.ones(9)])[:, None], (2.0 * x + noise)[None])
    np.testing.assert_allclose(values, line)
    np.testing.assert_allclose(spread, np.sqrt(np.diag(covariance)))
    assert left == pytest.approx(((2.0 * x + noise - np.polyval(line, x)) ** 2).sum())
