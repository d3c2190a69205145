# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Probabilities of statements: from features and learned weights, as they are."""

from dataclasses import replace

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.diagnosis.calibration.calibrated import (
    Stated,
    Statement,
    _led,
    calibrated,
    stated,
)
from weld_twin_core.diagnosis.calibration.features import (
    KINDS,
    faint,
    hardly_a_gap,
    odds,
    of_name,
    of_situation,
    of_whole,
    part_of_a_wave,
)
from weld_twin_core.diagnosis.calibration.weights import calibration_from, usual_calibration
from weld_twin_core.diagnosis.evidence import Alternative, Evidence, Row, Verdict
from weld_twin_core.diagnosis.result import Cause, Family, Site, Structure

PLAY = Site('backlash', 'elbow_joint')


def taught(constant=0.0, **weights):
    terms = {name: {'weight': w, 'low': -2.0, 'high': 3.0} for name, w in weights.items()}
    return calibration_from(
        {
            'statements': {'name': {'constant': constant, 'weights': terms}},
            'sure_from': {'answer': 0.9, 'cause': 0.8},
            'card': {},
        }
    )


def test_log_odds_are_a_sum_over_features_and_nothing_where_nothing_was_learned():
    told = taught(0.5, gap=1.0, left=-2.0)
    for gap, left, total in ((1.0, 0.5, 0.5), (9.0, 0.0, 3.5), (-9.0, 0.0, -1.5)):
        probability = told.probability('name', {'gap': gap, 'left': left})
        assert probability == pytest.approx(1.0 / (1.0 + np.exp(-total)))
    told = taught(0.0, **{'only backlash': -1.0})
    assert told.probability('name', {}) == pytest.approx(0.5)
    assert told.probability('name', {'only backlash': 1.0}) == pytest.approx(1.0 / (1.0 + np.e))


@pytest.mark.parametrize(('probability', 'sure'), [(0.9, True), (0.899, False)])
def test_what_is_sure_is_set_apart_from_how_probable_it_is(probability, sure):
    assert taught().sure('answer', probability) is sure
    assert taught().sure('cause', probability)


def test_what_is_learned_can_be_read_and_is_no_more_than_200_numbers():
    learned = usual_calibration()
    assert set(learned.statements) == set(KINDS)
    assert sum(1 + len(one.terms) for one in learned.statements.values()) <= 200
    assert all(0.5 < bound <= 1.01 for bound in learned.sure_from.values())


def test_the_whole_answer_has_the_least_of_its_names():
    own = {'size': 0.5, 'members': 1.0, 'only drift': 1.0, 'only wear': 0.0}
    other = {'size': 2.0, 'members': 3.0}
    told = of_whole([0.9, 0.5], [own, other])
    assert told['names'] == pytest.approx(np.log(0.45))
    assert told['least name'] == pytest.approx(0.0)
    assert (told['least size'], told['widest set']) == (0.5, 3.0)
    assert told['only drift'] == 1.0 and 'only wear' not in told
    assert of_whole([], [])['names'] == 0.0
    # What was found and is not reported has to be wrong.
    beside = of_whole([0.9], [own], [0.4])
    assert beside['names'] == pytest.approx(np.log(0.9 * 0.6))
    assert beside['least name'] == pytest.approx(np.log(0.6 / 0.4))
    assert beside['told'] == 1


@pytest.mark.parametrize(
    ('size', 'others', 'doubtful'), [(-0.1, 1, 1.0), (-0.1, 0, 0.0), (0.1, 2, 0.0)]
)
def test_an_effect_below_the_noise_is_faint_only_beside_others(size, others, doubtful):
    assert faint(size, others) == doubtful
    names = [{'size': size, 'members': 4.0}] + others * [{'size': 1.0, 'members': 1.0}]
    told = of_whole([0.9] * len(names), names)
    assert (told['one faint beside others'], told['a wide set']) == (doubtful, 1.0)


def test_a_gap_hardly_above_the_noise_is_none_unless_something_regular_is_left():
    for squared, depth in ((1.01, 2.0), (1.1, 1.0), (2.0, 0.0), (50.0, 0.0)):
        gap = np.log10(squared) / 2.0
        assert hardly_a_gap(gap, -3.0) == pytest.approx(depth)
        assert hardly_a_gap(gap, -1.0) == 0.0


def test_log_odds_end_at_a_thousand_to_one():
    assert odds(1.0) == pytest.approx(np.log(999.0))
    assert odds(0.0) == pytest.approx(-np.log(999.0))


@pytest.mark.parametrize(
    ('gain', 'parts', 'structure', 'cancelling'),
    [
        (0.1, (0.5, 0.5), -1.0, 0.0),
        (0.01, (4.0, 6.0), -2.0, 1.0),
        (0.0, (), -3.0, 0.0),
        (-0.2, (0.2, 0.3), -3.0, 0.0),
    ],
)
def test_a_share_counts_by_its_logarithm_and_only_what_cancels_is_bad_news(
    gain, parts, structure, cancelling
):
    evidence = Evidence(
        candidate_sets=(),
        structure=Structure(1e-4, gain, 0.0, ()),
        gap=1e-3,
        after=1e-4,
        floor=1e-4,
        independent=True,
        parts=parts,
        travel=(0.5,),
    )
    told = of_situation(evidence, wt.Beliefs())
    assert told['structure'] == pytest.approx(structure)
    assert told['cancelling'] == pytest.approx(cancelling)
    assert told['left unexplained'] == -3.0


class _Fit:
    """A fit that left some residual, with nothing in its model."""

    def __init__(self, *residual):
        self.residual = np.array(residual)
        self.model = type('Model', (), {'found': ()})()


def test_marginals_of_a_row_are_sums_over_who_shares_it():
    zero, gear = Site('joint_offset', 'wrist'), Site('gear_ratio', 'wrist')
    candidate_set = (
        Alternative(zero, 9.0, _Fit(0.0, 0.0), 0.5),
        Alternative(gear, 8.0, _Fit(1.0, 1.0), 0.3),
        Alternative(PLAY, 5.0, _Fit(3.0, 3.0), 0.18),
        Alternative(Site('drift', None), 2.0, _Fit(5.0, 5.0), 0.02),
    )
    row = Row.of(candidate_set, wt.diagnosis.Beliefs())
    assert row.listed == (zero, gear, PLAY)
    assert row.mass == pytest.approx(0.98)
    assert row.places()['wrist'] == pytest.approx(0.8)
    assert row.dependences() == pytest.approx(
        {'constant': 0.5, 'angle': 0.3, 'direction': 0.18, 'time': 0.02}
    )
    assert row.leader.log_bayes == 9.0
    sure = (
        replace(candidate_set[0], probability=0.9),
        *(replace(r, probability=0.03) for r in candidate_set[1:]),
    )
    row = Row.of(sure, wt.diagnosis.Beliefs())
    assert row.listed == (zero,)


def test_pieces_of_one_curve_are_counted():
    def row(effect, joint):
        return Row((Alternative(Site(effect, joint), 9.0, _Fit(), 1.0),), ())

    beside = [row('joint_offset', 'wrist'), row('backlash', 'wrist'), row('gear_ratio', 'elbow')]
    for effect, joint, pieces in (
        ('gear_ratio', 'wrist', 1.0),
        ('joint_compliance', 'wrist', 0.0),
        ('gear_ratio', 'base', 0.0),
    ):
        told = of_name(row(effect, joint), 2.0, 1.0, (0.1,), beside)
        assert told['others of its curve'] == pieces
        assert told['faint beside others'] == 0.0


def test_waves_of_which_the_slowest_is_seen_in_part_are_any_smooth_curve():
    turn = 2.0 * np.pi
    assert part_of_a_wave(np.array([1.0, 9.0]), 0.1 * turn) == pytest.approx(1.0)
    assert part_of_a_wave(np.array([1.0, 9.0]), 1.5 * turn) == 0.0
    assert part_of_a_wave(np.array([1.0]), 0.1 * turn) == 0.0
    assert part_of_a_wave(np.zeros(0), np.inf) == 0.0


@pytest.fixture(scope='module')
def play():
    """Return a robot, and a recording of it with play in its elbow."""
    robot = wt.load('ur5')
    plan = wt.plan(robot, wt.default_seam(robot, 'spline'), 'aggressive', rate_hz=25.0)
    commanded = wt.Recording('seam', plan.motion)
    real = wt.Twin(robot, [wt.effects.Backlash('elbow_joint', width=5e-4)]).poses(commanded)
    noise = np.random.default_rng(7).normal(scale=2e-5, size=real.position.shape)
    return robot, commanded.with_measured(wt.Measurements(plan.motion.t, real.position + noise))


def test_what_stands_in_for_another_cause_is_believed_less(play):
    robot, recording = play
    right = wt.diagnose(recording, robot, experiment=False)
    other = wt.diagnose(recording, robot, exclude=('backlash',), experiment=False)
    (own,) = (s for s in right.statements if s.kind == 'name')
    imitating = [s for s in other.statements if s.kind == 'name']
    assert right.causes[0].probability == own.probability > 0.6
    # It is drawn from the evidence alone, and can be drawn anew.
    table = tuple(
        Row.of(candidate_set, wt.Beliefs()) for candidate_set in right.evidence.candidate_sets
    )
    (again,) = stated(right.evidence, table, wt.Beliefs()).names
    assert again.probability == own.probability
    assert right.confidence == right.as_dict()['verdict']['learned'] > 0.5
    assert all(s.features['wander'] > own.features['wander'] for s in imitating)
    assert all(s.features['least missed'] < own.features['least missed'] for s in imitating)
    assert all(s.probability < own.probability for s in imitating)
    assert other.confidence < right.confidence or other.status == 'unknown'


def cause(*levels, **more):
    """Return the one cause that there is, from pairs of what may be and how likely it is."""
    return Cause(*map(tuple, levels), 0.9, (0.8, 1.0), (0,), effect=0, **more)


def test_a_set_over_several_places_is_sure_of_none_of_them():
    zero, tilt = Site('joint_offset', 'wrist'), Site('gear_ratio', 'elbow')
    candidate_set = (Alternative(zero, 9.0, _Fit(), 0.5), Alternative(tilt, 9.0, _Fit(), 0.5))
    row = Row.of(candidate_set, wt.Beliefs())
    own = cause(row.places().items(), row.dependences().items(), row.names().items(), row=0)
    names = (Statement('name', 0, {'size': 1.0, 'members': 2.0}, 0.9),)
    before = Stated((row,), names, None, {}, 1e-5)
    verdict = Verdict('ambiguous', ((zero, tilt),))
    _, (told,), _ = calibrated(verdict, (own,), before, {})
    assert told.probability == pytest.approx(0.9)
    assert dict(told.name) == pytest.approx({zero: 0.45, tilt: 0.45})
    # Where the set is right each place is as likely as its name; only where it is wrong a place may
    # have more than that.
    for levels in (dict(told.place), dict(told.dependence)):
        assert all(0.45 <= p <= 0.55 for p in levels.values())
        assert sum(levels.values()) <= 1.0 + 1e-9


@pytest.mark.parametrize(('first', 'others'), [(0.8, (0.12, 0.08)), (0.25, (0.25, 0.25))])
def test_others_share_what_the_first_leaves_as_before_and_none_is_likelier_than_it(first, others):
    told = _led((('a', 0.5), ('b', 0.3), ('c', 0.2)), first)
    assert [key for key, _ in told] == ['a', 'b', 'c']
    # Of 0.75 three fifths would be 0.45, which is more than the first has.
    assert [value for _, value in told] == pytest.approx([first, *others])
    assert _led((), 0.4) == () and _led((('a', 1.0), ('b', 0.0)), 0.6)[1] == ('b', 0.0)


@pytest.mark.parametrize(('growth', 'status'), [(3.0, 'identified'), (0.12, 'ambiguous')])
def test_kinds_that_are_each_likelier_wrong_than_right_identify_nothing(growth, status):
    site, size = Site('link_length', 'elbow_joint'), 1e-4 if growth > 1.0 else 1e-6
    kind = Family(
        'link_length', (growth, growth), True, ((site, size),), size, ((site, 1.0),), named=True
    )
    own = cause([('elbow_joint', 1.0)], [('constant', 1.0)], [(site, 1.0)])
    verdict = Verdict('identified', ((site,),), families=(kind,))
    before = Stated((), (), None, {}, (1e-5, 1e-5))
    reported, (told,), _ = calibrated(verdict, (own,), before, {})
    assert (told.probability > 0.5) is (status == 'identified')
    assert reported.status == status
