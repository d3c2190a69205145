# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A case in the open form, methods that answer it, and what the answers are worth."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from weld_twin_core import DataError, JointMotion, Measurements, Recording, Signal, forward, load
from weld_twin_lab.contest.course import (
    ContestAnswer,
    commands,
    read_answer,
    read_case,
    run_all,
    write_answer,
    write_case,
)
from weld_twin_lab.contest.course import page as told_page
from weld_twin_lab.contest.entrants import geometry
from weld_twin_lab.contest.scores import Sealed, page, point
from weld_twin_msgs_py.files.yaml_file import yaml_text

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
    file = tmp_path / 'robot.yaml'
    file.write_text(yaml_text(robot.to_mapping()), encoding='utf-8')
    said = {'align': [], 'exclude': [], 'known': ''}
    write_case(tmp_path / 'cases' / 'one', file, tuple(recordings), said)
    return tmp_path / 'cases' / 'one', recordings[1].measured.position


@pytest.fixture
def truth(case):
    folder, positions = case
    nominal = geometry.never_knows(read_case(folder)).predicted
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
    folder, positions = case
    assert read_case(folder).ask.measured is None
    first = f'{positions[0, 0]:.17g}'
    assert not any(first in file.read_text() for file in folder.iterdir())


def test_a_case_is_read_as_it_was_written_with_all_that_was_recorded(tmp_path):
    rng, t = np.random.default_rng(2), 0.1 * np.arange(30.0)
    motion = JointMotion(t, rng.normal(size=(30, 6)), rng.normal(size=(30, 6)))
    turns = Rotation.random(30, random_state=1).as_matrix()
    whole = Recording(
        'train',
        motion,
        Measurements(t, rng.normal(size=(30, 3)), turns),
        Signal(t[::3], rng.normal(size=(10, 6)), held=True),
        'base',
        Signal(t[::5], rng.normal(size=6), held=True),
    )
    (tmp_path / 'robot.yaml').write_text(yaml_text(load('ur5').to_mapping()), encoding='utf-8')
    said = {'align': ['base'], 'exclude': ['drift'], 'known': ''}
    write_case(tmp_path / 'case', tmp_path / 'robot.yaml', (whole, whole), said)
    back = read_case(tmp_path / 'case')
    assert (back.align, back.exclude, back.known) == (('base',), ('drift',), None)
    np.testing.assert_array_equal(back.times, t)
    for one in (back.train, back.ask):
        assert (one.wrench_frame, one.joints.static) == ('base', False)
        for got, given in ((one.wrench, whole.wrench), (one.temperature, whole.temperature)):
            np.testing.assert_array_equal(got.t, given.t)
            np.testing.assert_array_equal(got.value, given.value)
        np.testing.assert_array_equal(one.joints.q, motion.q)
        np.testing.assert_array_equal(one.joints.qd, motion.qd)
    np.testing.assert_allclose(back.train.measured.rotation, turns, atol=1e-15)


def test_geometry_finds_what_geometry_is(case, truth):
    said = geometry.geometry(read_case(case[0]))
    worth = point(said, truth)
    assert worth.detected and worth.family and worth.joint and not worth.sure_wrong
    assert worth.over_floor < 1.3
    assert worth.belief > 0.5


def test_how_sure_an_answer_is_counts_by_cover_width_and_crps(case, truth, tmp_path):
    write_answer(tmp_path / 'said', geometry.bootstrap(read_case(case[0])))
    said = read_answer(tmp_path / 'said', 80)
    worth = point(said, truth)
    assert 0.82 < worth.held < 0.97
    assert worth.width_m == pytest.approx(2 * 1.645 * NOISE, rel=0.3)
    # Of normal noise that is told as it is, the score is its size over the root of pi.
    assert worth.crps_m == pytest.approx(NOISE / np.sqrt(np.pi), rel=0.2)
    for factor in (0.3, 3.0):
        assert point(replace(said, sigma=factor * said.sigma), truth).crps_m > 1.1 * worth.crps_m
    assert point(geometry.never_knows(read_case(case[0])), truth).crps_m is None


def test_the_scales_are_what_they_are(case, truth, tmp_path):
    silent = point(geometry.never_knows(read_case(case[0])), truth)
    assert silent.left == pytest.approx(1.0)
    assert silent.detected and not silent.family and silent.belief == 0.0
    wrong = geometry.zero_offset(read_case(case[0]))
    assert point(wrong, truth).sure_wrong and not point(wrong, truth).family
    # Who says which of its names are sure is not judged by how likely they are.
    for sure in (True, False):
        write_answer(
            tmp_path / str(sure), replace(wrong, sure=(*(sure for _ in wrong.causes), False))
        )
        assert point(read_answer(tmp_path / str(sure), 80), truth).sure_wrong is sure


def test_names_beyond_three_of_one_cause_do_not_count(case, truth):
    names = [(effect, 'elbow_joint', 0.2) for effect in ('backlash', 'servo_lag', 'joint_offset')]
    hidden = (*names, ('link_length', 'elbow_joint', 0.1))
    predicted = geometry.never_knows(read_case(case[0])).predicted
    assert not point(ContestAnswer(predicted, (hidden,)), truth).family
    assert point(ContestAnswer(predicted, (hidden[1:],)), truth).family


def test_anybody_can_enter_and_a_failure_is_told(case, truth, tmp_path):
    folder, _ = case
    program = tmp_path / 'method.py'
    program.write_text(
        'import json, sys\n'
        'open(sys.argv[0] + ".asked", "a").write("once\\n")\n'
        'rows = open(sys.argv[1] + "/ask_times.csv").read().split()[1:]\n'
        'open(sys.argv[2] + "/predicted.csv", "w").write("x,y,z\\n" + "0,0,0\\n" * len(rows))\n'
        'said = {"causes": [], "unknown": 1.0, "none": 0.0}\n'
        'json.dump(said, open(sys.argv[2] + "/answer.json", "w"))\n',
        encoding='utf-8',
    )
    entered = [
        f'mine={sys.executable} {program} {{case}} {{out}}',
        f'broken={sys.executable} -c 1/0 {{case}} {{out}}',
    ]
    methods = commands(['never_knows'], entered)
    asked = folder.parent, ['one'], methods, tmp_path / 'out', {'one': 80}, lambda _: None
    runs = run_all(*asked)
    assert runs['mine']['one'].answer.unknown == 1.0
    assert runs['never_knows']['one'].answer.unknown == 1.0
    assert runs['broken']['one'].trouble == 'ZeroDivisionError: division by zero'
    told = page(runs, {'one': truth}, '')
    assert '| mine | 1 of 1 |' in told and '| broken | 0 of 1 |' in told
    again = run_all(*asked)
    assert program.with_name('method.py.asked').read_text() == 'once\n'
    assert {name: said['one'].seconds for name, said in again.items()} == {
        name: said['one'].seconds for name, said in runs.items()
    }


def test_the_page_says_who_is_best_on_the_measured_arms(truth):
    floor = truth.positions + NOISE
    errors = {'weld_twin': {'arm_odd': 2e-4, 'arm_n30': 1e-4}, 'mine': {'arm_odd': 1e-4}}
    told = told_page('TABLE', errors, {'arm_odd': floor, 'arm_n30': floor})
    assert '| weld_twin | 0.200 | **0.100** |' in told and '| mine | **0.100** | - |' in told
    assert 'measured arms' not in told_page('TABLE', {}, {})


def test_a_method_that_cannot_be_loaded_is_one_sentence(monkeypatch):
    monkeypatch.setitem(sys.modules, 'weld_twin_lab.contest.entrants.learners', None)
    with pytest.raises(DataError, match=r"'boosted_trees' cannot be loaded .* leave it out"):
        commands(['never_knows', 'boosted_trees'], [])


@pytest.mark.parametrize('text', ['mine', 'mine=run {case}', '=run {case} {out}'])
def test_a_command_without_its_places_is_refused(text):
    with pytest.raises(DataError, match='--enter takes NAME=COMMAND'):
        commands([], [text])


def test_an_answer_out_of_form_is_refused(case, tmp_path):
    predicted = np.zeros((80, 3))
    write_answer(tmp_path, ContestAnswer(predicted, unknown=0.4))
    assert read_answer(tmp_path, 80).unknown == 0.4
    with pytest.raises(DataError, match='must have 79 rows'):
        read_answer(tmp_path, 79)
    said = json.loads((tmp_path / 'answer.json').read_text())
    (tmp_path / 'answer.json').write_text(json.dumps({**said, 'none': 1.5}))
    with pytest.raises(DataError, match='not between 0 and 1'):
        read_answer(tmp_path, 80)
