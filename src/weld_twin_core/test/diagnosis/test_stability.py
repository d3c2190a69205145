# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is named must come back on halves of the data, and belief follows how often it does."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.diagnosis import pipeline
from weld_twin_core.diagnosis.beliefs import Beliefs
from weld_twin_core.diagnosis.hypotheses.rivals import Rival
from weld_twin_core.diagnosis.result import CameBack, Cause, Site
from weld_twin_core.diagnosis.stability.halves import halves
from weld_twin_core.diagnosis.stability.repeated import Repeated, repeated
from weld_twin_core.diagnosis.stability.reselected import Prices, reselected
from weld_twin_core.diagnosis.stability.steadied import steadied, told_back
from weld_twin_core.diagnosis.stability.tableau import Tableau
from weld_twin_core.diagnosis.verdict.decision import Verdict

PLAY, DRIFT = Site('backlash', 'elbow_joint'), Site('drift', None)
ROWS = 400
"""Of each of the two parts of data made by hand."""


# The search on small matrices --------------------------------------------------------------------


@pytest.fixture
def made():
    """Return two candidates of two columns, and what only the first half of the rows shows."""
    rng = np.random.default_rng(3)
    columns = rng.normal(size=(4, 2 * ROWS))
    target = rng.normal(size=2 * ROWS)
    target[:ROWS] += 3.0 * columns[0, :ROWS]
    target += 2.0 * columns[2] - columns[3]
    return columns, target


def tableau(columns, target, spans):
    rows = np.concatenate([columns, target[None]])
    normal = np.array([rows[:, span] @ rows[:, span].T for span in spans])
    size = np.sqrt(np.einsum('hpp->hp', normal))
    size[:, -1] = 1.0
    return Tableau(normal, [slice(0, 2), slice(2, 4)], size)


def left(columns, target, span):
    """Return the sum of squares that least squares leave."""
    part = columns[:, span].T
    fit = np.linalg.lstsq(part, target[span], rcond=None)[0]
    return float(((target[span] - part @ fit) ** 2).sum())


SPANS = [slice(0, ROWS), slice(ROWS, 2 * ROWS)]


def test_a_cause_that_lives_in_one_half_is_found_in_that_half_alone(made):
    prices = Prices(np.array([ROWS, ROWS]), np.array([2.0, 2.0]), np.zeros(2), 6.0)
    taken = reselected(tableau(*made, SPANS), prices)
    assert taken.tolist() == [[True, True], [False, True]]


def test_a_candidate_that_repeats_what_was_taken_is_worth_nothing(made):
    columns, target = made
    columns[2] = columns[0] + 1e-9 * columns[2]
    columns[3] = columns[1]
    table = tableau(columns, target, SPANS)
    table.sweep(np.arange(2), 0)
    assert table.worth()[:, 0].all() and not table.worth()[:, 1].any()


def test_a_search_from_what_is_there_ends_where_one_from_nothing_does(made):
    prices = Prices(np.array([ROWS, ROWS]), np.array([2.0, 2.0]), np.zeros(2), 6.0)
    full = tableau(*made, SPANS)
    full.sweep(np.arange(2), 0)
    full.sweep(np.arange(2), 1)
    assert (reselected(full, prices) == reselected(tableau(*made, SPANS), prices)).all()


def test_what_a_candidate_takes_off_is_what_least_squares_say(made):
    columns, target = made
    table = tableau(columns, target, SPANS)
    empty = [float((target[span] ** 2).sum()) for span in SPANS]
    alone = [left(columns[2:], target, span) for span in SPANS]
    assert table.worth()[:, 1] == pytest.approx(np.subtract(empty, alone), rel=1e-6)
    table.sweep(np.arange(2), 1)
    both = [left(columns, target, span) for span in SPANS]
    assert table.worth() == pytest.approx(
        np.stack([np.subtract(alone, both), np.subtract(empty, alone)], axis=1), rel=1e-5
    )
    table.sweep(np.arange(2), 1)
    assert table.rss == pytest.approx(empty)
    assert not table.taken.any()


def test_halves_come_in_pairs_that_share_nothing_and_the_last_is_all():
    drawn = halves([8, 5])
    assert drawn[-1].tolist() == [True] * 8 + [False] * 5
    one, other = drawn[:-1:2], drawn[1:-1:2]
    assert not (one & other).any()
    assert set((one | other).sum(axis=1)) == {8, 5}
    assert (drawn == halves([8, 5])).all()
    assert halves([1]).size == 0


# What follows from it ----------------------------------------------------------------------------


@dataclass(frozen=True)
class Found:
    """A search of which only the final model and the slots are asked."""

    final: object
    slots: tuple


def again(times, of, instead=True, blind=0):
    """Return a search on halves that names play so often, and drift where it does not."""
    there = np.arange(of) < times
    unable = (np.arange(of) >= of - blind)[:, None, None] & np.array([False, True])
    candidates = tuple(SimpleNamespace(site=site, effect=None) for site in (PLAY, DRIFT))
    taken = np.stack([there, ~there & instead], axis=1)
    return Repeated(candidates, taken, np.ones((of, 1), bool), np.array([True, False]), unable)


def told(times, of, instead=True):
    """Return sets and confidence of an answer that names play with all the evidence there is."""
    play = wt.effects.Backlash('elbow_joint', 5e-4)
    slot = (Rival(PLAY, 90.0, None, 0.999), Rival(DRIFT, 60.0, None, 0.001))
    final = SimpleNamespace(model=SimpleNamespace(found=(play,)))
    search = Found(final, (slot,))
    beliefs = Beliefs()
    search, stability = steadied(search, again(times, of, instead), beliefs)
    names = tuple((r.site, r.probability) for r in search.slots[0])
    sets = (tuple(site for site, p in names if p > 0.1),)
    verdict = Verdict('identified' if len(sets[0]) == 1 else 'ambiguous', 0.95, sets, ())
    cause = Cause((), (), names, 1.0, (1.0, 1.0), (0,))
    return verdict, told_back((cause,), verdict, stability)


@pytest.mark.parametrize(
    ('times', 'play', 'drift'),
    [(20, 0.999, 0.001), (19, 0.999, 0.001), (12, 0.6, 0.4)],
)
def test_belief_is_shared_with_what_came_instead_where_a_name_seldom_comes_back(
    times, play, drift
):
    _, (cause,) = told(times, 20)
    assert dict(cause.name) == pytest.approx({PLAY: play, DRIFT: drift})
    assert (cause.came_back.times, cause.came_back.of) == (times, 20)


def test_what_came_instead_is_told_beside_the_name_and_the_set_is_believed():
    verdict, (cause,) = told(12, 20)
    assert verdict.sets == ((PLAY, DRIFT),)
    assert cause.came_back == CameBack(12, 20, ((DRIFT, 8),))


def test_a_name_for_which_nothing_came_instead_is_believed_as_often_as_it_comes_back():
    verdict, (cause,) = told(12, 20, instead=False)
    assert verdict.sets == ((PLAY,),)
    assert sum(p for _, p in cause.name) <= 0.6


def test_few_halves_that_would_show_a_cause_say_nothing_of_it():
    _, (cause,) = told(3, 7)
    assert cause.came_back is None


@pytest.mark.parametrize(('blind', 'share'), [(0, (12, 20)), (8, (12, 12)), (13, (12, 20))])
def test_halves_that_cannot_tell_a_cause_from_what_came_instead_are_not_asked(blind, share):
    # Of thirteen only seven are left that can: too few, and all are asked.
    told = again(12, 20, blind=blind).came_back(PLAY, ())
    assert (told.times, told.of) == share


# The whole diagnosis -----------------------------------------------------------------------------


def test_a_cause_that_is_always_there_comes_back_on_every_half(monkeypatch):
    robot = wt.load('ur5')
    motion = wt.plan(robot, wt.default_seam(robot, 'spline'), 'aggressive', rate_hz=50.0).motion
    commanded = wt.Recording('seam', motion)
    real = wt.Twin(robot, [wt.effects.Backlash('elbow_joint', width=5e-4)]).poses(commanded)
    noise = np.random.default_rng(7).normal(scale=2e-5, size=real.position.shape)
    recording = commanded.with_measured(wt.Measurements(motion.t, real.position + noise))
    both = []
    monkeypatch.setattr(
        pipeline,
        'repeated',
        lambda found: both.extend([repeated(found), repeated(found)]) or both[0],
    )
    found = wt.diagnose(recording, robot)
    entry = found.as_dict()['verdict']['causes'][0]['came_back']
    assert entry == {'times': entry['of'], 'of': entry['of'], 'instead': []}
    assert entry['of'] > 20
    assert (both[0].taken == both[1].taken).all()


def test_halves_in_which_a_joint_hardly_moves_say_nothing_against_its_wave():
    robot, t = wt.load('ur5'), np.arange(0.0, 12.0, 0.08)
    wobble = wt.effects.BearingTilt('wrist_3_joint', lean=(2e-3, 0.0, 0.0, 0.0))
    drawn, recordings = np.random.default_rng(5), []
    for moved in (0.05, 1.2):
        amplitude = np.array([0.4, 0.4, 0.4, 0.4, 0.4, moved])
        way = amplitude * np.sin(np.outer(t, 0.9 + 0.31 * np.arange(6)))
        q = np.array([0.0, -1.2, 1.4, -1.0, -1.5, 0.0]) + way
        commanded = wt.Recording(f'{moved} rad', wt.JointMotion(t, q))
        real = wt.Twin(robot, [wobble]).poses(commanded)
        noise = drawn.normal(scale=3e-5, size=real.position.shape)
        recordings.append(commanded.with_measured(wt.Measurements(t, real.position + noise)))
    found = wt.diagnose(recordings, robot, experiment=False)
    (cause,) = found.causes
    assert cause.name[0][0] == Site('bearing_tilt', 'wrist_3_joint')
    # Some of the 32 have the joint within 0.1 rad, where the wave is a twist of the link before.
    assert cause.came_back.times == cause.came_back.of < 32
