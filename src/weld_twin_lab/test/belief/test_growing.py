# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a recording more does to an answer: how falls, lost names and orders are counted."""

import pytest

from weld_twin_lab.belief.baseline import apart, steps
from weld_twin_lab.belief.baseline import growing_page as page

PLAY, LINK = ('backlash', 'elbow_joint'), ('link_length', 'elbow_joint')


def told(*causes):
    """Return an answer of causes, each a name, its probability, and whether it is sure."""
    entries = [
        {'name': [{'effect': e, 'joint': j}], 'probability': p, 'sure': sure, 'rest': False}
        for (e, j), p, sure in causes
    ]
    return {'verdict': {'causes': entries}, 'model': [], 'unsound': []}


def row(*answers, turned=None):
    truth = {'robot': 'ur5', 'sites': [list(PLAY), list(LINK)]}
    given = {'told': list(answers), 'turned': turned or answers[-1]}
    return {'name': '1/0', 'error': None, 'truth': truth, **given}


def test_a_sure_cause_that_falls_is_counted_and_one_that_was_not_sure_is_none():
    one = told((PLAY, 0.95, True), (LINK, 0.7, False))
    two = told((PLAY, 0.8, False), (LINK, 0.4, False))
    three = told((PLAY, 0.97, True))
    found = list(steps(row(one, two, three)))
    assert [(s.cause, s.recordings, s.fell) for s in found] == [(PLAY, 1, True)]
    assert '| 1/0 | 1 | backlash of elbow_joint | 0.95 | 0.80 |' in page([row(one, two, three)])


def test_a_cause_that_comes_under_another_name_has_lost_its_own():
    other = told((('gear_ratio', 'elbow_joint'), 0.95, True))
    (lost,) = steps(row(told((PLAY, 0.95, True)), other))
    assert lost.fell and lost.after == 0.0


@pytest.mark.parametrize(
    ('other', 'most'),
    [
        (told((PLAY, 0.95, True)), 0.0),
        (told((PLAY, 0.93, True)), 0.02),
        (told((LINK, 0.95, True)), 1.0),
    ],
)
def test_an_order_that_moves_a_probability_or_a_name_is_told(other, most):
    assert apart(row(told((PLAY, 0.95, True)), turned=other)) == pytest.approx(most)
