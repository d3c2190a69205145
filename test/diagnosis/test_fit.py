# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The fit of frames and effects against another optimiser, and what its errors are worth."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cells import SIGMA, SIGMA_TURN, effect, errors_of, known_scale, tiny
from scipy.optimize import least_squares
from scipy.stats import norm

from weld_twin_core.diagnosis.algebra.fit import (
    TRUSTED,
    design,
    fit,
    robust_fit,
    robust_scale,
    stepped,
)
from weld_twin_core.diagnosis.algebra.problem import Problem
from weld_twin_core.diagnosis.unseen.unseen_stretches import Unseen

CASES = {
    'geometry': (
        (
            effect('joint_offset', joint='elbow_joint', offset=8e-4),
            effect('link_twist', joint='shoulder_pan_joint', dalpha=-5e-4),
        ),
        ('base', 'tool'),
        True,
    ),
    'play and lag': (
        (
            effect('backlash', joint='elbow_joint', width=1.2e-3),
            effect('servo_lag', joint='shoulder_lift_joint', time_constant=0.01),
        ),
        ('base',),
        False,
    ),
    'vibration': (
        (effect('vibration', joint='shoulder_pan_joint', frequency=6.0, damping=0.05, gain=0.8),),
        (),
        False,
    ),
    'delay and warmth of a ripple': (
        (
            effect('time_delay', delay=4e-3),
            effect('transmission_ripple', joint='elbow_joint', amplitude=4e-4, order=6, phase=0.4),
        ),
        ('tool',),
        False,
    ),
}


def case(name):
    """Return problem, scale, and a start some way off the truth."""
    true, align, static = CASES[name]
    problem, model = tiny(true, align=align, static=static, count=80)
    start = tuple(e.fit.with_coordinates(0.8 * e.fit.coordinates()) for e in true)
    return problem, known_scale(problem), model.with_found(start), true


@pytest.mark.parametrize('name', CASES)
def test_the_fit_is_the_minimum_that_another_optimiser_finds(name):
    problem, scale, start, _ = case(name)
    columns = design(problem, start, scale)
    unit = 1.0 / np.linalg.norm(columns, axis=1)

    def residual(z):
        return problem.whitened(problem.residuals(stepped(problem, start, z * unit)), scale)

    other = least_squares(
        residual,
        np.zeros(unit.size),
        method='trf',
        x_scale=1.0,
        xtol=1e-12,
        ftol=1e-12,
        gtol=1e-10,
    )
    free = np.zeros(sum(e.fit.coordinates().size for e in start.found))
    found = fit(problem, start, scale, free)
    assert found.rss == pytest.approx(2.0 * other.cost, rel=1e-4)
    expected = stepped(problem, start, other.x * unit)
    at = np.concatenate([e.fit.coordinates() for e in expected.found])
    error = errors_of(problem, found.model, scale, free)
    np.testing.assert_allclose((found.coordinates - at) / error, 0.0, atol=0.05)
    # frames and effects trade places within the noise; where the tool goes is what must agree
    change = residual(other.x) - found.residual
    assert np.abs(change).max() < 0.05


@pytest.mark.parametrize('name', CASES)
def test_columns_are_the_slopes_of_what_the_twin_predicts(name):
    problem, scale, model, _ = case(name)
    columns = design(problem, model, scale)
    size = np.linalg.norm(columns, axis=1)
    for p in range(columns.shape[0]):
        ends = []
        for sign in (1.0, -1.0):
            step = np.zeros(size.size)
            step[p] = sign * 0.3 / size[p]
            parts = problem.residuals(stepped(problem, model, step))
            ends.append(problem.whitened(parts, scale))
        slope = (ends[1] - ends[0]) / (0.6 / size[p])
        # residuals of play and quantised motion are straight only piece by piece
        assert np.linalg.norm(columns[p] - slope) < 0.02 * size[p], p


def test_a_frame_that_nothing_shows_stays_where_it_is():
    # positions at the flange: the tool's turn about its own origin moves nothing
    problem, model = tiny(align=('tool',), turned=False)
    found = fit(problem, model, known_scale(problem)).model
    np.testing.assert_allclose(found.robot.T_flange_tool[:3, :3], np.eye(3), atol=1e-12)


def thrown_off(problem, share, size, rng):
    """Return the problem with some positions far off, and which."""
    recording = problem.recordings[0]
    measured = recording.measured
    off = np.zeros(measured.t.size, bool)
    off[rng.choice(off.size, round(share * off.size), replace=False)] = True
    # all one way, the worst for a mean
    position = measured.position + size * off[:, None] * np.array([0.8, 0.6, 0.0])
    moved = recording.with_measured(replace(measured, position=position))
    return Problem((moved,), problem.align), off


@pytest.fixture(scope='module')
def outliers():
    true = (effect('joint_offset', joint='elbow_joint', offset=5e-4),)
    clean, model = tiny(true, count=400)
    problem, off = thrown_off(clean, 0.05, 2e-3, np.random.default_rng(1))
    return problem, model.with_found(true), off


def test_five_per_cent_of_gross_errors_do_not_move_a_robust_fit(outliers):
    problem, model, _ = outliers
    plain = fit(problem, model, known_scale(problem))
    found, scale = robust_fit(problem, model)
    error = errors_of(problem, found.model, scale)[0]
    assert abs(found.coordinates[0] - 5e-4) < 3.0 * error
    assert abs(plain.coordinates[0] - 5e-4) > 3.0 * error


def test_gross_errors_are_distrusted_and_good_samples_keep_their_weight(outliers):
    problem, model, off = outliers
    _, scale = robust_fit(problem, model)
    weights = scale.weights[0]
    assert (weights[off] < TRUSTED).all()
    assert np.mean(weights[~off] == 1.0) > 0.99


def test_the_noise_is_the_median_deviation_that_five_per_cent_of_gross_errors_leave(outliers):
    problem, model, _ = outliers
    scale = robust_scale(problem, problem.residuals(model))
    # of 1200 coordinates a thirtieth is thrown far off: the third one is not touched
    share = 0.05 * 2.0 / 3.0
    factor = norm.ppf(0.5 + 0.25 / (1.0 - share)) / norm.ppf(0.75)
    assert scale.position == pytest.approx(factor * SIGMA, rel=0.06)
    assert scale.orientation == pytest.approx(SIGMA_TURN, rel=0.06)


def test_the_noise_makes_up_for_what_the_coordinates_took_of_it():
    problem, _ = tiny(count=400, turned=False)
    rng = np.random.default_rng(3)
    noise, columns = SIGMA * rng.normal(size=1200), rng.normal(size=(1200, 600))
    q, _ = np.linalg.qr(columns)
    left = (noise - q @ (q.T @ noise)).reshape(3, 400)
    assert robust_scale(problem, [left], freedom=600.0).position == pytest.approx(SIGMA, rel=0.06)


def test_exact_data_have_a_least_noise_and_finite_weights():
    problem, model = tiny(noise=0.0, turned=False)
    scale = robust_scale(problem, problem.residuals(model))
    assert scale.position > 0.0 and np.isfinite(scale.weights[0]).all()


@pytest.mark.parametrize('ratio', [0.0, -0.010])
def test_few_stations_are_not_outweighed_by_what_is_believed_of_machines(ratio):
    """Before the ratio is fitted its gap of millimetres is taken for noise; ten times a usual ratio."""
    joint = 'shoulder_lift_joint'
    true = (effect('gear_ratio', joint=joint, scale=ratio),)
    problem, model = tiny(true, align=('base', 'tool'), count=13, turned=False)
    bare, scale = robust_fit(problem, model)
    start = bare.model.with_found((effect('gear_ratio', joint=joint, scale=0.0),))
    (found,) = fit(problem, start, scale).model.found
    assert float(found.scale) == pytest.approx(ratio, abs=3e-4)


def test_a_wave_of_many_usual_sizes_is_not_shrunk_to_leave_noise():
    """Two millimetres are taken for noise before it is fitted; machines seldom have a wave so large."""
    true = (
        effect('transmission_ripple', joint='elbow_joint', amplitude=4e-3, order=20.0, phase=0.4),
    )
    problem, model = tiny(true, align=('base', 'tool'), count=40, turned=False)
    bare, scale = robust_fit(problem, model)
    start = effect(
        'transmission_ripple', joint='elbow_joint', amplitude=0.0, order=20.0, phase=0.0
    )
    (found,) = fit(problem, bare.model.with_found((start,)), scale).model.found
    assert float(found.amplitude) == pytest.approx(4e-3, abs=2e-4)


def test_what_a_fit_leaves_is_foretold_without_the_effects_that_were_taken_out_of_it():
    problem, scale, model, _ = case('geometry')
    found = fit(problem, model, scale)
    bare = replace(found, model=found.model.with_found(()))
    unseen = Unseen.of(problem, scale, bare, np.zeros(bare.coordinates.size))
    assert unseen.parts == ()
    assert unseen.whole.shape == found.residual.shape


@pytest.mark.parametrize('warming_time', [2.0, 20.0])
def test_a_size_given_to_one_error_does_not_throw_off_the_time_constant_of_another(warming_time):
    warm = effect('joint_warm_up', joint='elbow_joint', offset=3e-4, warming_time=warming_time)
    zero = effect('joint_offset', joint='shoulder_lift_joint', offset=8e-4)
    problem, model = tiny((warm, zero), align=('base', 'tool'))
    scale = known_scale(problem)
    true = fit(problem, model.with_found((warm, zero)), scale)
    alone = fit(problem, model.with_found((warm,)), scale).model  # its frames make up for the zero
    beside = fit(problem, alone.with_found((*alone.found, zero)), scale)
    assert beside.rss == pytest.approx(true.rss, rel=0.05)
