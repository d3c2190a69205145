# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The proof of the gate: mistakes are what they say, and the command measures them."""

import json

import numpy as np
import pytest

from weld_twin_core import Twin, forward
from weld_twin_core.diagnosis.result import MISTAKES
from weld_twin_lab.gate import mistakes
from weld_twin_lab.gate.mistakes import KINDS, MOVING_ONLY, Hidden
from weld_twin_lab.gate.trials import result
from weld_twin_nodes.cli import main
from weld_twin_nodes.offline import task_pool

pytest.importorskip('mujoco', reason='cases are simulated with MuJoCo')


@pytest.fixture(scope='module')
def recording():
    return mistakes.draw(np.random.default_rng(4), rich=True)


ELSEWHERE = {'wrong_fixture', 'intrinsics', 'target_scale', 'target_mirrored', 'cameras_swapped'}
"""Mistakes of a cell with a positioner and of cameras: the tests of cells and of cameras make them."""


def test_every_kind_of_mistake_that_is_documented_is_made():
    assert set(KINDS) | ELSEWHERE == set(MISTAKES)


@pytest.mark.parametrize('kind', [k for k in KINDS if k not in MOVING_ONLY])
def test_a_mistake_opens_a_gap_that_the_sound_recording_has_not(recording, kind):
    rng = np.random.default_rng(7)
    robot, made = recording.robot, None
    for _ in range(20):
        try:
            robot, made, said = KINDS[kind](recording, rng)
            break
        except Hidden:
            continue
    if made is None:
        pytest.skip('this recording cannot show it')
    assert said
    changed = not np.array_equal(made.joints.q, recording.recording.joints.q)
    changed |= not np.array_equal(made.measured.position, recording.recording.measured.position)
    turns = made.measured.rotation, recording.recording.measured.rotation
    changed |= turns[0] is not None and not np.array_equal(*turns)
    other = Twin(robot).poses(made, made.measured.t).position
    same = Twin(recording.robot).poses(made, made.measured.t).position
    assert changed or not np.allclose(other, same)


def test_a_joint_that_slips_takes_position_and_turn_along(recording):
    made = said = None
    for seed in range(40):
        try:
            _, made, said = KINDS['joint_slipped'](recording, np.random.default_rng(seed))
            break
        except Hidden:
            continue
    assert made is not None and said is not None
    name, size, _ = said.split()
    slip = np.zeros(recording.real.n)
    slip[recording.real.index(name)] = 1e-3 * float(size)
    q = recording.recording.joints.at(made.measured.t)[0]
    way = forward(recording.real, q + slip)[:, :3, 3] - forward(recording.real, q)[:, :3, 3]
    moved = np.linalg.norm(made.measured.position - recording.recording.measured.position, axis=1)
    after = moved > 0.0
    np.testing.assert_allclose(moved[after], np.linalg.norm(way[after], axis=1), rtol=0.01)


def test_the_same_draw_is_the_same_recording():
    first, second = (mistakes.draw(np.random.default_rng(9)) for _ in range(2))
    assert first.about == second.about
    assert np.array_equal(first.recording.measured.position, second.recording.measured.position)


def test_one_miss_in_ten_or_one_complaint_fails_the_proof():
    def trials(named, count=10):
        return [
            {
                'kind': kind,
                'way': 'bag',
                'right': kind != 'sign' or k < named,
                'only_alike': kind == 'sign' and k >= named,
            }
            for kind in KINDS
            for k in range(count)
        ]

    quiet, loud = [{'right': True}], [{'right': False}]
    assert result([*trials(10), *quiet], 1)['passed']
    missed = result([*trials(9), *quiet], 1)
    assert not missed['passed'], 'to stand among the alike is not to be named'
    assert missed['named']['sign']['only_alike'] == 1
    assert not result([*trials(10), *loud], 1)['passed']


def test_the_command_names_mistakes_and_spares_the_sound(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(task_pool, 'pool_of', lambda *_: task_pool.Here())
    words = ('lab', 'gate', '--out', str(tmp_path), '--draws', '1', '--sound', '1')
    assert main([*words, '--kinds', 'units', '--seed', '3']) in (0, 1)
    content = json.loads((tmp_path / 'gate.json').read_text())
    assert content['named']['units'] == {
        'trials': 2,
        'named': 2,
        'only_alike': 0,
        'bag': {'trials': 1, 'named': 1},
        'table': {'trials': 1, 'named': 1},
    }
    assert content['sound'] == {'trials': 1, 'complaints': 0}
    assert 'units' in capsys.readouterr().out


def test_an_unknown_mistake_is_refused(tmp_path, capsys):
    assert main(['lab', 'gate', '--out', str(tmp_path / 'x'), '--kinds', 'gremlins']) == 2
    assert 'there is no mistake' in capsys.readouterr().err
