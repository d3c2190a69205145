# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Predictions of unseen stretches against fitting again with every stretch left out."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis_cells import SIGMA, SIGMA_TURN, effect, known_scale, tiny

from weld_twin_core.arm.catalog import load
from weld_twin_core.diagnosis.algebra.columns import Columns, Maker, Piece
from weld_twin_core.diagnosis.algebra.fit import TRUSTED, fit, trusted
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, Scale
from weld_twin_core.diagnosis.algebra.starts import started
from weld_twin_core.diagnosis.beliefs import Beliefs
from weld_twin_core.diagnosis.evidence import Verdict
from weld_twin_core.diagnosis.hypotheses.search import search
from weld_twin_core.diagnosis.levels.curved import choose_model
from weld_twin_core.diagnosis.result import Shrink
from weld_twin_core.diagnosis.unseen.unseen_stretches import Unseen
from weld_twin_core.effects import REGISTRY
from weld_twin_core.motion.paths import default_seam
from weld_twin_core.motion.planned_motion import plan
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_core.twin.twin import Twin

TRUE = (
    effect('joint_offset', joint='elbow_joint', offset=6e-4),
    effect('link_length', joint='shoulder_lift_joint', da=4e-4),
    effect('gear_ratio', joint='wrist_1_joint', scale=5e-4),
)


def made_up(columns, blocks, seed=0, rows=640, parts=3, prior=0.0):
    """Return an `Unseen` of random columns and targets: two frame columns, then the parts."""
    rng = np.random.default_rng(seed)
    labels = np.sort(rng.integers(0, blocks, rows))
    a, targets = rng.normal(size=(columns, rows)), rng.normal(size=(1 + parts, rows))
    bounds = np.linspace(2, columns, parts + 1).astype(int)
    slices = tuple(slice(lo, hi) for lo, hi in pairwise(bounds))
    precision = np.concatenate([np.zeros(2), rng.uniform(0.0, prior, columns - 2)])
    pull = precision * rng.normal(size=columns)
    told = targets[0], lambda: targets[1:]
    return Unseen(None, None, labels, Columns((Piece(a),)), slices, *told, precision, pull)


def refitted(unseen, kept, extra=None, ridge=0.0):
    """Return the residual on every stretch of least squares on the others, by orthogonal means."""
    gone = [k for k in range(len(unseen.parts)) if k not in kept]
    target = unseen.targets[0] + unseen.targets[[1 + k for k in gone]].sum(axis=0)
    index = np.concatenate(
        [
            np.arange(unseen.frames),
            *(np.arange(unseen.parts[k].start, unseen.parts[k].stop) for k in kept),
        ]
    ).astype(int)
    columns, root = unseen.columns.written_out()[index], np.sqrt(unseen.precision[index])
    wanted = -np.divide(unseen.pull[index], root, out=np.zeros(index.size), where=root > 0.0)
    if extra is not None:
        columns = np.concatenate([columns, extra])
        root = np.concatenate([root, np.full(len(extra), np.sqrt(ridge))])
        wanted = np.concatenate([wanted, np.zeros(len(extra))])
    out, found = target.copy(), target
    for b in np.unique(unseen.labels):
        seen = unseen.labels != b
        anew = unseen.anew(b, kept)
        target = found if anew is None else found - anew
        out[~seen] = target[~seen]
        a = np.concatenate([columns[:, seen].T, np.diag(root)])
        x = np.linalg.lstsq(a, np.concatenate([target[seen], wanted]), rcond=None)[0]
        out[~seen] -= x @ columns[:, ~seen]
    return out


@pytest.mark.parametrize('kept', [[], [0], [1, 2], [0, 1, 2], [2, 0, 1]])
@pytest.mark.parametrize('columns', [20, 230])
def test_predictions_are_those_of_least_squares_on_the_other_stretches(columns, kept):
    # with 230 columns one inverse per stretch serves every choice of effects
    unseen = made_up(columns, 5, prior=30.0)
    np.testing.assert_allclose(unseen.predict(kept), refitted(unseen, kept), atol=1e-7)


@pytest.mark.parametrize('kept', [[], [0, 2]])
def test_further_columns_are_fitted_together_with_those_of_the_model(kept):
    unseen = made_up(20, 5, seed=1, prior=30.0)
    extra = np.random.default_rng(2).normal(size=(4, unseen.labels.size))
    ridges = (0.3, 40.0)
    found = unseen.base(kept).extended(extra, ridges)
    for ridge, residual in zip(ridges, found, strict=True):
        np.testing.assert_allclose(residual, refitted(unseen, kept, extra, ridge), atol=1e-7)


@pytest.mark.parametrize('kept', [[1], [0, 1, 2], [0, 2]])
@pytest.mark.parametrize('columns', [20, 230])
def test_what_is_chosen_anew_without_a_stretch_predicts_it(columns, kept):
    unseen, rng = made_up(columns, 5, seed=4, prior=30.0), np.random.default_rng(5)
    moved = rng.normal(size=(5, unseen.labels.size))
    unseen = replace(unseen, searched=lambda labels: {1: moved})
    np.testing.assert_allclose(unseen.predict(kept), refitted(unseen, kept), atol=1e-7)
    extra = rng.normal(size=(4, unseen.labels.size))
    (found,) = unseen.base(kept).extended(extra, [0.3])
    np.testing.assert_allclose(found, refitted(unseen, kept, extra, 0.3), atol=1e-7)


def test_coordinates_wander_by_their_steps_over_what_noise_alone_makes_of_them():
    """By inverses written out; what a search chooses counts as one coordinate of its own."""
    unseen, rng = made_up(20, 5, seed=6, prior=30.0), np.random.default_rng(7)
    moved = 0.1 * rng.normal(size=(5, unseen.labels.size))
    unseen = replace(unseen, searched=lambda labels: {1: moved})
    columns, prior = unseen.columns.written_out(), np.diag(unseen.precision)
    whole, ratios = np.linalg.inv(columns @ columns.T + prior), []
    for b in range(5):
        seen = unseen.labels != b
        left = np.linalg.inv(columns[:, seen] @ columns[:, seen].T + prior)
        pulls = columns[:, seen] @ (unseen.residual - moved[b])[seen] - unseen.pull
        ratios.append((left @ pulls) ** 2 / np.diag(left - whole))
    wandered = np.mean(ratios, axis=0)
    free = [row @ row - (columns @ row) @ whole @ (columns @ row) for row in moved]
    expected = [wandered[part].max() for part in unseen.parts]
    expected[1] = 4.0 * np.mean(free)
    np.testing.assert_allclose(unseen.wandered(), expected, rtol=1e-6)


def stairs_of(problem, model, scale):
    """Return the fit of the staircase of the elbow that all rows choose."""
    maker, joint = Maker(problem, problem.features(model), scale), 'elbow_joint'
    pull = maker.moved(2).summed(problem.whitened(problem.residuals(model), scale))
    seeds = maker.features[0].seeds(REGISTRY['quantization'], joint, pull)[0]
    begun = [started(problem, model, scale, seed) for seed in seeds]
    fits = [fit(problem, model.with_found((each,)), scale) for each in begun]
    return min(fits, key=lambda one: one.rss)


def leaked_into_the_elbow(seed):
    """Return stations of an arm whose elbow another axis leaks into, a model, and the noise."""
    problem, model = tiny((), seed, noise=1e-6)
    (recording,) = problem.recordings
    q = recording.joints.q.copy()
    q[:, 2] += 3e-4 * np.sin(5.0 * q[:, 5] + 3.3)
    leaked = Recording('leak', JointMotion(recording.joints.t, q, static=True))
    poses = Twin(model.robot).poses(leaked, recording.measured.t)
    seen = Measurements(recording.measured.t, poses.position, poses.rotation)
    scale = known_scale(problem)
    return replace(problem, recordings=(recording.with_measured(seen),)), model, scale


def test_a_staircase_that_stations_chose_says_nothing_of_those_that_did_not():
    """Of thousands of staircases one looks like what another axis leaks into the elbow."""
    ratios = []
    for seed in range(4):
        problem, model, scale = leaked_into_the_elbow(seed)
        found = stairs_of(problem, model, scale)
        unseen = Unseen.of(problem, scale, found, np.zeros(0))
        assert unseen.rms(found.residual) < 0.95 * unseen.rms(unseen.bare)
        ratios.append(unseen.rms(unseen.whole) / unseen.rms(unseen.bare))
        assert unseen.wandered()[0] > 100.0
    assert np.mean(ratios) > 1.0, 'what nobody chose it on is predicted no better with it'
    assert unseen.missed().min() < 0.0, 'some part is predicted better without it'


@pytest.mark.parametrize('static', [True, False])
def test_a_true_staircase_is_chosen_again_without_any_stretch(static):
    true = effect('quantization', joint='elbow_joint', step=9e-4)
    problem, model = tiny((true,), count=50 if static else 300, static=static)
    scale = known_scale(problem)
    found = stairs_of(problem, model, scale)
    assert found.model.found[0].step == pytest.approx(9e-4, rel=1e-3)
    unseen = Unseen.of(problem, scale, found, np.zeros(0))
    assert unseen.rms(unseen.whole) == pytest.approx(unseen.rms(found.residual), rel=1e-9)
    assert unseen.wandered()[0] < 1.0
    assert unseen.missed().min() > 0.5, 'every part is predicted worse without it'


def test_six_rows_that_are_as_sure_count_as_three():
    problem = SimpleNamespace(roots=[np.eye(6), None], by_sample=lambda rows: rows)
    unseen = SimpleNamespace(
        problem=problem, scale=Scale(2e-5, 1e-5, (np.ones(4),) * 2), _trusted=lambda parts: parts
    )
    squares = Unseen.squares(unseen, [np.ones((4, 6)), np.ones((4, 6))])
    np.testing.assert_allclose(squares, 3.0 * 2e-5**2)


def test_a_model_without_frames_and_effects_predicts_its_target():
    unseen = made_up(20, 5)
    bare = Unseen(
        None,
        None,
        unseen.labels,
        Columns((Piece(np.zeros((0, unseen.labels.size))),)),
        (),
        unseen.residual,
        lambda: np.zeros((0, unseen.labels.size)),
        np.zeros(0),
        np.zeros(0),
    )
    np.testing.assert_array_equal(bare.predict([]), unseen.targets[0])
    extra = np.random.default_rng(3).normal(size=(2, unseen.labels.size))
    expected = refitted(bare, [], extra, 1.0)
    np.testing.assert_allclose(bare.base([]).extended(extra, [1.0])[0], expected, atol=1e-7)


@pytest.fixture(scope='module', params=[(), ('base',), ('base', 'tool')])
def fitted(request):
    problem, model = tiny(TRUE, count=90, align=request.param)
    scale = known_scale(problem)
    found = fit(problem, model.with_found(TRUE), scale)
    return problem, scale, found, Unseen.of(problem, scale, found, np.zeros(0))


@pytest.mark.parametrize('kept', [[0, 1, 2], [0, 2], [1], []])
def test_predictions_are_those_of_the_twin_fitted_again_without_each_stretch(fitted, kept):
    problem, scale, found, unseen = fitted
    stretch = unseen.labels[:: problem.rows[0]]
    model = found.model.with_found(tuple(found.model.found[k] for k in kept))
    expected = np.zeros(unseen.labels.size)
    for b in np.unique(stretch):
        recording = problem.recordings[0]
        others = recording.measured.take(stretch != b)
        seen = replace(problem, recordings=(recording.with_measured(others),))
        again = fit(seen, model, known_scale(seen)).model
        residual = problem.whitened(problem.residuals(again), scale)
        expected[unseen.labels == b] = residual[unseen.labels == b]
    # in units of the noise; second order of half a milliradian on a metre is 0.01
    np.testing.assert_allclose(unseen.predict(kept), expected, atol=0.03)


def test_frames_by_a_metre_do_not_take_the_place_of_play_that_is_left_out():
    """The tool keeps its direction on a seam, and base and tool move against each other for nothing."""
    robot, play = load('ur5'), effect('backlash', joint='shoulder_pan_joint', width=5e-4)
    motion = plan(robot, default_seam(robot, 'line'), 'smooth', rate_hz=50.0).motion
    back = JointMotion(
        np.append(motion.t, motion.t[-1] + motion.t[1:]),
        np.concatenate([motion.q, motion.q[-2::-1]]),
    )
    commanded = Recording('seam', back)
    position = Twin(robot, (play,)).poses(commanded, back.t).position
    position = position + np.random.default_rng(5).normal(scale=SIGMA, size=position.shape)
    seam = commanded.with_measured(Measurements(back.t, position))
    problem = Problem((seam,), frozenset(('base', 'tool')))
    model, scale = Model(robot, (robot.T_world_base,)), known_scale(problem)
    nominal = fit(problem, model, scale)
    found = fit(problem, nominal.model.with_found((play,)), scale)
    unseen = Unseen.of(problem, scale, found, np.zeros(0))
    assert unseen.rms(unseen.bare) > 0.95 * unseen.rms(nominal.residual)


def test_squared_errors_are_metres_of_the_trusted_samples_whatever_their_weight():
    problem, model = tiny((), count=30)
    weights = np.append(0.05, np.linspace(0.3, 1.0, 29))
    scale = Scale(SIGMA, SIGMA_TURN, (weights,))
    found = fit(problem, model, scale)
    unseen = Unseen.of(problem, scale, found, np.zeros(0))
    position = problem.residuals(model)[0][:3]
    expected = (position**2).sum(axis=0)[weights >= TRUSTED]
    np.testing.assert_allclose(unseen.squares(found.residual), expected, rtol=1e-9)
    assert unseen.rms(found.residual) == pytest.approx(np.sqrt(expected.mean()))
    assert unseen.trusted_labels().size == expected.size
    turned = (problem.residuals(model)[0][3:] ** 2).sum(axis=0)[weights >= TRUSTED]
    assert unseen.turn_rms(found.residual) == pytest.approx(np.sqrt(turned.mean()))


def test_points_without_orientation_have_no_error_of_it():
    problem, model = tiny((), count=30, turned=False)
    scale = known_scale(problem)
    found = fit(problem, model, scale)
    assert Unseen.of(problem, scale, found, np.zeros(0)).turn_rms(found.residual) is None


def test_what_many_samples_do_is_no_outlier():
    weights = np.append(np.full(20, 0.01), np.ones(80))
    weights[:2] = 0.001, 0.002
    (kept,) = trusted((weights,))
    assert np.flatnonzero(~kept).tolist() == [0, 1]
    assert not trusted((np.append(0.01, np.ones(29)),))[0][0]
    assert trusted((np.full(7, 0.01),))[0].all()


def test_what_one_stretch_alone_shows_stays_put_elsewhere():
    """Sixty columns live on the first stretch alone; once it is taken off, rounding is left."""
    rng = np.random.default_rng(3)
    labels = np.repeat(np.arange(8), 100)
    steady = rng.normal(size=labels.size)
    spikes = rng.normal(size=(60, labels.size)) * np.where(labels == 0, 1e6, 1e-6)
    columns, target = np.concatenate([steady[None], spikes]), 2.0 * steady
    none = np.zeros(len(columns))
    told = target, lambda: np.zeros((0, labels.size))
    unseen = Unseen(None, None, labels, Columns((Piece(columns),)), (), *told, none, none)
    left = unseen.base([]).residual
    np.testing.assert_allclose(left[labels > 0], 0.0, atol=1e-6)


@pytest.mark.parametrize('times', [2.0, 0.97])  # worse, and hardly better
def test_a_gap_that_is_carried_without_a_model_keeps_its_size(times):
    """The frames alone were fitted while the whole gap counted as noise; then noise is known."""
    problem, model = tiny(TRUE, count=40, align=('base',), turned=False)
    result = search(problem, model, tuple(REGISTRY), Beliefs(), lambda text: None)
    result = replace(result, scale=known_scale(problem))
    position = problem.residuals(result.baseline.model)[0][:3]
    gap = np.sqrt((position**2).sum(axis=0).mean())
    unseen = Unseen.of(problem, result.scale, result.final, result.precision)
    worse = Shrink(gap, times * gap, times, (1.0, 3.0), 'stretches')
    case = result, unseen, worse, Verdict('unknown'), None, (), Beliefs()
    _, unseen, shrink, _ = choose_model(*case)
    assert unseen.rms(unseen.residual) == pytest.approx(gap)
    assert shrink.rms_before_m == shrink.rms_after_m > gap
