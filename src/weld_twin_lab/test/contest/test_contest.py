# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A case in the open form, methods that answer it, and what the answers are worth."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.chain import forward
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_lab.contest.arms import page as told_page
from weld_twin_lab.contest.case import ContestAnswer, answer_at, case_at, case_of, put
from weld_twin_lab.contest.course import ended, loaded, run_all
from weld_twin_lab.contest.entrants.geometry import geometry, zero_offset
from weld_twin_lab.contest.entrants.learners import never_knows
from weld_twin_lab.contest.scores import Sealed, page, point, summary

SIZE = 4e-4
NOISE = 2e-5


@pytest.fixture
def case(tmp_path):
    """Eighty stations of an arm whose elbow link is longer by `SIZE`, as files."""
    rng = np.random.default_rng(5)
    robot = load('ur5')
    length = np.array(robot.a)
    length[2] += SIZE
    real = replace(robot, a=length)
    recordings = []
    for name in ('train', 'ask'):
        q = rng.uniform(-1.5, 1.5, (80, 6))
        t = np.arange(80.0)
        seen = forward(real, q)[:, :3, 3] + rng.normal(scale=NOISE, size=(80, 3))
        recordings.append(Recording(name, JointMotion(t, q, static=True), Measurements(t, seen)))
    put(tmp_path / 'cases' / 'one', case_of(robot, *recordings, ()))
    return tmp_path / 'cases' / 'one', recordings[1].measured.position


@pytest.fixture
def truth(case):
    file, positions = case
    nominal = never_knows(case_at(file)).predicted
    return Sealed(
        {
            'kind': 'single',
            'sites': [['link_length', 'elbow_joint']],
            'alike': [],
            'floor_m': NOISE * np.sqrt(3.0),
        },
        positions,
        np.ones(80, dtype=bool),
        float(np.sqrt(((positions - nominal) ** 2).sum(axis=1).mean())),
    )


def test_what_was_measured_on_the_motion_asked_for_is_not_in_the_case(case):
    file, positions = case
    assert case_at(file).ask.measured is None
    assert np.ascontiguousarray(positions).tobytes() not in file.read_bytes()
    assert case_at(file).measured.position.tobytes() in file.read_bytes()


def test_geometry_finds_what_geometry_is(case, truth):
    said = geometry(case_at(case[0]))
    worth = point(said, truth)
    assert worth.detected and worth.family and worth.joint and not worth.sure_wrong
    assert worth.over_floor < 1.3
    assert worth.belief > 0.5


def test_the_scales_are_what_they_are(case, truth):
    silent = point(never_knows(case_at(case[0])), truth)
    assert silent.left == pytest.approx(1.0)
    assert silent.detected and not silent.family and silent.belief == 0.0
    wrong = point(zero_offset(case_at(case[0])), truth)
    assert wrong.sure_wrong and not wrong.family


def test_names_beyond_three_of_one_cause_do_not_count(case, truth):
    names = [(effect, 'elbow_joint', 0.2) for effect in ('backlash', 'servo_lag', 'joint_offset')]
    hidden = (*names, ('link_length', 'elbow_joint', 0.1))
    predicted = never_knows(case_at(case[0])).predicted
    assert not point(ContestAnswer(predicted, (hidden,)), truth).family
    assert point(ContestAnswer(predicted, (hidden[1:],)), truth).family


def test_a_method_answers_in_a_process_of_its_own_and_once(case, truth, tmp_path):
    asked = case[0].parent, ['one'], ['never_knows', 'geometry'], tmp_path / 'out', lambda _: None
    runs = run_all(*asked)
    assert runs['never_knows']['one'].answer.unknown == 1.0
    told = page({name: summary(said, {'one': truth}) for name, said in runs.items()}, '')
    assert '| never_knows | 1 of 1 |' in told and '| geometry | 1 of 1 |' in told
    again = run_all(*asked)
    assert {name: said['one'].seconds for name, said in again.items()} == {
        name: said['one'].seconds for name, said in runs.items()
    }


def test_a_failure_is_told_by_its_last_line(case, tmp_path):
    said = ended([sys.executable, '-c', '1/0'], case[0], tmp_path)
    assert said.trouble == 'ZeroDivisionError: division by zero'


def test_the_page_says_who_is_best_on_the_measured_arms(truth):
    floor = truth.positions + NOISE
    errors = {'weld_twin': {'arm_odd': 2e-4, 'arm_n30': 1e-4}, 'mine': {'arm_odd': 1e-4}}
    told = told_page('TABLE', errors, {'arm_odd': floor, 'arm_n30': floor})
    assert '| weld_twin | 0.200 | **0.100** |' in told and '| mine | **0.100** | - |' in told
    assert 'measured arms' not in told_page('TABLE', {}, {})


def test_a_method_that_cannot_be_loaded_is_one_sentence(monkeypatch):
    monkeypatch.setitem(sys.modules, 'weld_twin_lab.contest.entrants.sparse_regression', None)
    with pytest.raises(DataError, match=r"'sparse_regression' cannot be loaded .* leave it out"):
        loaded(['never_knows', 'sparse_regression'])
    with pytest.raises(DataError, match="no entrant is called 'mine'"):
        loaded(['mine'])


def test_an_answer_out_of_form_is_refused(tmp_path):
    put(tmp_path / 'answer', ContestAnswer(np.zeros((80, 3)), unknown=0.4))
    assert answer_at(tmp_path / 'answer', 80).unknown == 0.4
    with pytest.raises(DataError, match='must have 79 rows'):
        answer_at(tmp_path / 'answer', 79)
    with pytest.raises(DataError, match='there is no answer'):
        answer_at(tmp_path / 'another', 80)
