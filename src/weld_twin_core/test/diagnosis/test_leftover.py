# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a model leaves is told by who made it: the instrument, gears, swings or turns; in any unit."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2, multivariate_normal

from weld_twin_core.diagnosis.algebra.problem import Problem, Scale
from weld_twin_core.diagnosis.predicting.leftover import Predicted, _likelihood, leftover
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_core.twin.goal_motion import just_turned

COUNT, JOINTS, REGIONS = 768, 3, 6
NOISE, LEVER = 2e-5, 0.5
LOST = np.array([0.0, 6e-4, 0.0])


def moved(*, at_rest=False):
    """Return joints that swing, or stations in pairs of nearly one posture."""
    t = np.arange(COUNT) / 50.0
    q = np.sin(np.outer(t, [1.0, 3.0, 1.7])) * [1.0, 0.1, 1.0]
    if at_rest:
        q = np.repeat(np.random.default_rng(8).uniform(-2.0, 2.0, (COUNT // 2, JOINTS)), 2, axis=0)
        q[::2] += 1e-4
    seen = Measurements(t, np.zeros((COUNT, 3)))
    return Problem((Recording('made', JointMotion(t, q, static=at_rest), seen),))


def predicted(error, rng, *, at_rest=False, ways=1e-9, shaken=0.0):
    """Return shifts (COUNT, 3) of a tool whose turns are a hundredth of them in every metre."""
    both = np.concatenate([error, 2.0 * error], axis=1)
    levers = LEVER * rng.normal(size=(JOINTS, COUNT, 6))
    open_ = ways * np.ones((1, COUNT, 6))
    return Predicted(
        error=both,
        ways=open_,
        levers=levers,
        shaken=shaken * np.abs(rng.normal(size=(COUNT, JOINTS))),
        speeds=np.zeros((COUNT, JOINTS)),
        seen=np.ones((COUNT, 6), dtype=bool),
        region=np.arange(COUNT) * REGIONS // COUNT,
        good=np.ones(COUNT, dtype=bool),
        at_rest=at_rest,
        left=both,
        own=open_,
    )


def white(rng, size=NOISE):
    return size * rng.normal(size=(COUNT, 3))


def by_joints(made, sizes):
    """Return a tool that joints (COUNT, JOINTS) move, besides what it is off by already."""
    off = np.einsum('nkc,kn->kc', made.levers, sizes)
    return replace(made, error=made.error + off, left=made.left + off)


def told(made, *, noise=NOISE, rough=0.0, lost=LOST, turning=True):
    gears = np.full(JOINTS, turning)
    return leftover(moved(at_rest=made.at_rest), made, gears, noise, rough, lost)


def on_slides(made, **known):
    """Return what is left at the tool where no joint has a gear that could have made it."""
    return told(made, turning=False, **known).position


def test_regions_are_foretold_by_what_the_others_know_row_by_row():
    """Of five poses and four points, each of a weight of its own, in metres and radians."""
    rng, rows = np.random.default_rng(7), np.repeat([6, 3], [5, 4])
    regions, weights = np.array([0, 1, 1, 0, 1, 0, 0, 1, 1]), rng.uniform(0.6, 1.0, 9)
    columns, levers = rng.normal(size=(3, 42)), rng.normal(size=(2, 42))
    whole, residual = rng.normal(size=(2, 42))
    means, roots = rng.normal(size=(3, 3)), rng.normal(size=(3, 3, 3))
    known = [(mean, root @ root.T) for mean, root in zip(means, roots, strict=True)]
    unseen = SimpleNamespace(
        problem=SimpleNamespace(rows=(6, 3), samples=(5, 4), at_rest=False),
        scale=Scale(2e-5, 5e-5, (weights[:5], weights[5:])),
        labels=np.repeat(regions * 1.0, rows),
        whole=whole,
        residual=residual,
    )
    joints = rng.normal(size=(9, 2)), np.zeros((9, 2))
    made = Predicted.of(unseen, columns, (0, 1), levers, joints, known.__getitem__, known[2])
    np.testing.assert_array_equal(made.region, regions)
    np.testing.assert_array_equal(made.seen.sum(axis=1), rows)
    assert made.good.all() and not made.error[~made.seen].any()
    for k, own in enumerate(np.split(np.arange(42), np.cumsum(rows)[:-1])):
        unit = np.repeat([2e-5, 5e-5], 3)[: own.size] / np.sqrt(weights[k])
        ways, middle = (each[:, k, : own.size] / unit for each in (made.ways, made.own))
        mean, covariance = known[regions[k]]
        # The others' mean is counted from the fit to all, what is off from the fit to the others.
        off = mean @ columns[:, own] + whole[own] - residual[own]
        spread, own_spread = (
            columns[:, own].T @ c @ columns[:, own] for c in (covariance, known[2][1])
        )
        np.testing.assert_allclose(ways.T @ ways, spread + np.outer(off, off), rtol=1e-6)
        np.testing.assert_allclose(middle.T @ middle, own_spread, rtol=1e-6)
        left = residual[own] - means[2] @ columns[:, own]
        told = made.error[k, : own.size], made.left[k, : own.size], made.levers[:, k, : own.size]
        for found, wanted in zip(told, (whole[own], left, levers[:, own]), strict=True):
            np.testing.assert_allclose(found / unit, wanted)
        np.testing.assert_allclose(made.swept[k, : own.size] / unit, joints[0][k] @ levers[:, own])


@pytest.mark.parametrize('at_rest', [False, True])
def test_in_other_units_the_same_is_left(at_rest):
    """Of lengths, of what joints move by, and of time; a tool that turns is off by as much."""
    rng = np.random.default_rng(1)
    made = predicted(white(rng), rng, at_rest=at_rest, ways=4e-6, shaken=1.0)
    made = by_joints(made, 6e-5 * (1.0 + made.shaken) * rng.normal(size=(COUNT, JOINTS)))
    made.error[[7, 450], :3] += 3e-3
    length, turn, time = 3.0, 0.25, 2.0
    unit = np.repeat([length, 1.0], 3)
    other = replace(
        made,
        **{name: getattr(made, name) * unit for name in ('error', 'ways', 'left', 'own')},
        levers=made.levers * unit / turn,
        shaken=made.shaken * turn / time**2,
    )
    one = told(made, rough=0.2)
    two = told(other, noise=length * NOISE, rough=0.2, lost=turn * LOST)
    factors = (length, 1.0, turn, turn, length, time**2)
    for before, after, factor in zip(one, two, factors, strict=True):
        np.testing.assert_allclose(after, factor * np.asarray(before), rtol=1e-5)
    assert one.position > 0.0 and one.orientation > 0.0 and one.gears.any() and one.peaks.any()
    assert at_rest or (one.swings > 0.0 and one.turns.any())


def test_an_arm_swings_as_much_as_it_is_off_for_how_hard_it_was_accelerated():
    rng = np.random.default_rng(2)
    still = predicted(white(rng), rng, shaken=10.0)
    assert told(still).swings == 0.0
    swung = by_joints(still, 3e-5 * still.shaken * rng.normal(size=(COUNT, JOINTS)))
    assert told(swung).swings == pytest.approx(3e-5, rel=0.1)
    # What the middle of the models followed is the arm's as much as what they left.
    followed = replace(still, own=3e-5 * still.levers * still.shaken.T[:, :, None])
    assert told(followed).swings == pytest.approx(3e-5, rel=0.1)


def hurried(made, rng, jitter):
    """Return joints of unlike speeds, and poses whose stamps are off by so much [s]."""
    fast = replace(made, speeds=rng.uniform(-1.0, 1.0, (COUNT, JOINTS)))
    off = jitter * rng.normal(size=(COUNT, 1)) * fast.swept
    return replace(fast, error=made.error + off, left=made.left + off)


def test_stamps_that_jitter_are_the_instruments_and_joints_that_are_off_are_the_arms():
    rng = np.random.default_rng(9)
    still = predicted(white(rng), rng)
    late = hurried(still, rng, 2e-4)
    assert np.std(late.left[:, :3]) > 3.0 * NOISE
    assert not told(late).gears.any() and told(late).position < NOISE / 2.0
    # The same size of errors, each joint's its own.
    rough = by_joints(late, 2e-4 * rng.normal(size=(COUNT, JOINTS)))
    assert told(rough).gears.any()


def test_an_arm_that_hurries_where_it_is_shaken_does_not_swing_for_that():
    rng = np.random.default_rng(10)
    still = predicted(white(rng), rng, shaken=1.0)
    fast = replace(still, speeds=still.shaken)
    off = 1e-4 * rng.normal(size=(COUNT, 1)) * fast.swept
    late = replace(fast, error=still.error + off, left=still.left + off)
    assert told(late).swings == 0.0 and told(replace(late, speeds=still.speeds)).swings > 0.0


def test_motion_is_lost_by_another_law_where_more_is_left_after_turns_than_elsewhere():
    rng = np.random.default_rng(3)
    sound, joints = predicted(white(rng), rng), moved().recordings[0].joints
    near = just_turned(joints, joints.t)[:, 1]
    assert 0.05 < near.mean() < 0.5
    late = by_joints(sound, np.outer(near * 3e-4 * rng.normal(size=COUNT), [0.0, 1.0, 0.0]))
    np.testing.assert_allclose(told(late).turns, LOST / np.sqrt(3.0))
    # Without, as much as twice the standard error of a mean of squares may hide, a triangle's.
    varies = 2.0 * NOISE**4 / 3.0 * (1.0 / near.sum() + 1.0 / (~near).sum())
    size = (sound.levers[1, near, :3] ** 2).mean()
    most = np.sqrt(3.0 * 2.0 * 2.0 * np.sqrt(varies) / size)
    bound = told(sound).turns
    assert 0.0 < bound[1] < 1.2 * most < 0.2 * LOST[1] and not bound[[0, 2]].any()
    # What open directions account for is no law.
    open_ = replace(late, ways=np.where(near[:, None], 3e-4 * late.levers[1], 0.0)[None])
    assert told(open_, lost=2.0 * LOST).turns[1] < 0.9 * told(late, lost=2.0 * LOST).turns[1]


@pytest.mark.parametrize(('times', 'strayed'), [(1.45, False), (1.55, True)])
def test_a_region_strayed_where_one_sample_is_half_as_far_again_as_chance_goes(times, strayed):
    rng, each = np.random.default_rng(4), COUNT // REGIONS
    usual = np.array([NOISE * np.sqrt(chi2.median(3)), 0.0, 0.0])
    made = predicted(np.tile(usual, (COUNT, 1)), rng)
    chance = NOISE**2 * chi2.ppf(0.5 ** (1.0 / each), 3)
    made.error[2 * each + 5, :3] = [0.0, times * np.sqrt(chance), 0.0]
    made.error[4 * each + 5, :3] = 1.0
    peaks = told(replace(made, good=np.arange(COUNT) != 4 * each + 5), noise=None, rough=1.0).peaks
    expected = np.zeros(REGIONS)
    expected[2] = np.sqrt(times**2 * chance - chance) * strayed
    np.testing.assert_allclose(peaks, expected, rtol=1e-6)


@pytest.mark.parametrize('at_rest', [False, True])
def test_of_what_is_left_as_much_is_the_arms_as_neighbours_have_in_common(at_rest):
    rng, run = np.random.default_rng(5), 2 if at_rest else 8
    same = np.repeat(rng.normal(size=(COUNT // run, 3)), run, axis=0)
    error = NOISE * (0.8 * same + 0.6 * rng.normal(size=(COUNT, 3)))
    found = on_slides(predicted(error, rng, at_rest=at_rest), noise=0.6 * NOISE)
    assert found == pytest.approx(0.8 * NOISE, rel=0.12)
    alone = predicted(white(rng), rng, at_rest=at_rest)
    assert on_slides(alone) < 0.35 * NOISE
    # Where nothing tells the noise all is the arm's as probably as it is rough: nine of ten such arms
    # are within eight of ten of those whose it is, if every other one is, and near nothing if few are.
    for rough, share in ((0.5, 1.0), (0.25, chi2.ppf(0.8, 3) / chi2.ppf(0.9, 3))):
        left = on_slides(alone, noise=None, rough=rough)
        assert left == pytest.approx(np.sqrt(share) * NOISE, rel=0.1)
    assert on_slides(alone, noise=None, rough=0.04) < 0.4 * NOISE


def test_neighbours_have_nothing_in_common_that_open_directions_account_for():
    rng = np.random.default_rng(6)
    made = predicted(white(rng), rng, at_rest=True)
    open_ = 1e-5 * np.repeat(rng.normal(size=(8, COUNT // 2, 6)), 2, axis=1)
    off = np.einsum('r,rkc->kc', rng.choice([-1.0, 1.0], 8), open_)
    stations = replace(made, left=made.left + off, error=made.error + off, own=open_, ways=open_)
    assert on_slides(stations, noise=None) < 0.35 * NOISE
    # Of a motion they are what the middle of the models followed, and the arm's.
    bare = predicted(white(rng), rng)
    followed = replace(bare, own=np.full((1, COUNT, 6), NOISE))
    assert on_slides(followed) > 2.0 * on_slides(bare)


def test_of_what_shows_one_way_alone_all_is_the_tools_beside_what_is_open():
    rng = np.random.default_rng(9)
    made = predicted(white(rng), rng, at_rest=True, ways=0.5 * NOISE)
    faces = replace(made, seen=np.arange(6) < np.ones((COUNT, 1)))
    found = told(faces, noise=None, rough=1.0)
    left = (made.left[:, 0] ** 2).mean() - (0.5 * NOISE) ** 2
    assert (found.position, found.orientation) == pytest.approx([np.sqrt(left)] * 2)
    assert not found.gears.any() and not found.peaks.size


def test_errors_are_as_likely_as_normal_laws_of_their_covariances_have_them():
    rng = np.random.default_rng(10)
    errors, root = rng.normal(size=(5, 3)), rng.normal(size=(5, 3, 3))
    covariances = root @ np.swapaxes(root, 1, 2)
    each = [
        multivariate_normal.logpdf(e, None, c) for e, c in zip(errors, covariances, strict=True)
    ]
    whole = sum(each) + 5 * 1.5 * np.log(2.0 * np.pi)
    assert _likelihood(errors, covariances) == pytest.approx(whole)
