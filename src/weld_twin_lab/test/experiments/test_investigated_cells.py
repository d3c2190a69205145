# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What investigated cells add up to, and what a cell records when something in it is changed."""

import numpy as np
import pytest

from weld_twin_core import DataError, load
from weld_twin_lab.experiments.study import page, summary


def said(right, sure, status='identified'):
    return {'status': status, 'right': right, 'sure': sure, 'confidence': 0.9, 'said': ''}


def step(promise, decided):
    return {
        'kind': 'path',
        'robot_minutes': 1.5,
        'seconds': 9.0,
        'promise': promise,
        'decided': decided,
    }


def case(name, loop, rounds):
    truth = {'robot': 'ur5', 'motion': 'free', 'sites': [['drift', None]]}
    first, minutes = said(False, False, 'ambiguous'), 1.5 * len(rounds)
    told = {'name': name, 'truth': truth, 'poor': 'small', 'first': first}
    return {**told, 'rounds': rounds, 'end': 'sure', 'minutes': minutes, 'loop': loop}


def test_only_what_was_said_counts():
    cases = [
        case('a', said(True, True), [step(0.9, True)]),
        case('b', said(False, True), [step(0.4, False), step(None, None), step(0.85, False)]),
    ]
    told = summary(cases)
    assert told['cells'] == 2
    assert (told['right_and_sure'], told['right']) == (1, 1)
    assert told['sure_and_wrong'] == 1 and told['minutes_to_certainty'] == 1.5
    assert (told['experiments'], told['that_compared'], told['decided']) == (4, 3, 1)
    assert (told['said_they_would'], told['of_these_decided']) == (2, 1)
    assert told['foreseen'] == pytest.approx(2.15)
    text = page({'summary': told, 'cases': cases})
    assert '- right_and_sure: 1' in text and 'identified, wrong, sure' in text


def test_a_sealed_cell_records_with_what_was_changed():
    pytest.importorskip('mujoco', reason='the plant needs MuJoCo')
    from weld_twin_lab.blind.blind_cell import Motion
    from weld_twin_lab.blind.making import lots
    from weld_twin_lab.experiments.study import SealedCell
    from weld_twin_nodes.offline.set_up_changes import set_up_change, with_changes

    number, lot = next(
        (k, x) for k, x in enumerate(lots(3, 40, ('single',))) if x.motion == 'stations'
    )
    cell = SealedCell(lot, 3, number)
    middle = np.clip(np.zeros(cell.robot.n), cell.robot.lower + 0.6, cell.robot.upper - 0.6)
    q = middle + np.random.default_rng(1).uniform(-0.5, 0.5, (12, cell.robot.n))
    stations = Motion(15.0 * np.arange(12.0), q, static=True)
    plain = cell.made('plain', stations, 5)
    moved = cell.made('moved', stations, 5, 'instrument')
    longer = cell.made('longer', stations, 5, 'tool')
    assert cell.seen_anew([moved]) and not cell.seen_anew([plain])
    step = np.linalg.norm(longer.measured.position - plain.measured.position, axis=1)
    assert np.abs(step - 0.2).max() < 0.01
    assert np.linalg.norm(moved.measured.position - plain.measured.position, axis=1).min() > 0.3
    (_, back), _ = with_changes([plain, moved], {1: set_up_change('instrument')}, cell.robot)
    assert np.abs(back.measured.position - plain.measured.position).max() < 0.02


def test_an_experiment_begins_when_it_is_run_and_is_followed_at_an_even_rate():
    from weld_twin_lab.experiments.study import as_motion

    robot, t = load('ur5'), np.array([7.0, 7.5, 8.5, 9.0])
    asked = {'joint_names': robot.joint_names, 't': t, 'q': np.outer(t - 7.0, np.ones(6))}
    still = as_motion({**asked, 'static': True}, robot)
    assert still.static and still.t.tolist() == [0.0, 0.5, 1.5, 2.0]
    moving = as_motion({**asked, 'static': False}, robot)
    np.testing.assert_allclose(moving.q[:, 3], moving.t, atol=1e-12)  # one radian a second
    assert moving.t[0] == 0.0 and np.ptp(np.diff(moving.t)) < 1e-12 and moving.t[-1] > 1.9
    with pytest.raises(DataError, match='is not for franka_panda'):
        as_motion({**asked, 'static': True}, load('franka_panda'))
