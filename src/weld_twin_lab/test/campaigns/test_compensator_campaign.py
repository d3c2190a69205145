# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the campaign of the compensator counts and judges, on goals whose answer is known."""

import json
from pathlib import Path

import numpy as np
import pytest

from weld_twin_core import JointMotion, Recording, Twin, forward, load
from weld_twin_core.twin.goal_correction import corrected_goal
from weld_twin_core.twin.goal_motion import course
from weld_twin_core.twin.program_model import ProgramModel
from weld_twin_lab.campaigns.compensator import (
    IN_A_CELL,
    counted,
    summary,
    table,
    unfinished,
    worse,
)
from weld_twin_lab.campaigns.drawn_cells import (
    HOMES,
    RECORDED,
    cell_of,
    drawn_goal,
    learned,
    true_effects,
)
from weld_twin_msgs_py.files.diagnosis_model import read_model
from weld_twin_nodes.offline.correcting import program_model

pytestmark = pytest.mark.drawn

KEPT = Path(__file__).parents[4] / 'docs/results/robustness/compensator.json'
OTHER = 'exit code 2: weld_twin: diagnosis is of the robot ur10e'


def row(**change):
    of = {'robot': 'ur5', 'arm': 7, 'after': '', 'inside': True, 'verdict': 'corrected'}
    was = {'before_m': 4e-4, 'after_m': 1e-5, 'best_m': 0.0, 'worst_m': 1.5e-5, 'bound_m': 2e-5}
    return {**of, **was, **change}


def after(what, **change):
    return row(after=what, verdict='refused', after_m=4e-4, bound_m=None, **change)


CHANGE = {'robot': 'ur5', 'change': 'load changed', 'noticed': True, 'seconds': 1.0}


@pytest.mark.parametrize(
    ('before', 'found', 'expected'),
    [(1e-4, 1.19e-4, False), (1e-4, 1.21e-4, True), (1e-3, 1.04e-3, False), (1e-3, 1.06e-3, True)],
)
def test_worse_is_by_more_than_both_allowances(before, found, expected):
    assert worse(row(before_m=before, after_m=found)) is expected


def test_nine_bounds_of_ten_pass_and_ten_of_ten_do_not():
    ten = [row() for _ in range(9)] + [row(worst_m=3e-5)]
    rows = [*ten, after('load changed')]
    assert summary(rows, [CHANGE], OTHER)['passed']
    assert not summary([row() for _ in range(10)], [CHANGE], OTHER)['passed']
    told = table({**summary(rows, [CHANGE], OTHER)})
    assert '9 of 10' in told


def test_a_goal_of_which_no_bound_is_told_counts_among_no_bounds():
    found = counted([row(), row(bound_m=None)])
    assert (found['corrected'], found['bounds'], found['held']) == (2, 1, 1)
    assert found['median']['bound_m'] == 2e-5


def test_bounds_that_fail_together_in_one_arm_are_counted_by_arms():
    sound = [row(arm=k) for k in range(9) for _ in range(4)]
    failing = [row(arm=9, worst_m=3e-5)] * 3 + [row(arm=9)]
    found = summary([*sound, *failing], [], OTHER)
    assert found['held'] == 37 / 40
    assert found['spread'] == {
        'arms': 10, 'all': 9, 'most': 9, 'fewer_than_half': 1, 'least': 0.25,
    }  # fmt: skip
    assert '92.5% of all bounds held: all of them in 9 of 10 arms' in table(found)


@pytest.mark.parametrize(
    ('rows', 'changes', 'other'),
    [
        ([row(after='load changed')], [CHANGE], OTHER),
        ([row(after_m=5e-4)], [CHANGE], OTHER),
        ([row(verdict='refused', after_m=4e-4)] * 3, [CHANGE], OTHER),
        ([], [{**CHANGE, 'noticed': False}], OTHER),
        ([], [CHANGE], 'exit code 0: active'),
    ],
)
def test_one_miss_of_any_kind_fails_the_campaign(rows, changes, other):
    nine = [row() for _ in range(18)] + [row(worst_m=3e-5), row(worst_m=3e-5)]
    assert summary(nine, [CHANGE], OTHER)['passed']
    assert not summary(nine + rows, changes, other)['passed']


def test_whoever_goes_on_tries_what_is_missing_alone():
    from weld_twin_lab.campaigns.drawn_cells import CHANGES, Known, arms_of

    (first, second), last = arms_of(2 * IN_A_CELL, IN_A_CELL, 7), {**CHANGE, 'change': CHANGES[-1]}
    assert (first.name, first.seed) == ('ur5', 7) and second.name != 'ur5'
    known = Known([row()] * IN_A_CELL + [after(CHANGES[-1])], [last], [])
    assert unfinished(known, IN_A_CELL, 7) == []
    assert unfinished(known, 2 * IN_A_CELL, 7) == [second]  # more goals are asked for than before
    assert unfinished(Known(known.rows[1:], [last], []), IN_A_CELL, 7) == [first]
    assert unfinished(Known(known.rows, [CHANGE], []), IN_A_CELL, 7) == [first]
    seventh = arms_of(7 * IN_A_CELL, IN_A_CELL, 7)[-1]  # one kind comes again, with other causes
    assert (seventh.name, seventh.seed, seventh.changed) == ('ur5', 13, False)


def test_an_arm_is_off_by_a_little_everywhere_besides_its_causes():
    robot, causes, _ = cell_of('ur5', 3)
    true = Twin(robot, true_effects(robot, causes[:3])), Twin(robot, true_effects(robot, causes))
    q = HOMES['ur5'] + 0.3 * np.random.default_rng(1).uniform(-1.0, 1.0, (50, 6))
    still = Recording('still', JointMotion(np.arange(50.0), q, None, True))
    apart = np.linalg.norm(true[1].poses(still).position - true[0].poses(still).position, axis=1)
    assert 5e-6 < np.sqrt((apart**2).mean()) < 3e-4


def test_goals_are_seams_and_those_inside_lie_where_the_arm_was_recorded():
    rng = np.random.default_rng(3)
    for name in ('ur5', 'abb_irb1600'):
        robot = load(name)
        for _ in range(3):
            goal, inside = drawn_goal(robot, rng)
            away = np.abs(goal.q - np.array(HOMES[name])).max()
            assert inside == (away <= RECORDED)
            way = np.linalg.norm(np.diff(forward(robot, goal.q)[:, :3, 3], axis=0), axis=1).sum()
            assert 0.04 < way < 0.6


def test_what_an_arm_has_a_little_of_is_corrected_beside_its_causes_and_the_bounds_hold(tmp_path):
    robot, causes, rng = cell_of('fanuc_m10ia', 61000)
    file = tmp_path / 'diagnosis.json'
    file.write_text(learned(robot, causes, rng).text)
    true = Twin(robot, true_effects(robot, causes))
    whole, named = program_model(robot, file), ProgramModel(robot, read_model(robot, file).found)
    off, bounds = [], []
    for goal in [drawn_goal(robot, rng) for _ in range(6)]:
        if goal.inside:
            found = [corrected_goal(model, goal.goal) for model in (whole, named)]
            off.append([_off(true, goal.goal, one.goal) for one in found])
            bounds.append(found[0].bound)
    after, alone = np.transpose(off)
    assert len(after) > 3
    assert after.mean() < 0.6 * alone.mean()
    assert (after <= bounds).mean() > 0.8


def _off(true, meant, run):
    """Return how far the real tool is from where a goal means it, at most [m]."""
    t = np.linspace(meant.t[0], meant.t[-1], 50)
    real = true.poses(Recording('run', JointMotion(t, course(run, t).q))).position
    return np.linalg.norm(real - forward(true.robot, course(meant, t).q)[:, :3, 3], axis=1).max()


@pytest.mark.skipif(not KEPT.exists(), reason='the result is not kept yet')
def test_the_kept_result_is_what_its_goals_come_to():
    kept = json.loads(KEPT.read_text())
    again = counted([goal for goal in kept['goals'] if not goal['after']])
    assert again == kept['totals']
    assert again['worse'] == 0
