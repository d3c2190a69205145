# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Races are fair, commands are timed, and pages show what was kept."""

import json
import sys
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from weld_twin_core.arm import chain
from weld_twin_core.arm.bulk import BulkKernel
from weld_twin_core.errors import DataError
from weld_twin_lab.benchmark.all_races import written_out
from weld_twin_lab.benchmark.peers import find_peers
from weld_twin_lab.benchmark.race import (
    DH_KEYS,
    LEFT_OUT,
    OWN,
    Contender,
    Outcome,
    Workload,
    calibrated_arm,
    cost_of,
    links,
    race,
    random_positions,
    short,
)
from weld_twin_lab.benchmark.waiting import measured
from weld_twin_nodes.cli import main

ROOT = Path(__file__).parents[4]


def test_a_contender_that_disagrees_is_not_timed() -> None:
    calls: list[int] = []
    wrong = Contender('wrong', lambda: calls.append(1), gap=1e-3)
    with pytest.raises(DataError, match='wrong differs from the others'):
        race(Workload('sums', 'sum', [wrong], 1e-9), 3, 0.001)
    unknown = Contender('no number', lambda: calls.append(1), gap=float('nan'))
    with pytest.raises(DataError, match='no number differs'):
        race(Workload('sums', 'sum', [unknown], 1e-9), 3, 0.001)
    assert not calls


def test_contenders_take_turns() -> None:
    order: list[str] = []
    contenders = [Contender(name, lambda name=name: order.append(name)) for name in 'abc']
    outcome = race(Workload('turns', 'turn', contenders, 0.0), 4, 1e-6)
    assert [outcome.seconds[name].size for name in 'abc'] == [4, 4, 4]
    runs = ''.join(a for a, b in zip(order, [*order[1:], ''], strict=True) if a != b)
    assert runs.endswith('abcabcabcabc')


def test_a_ratio_is_taken_round_by_round() -> None:
    load = Workload('study', 'run', [], 0.0)
    seconds = {'pinocchio': np.array([6.0, 8.0]), 'own': np.array([2.0, 4.0])}
    assert Outcome(load, seconds).ratio('own') == pytest.approx([3.0, 2.0])
    assert Outcome(load, {'own': seconds['own']}).ratio('own') is None


def test_the_links_the_peers_are_told_are_those_of_the_chain() -> None:
    robot = calibrated_arm()
    first, *rest = links(robot)
    for q in random_positions(robot, 5):
        pose = first
        for angle, link in zip(q, rest, strict=True):
            c, s = np.cos(angle), np.sin(angle)
            turn = np.eye(4)
            turn[:2, :2] = [[c, -s], [s, c]]
            pose = pose @ turn @ link
        assert np.abs(pose - chain.forward(robot, q)).max() < 1e-14


def test_peers_that_are_installed_have_the_same_arm() -> None:
    robot = calibrated_arm()
    q = random_positions(robot, 20)
    peers, missing = find_peers(robot)
    assert set(peers) == {'pinocchio', 'mujoco'} and not missing
    for peer in peers.values():
        assert np.abs(peer.poses(q) - chain.forward(robot, q)).max() < 1e-13
        assert np.abs(peer.screws(q)[1] - chain.jacobian(robot, q)).max() < 1e-13


def test_two_screws_a_row_are_the_derivatives_by_all_dh_values() -> None:
    robot = calibrated_arm()
    q = random_positions(robot, 30)
    turns = [(key, i) for i in range(robot.n) for key in ('theta', 'alpha')]
    found = written_out(BulkKernel(robot, turns).screws(q)[1])
    at = chain.frames(robot, q)
    channels = [(key, i) for i in range(robot.n) for key in DH_KEYS]
    wanted = np.stack([chain.column(robot, at, channel).T for channel in channels], axis=-1)
    assert np.abs(found - wanted).max() < 1e-13


@pytest.mark.slow
def test_the_command_writes_what_it_found(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    assert main(['benchmark', '--quick', '--out', str(tmp_path / 'speed')]) == 0
    assert 'poses and Jacobians' in capsys.readouterr().out
    found = json.loads((tmp_path / 'speed' / 'benchmark.json').read_text())
    assert len(found['workloads']) == 5
    for load in found['workloads']:
        assert all(c['gap'] <= load['tolerance'] for c in load['contenders'].values())
    assert (tmp_path / 'speed' / 'benchmark.md').read_text().count('\n') == 7
    assert (tmp_path / 'speed' / 'brief.md').exists()


@pytest.mark.parametrize(
    ('page', 'table'), [('docs/speed.md', 'benchmark.md'), ('README.md', 'brief.md')]
)
def test_pages_show_the_tables_of_the_kept_run(page: str, table: str) -> None:
    kept = (ROOT / 'docs/results/benchmark' / table).read_text()
    assert kept in (ROOT / page).read_text()


def test_the_kept_tables_are_those_of_the_kept_numbers() -> None:
    folder = ROOT / 'docs/results/benchmark'
    found = json.loads((folder / 'benchmark.json').read_text())
    brief = (folder / 'brief.md').read_text()
    for load in found['workloads']:
        ratio = load['contenders'][OWN]['ratio']
        if not load['title'].endswith(LEFT_OUT):
            reference = ' + '.join(load['reference'])
            assert f'| {load["title"]} | {short(np.median(ratio))} ({reference}) |' in brief


MEGABYTE = 1_000_000


def quiet(entry):
    """Keep nothing."""


def test_a_command_is_timed_and_told_beside_what_was_measured_before(tmp_path, capsys):
    about = {'on': '2026-01-02', 'commit': 'abc1234', 'engine': 'e', 'load': 0.25}
    cost = {'wall': 60.0, 'cpu': 59.0, 'peak': 4e8}
    name = 'sensitivity study with page'
    before = [
        {'job': name, 'runs': 1, 'here': cost, 'measured': about},
        {'job': '`weld-twin --help`', 'runs': 1, 'here': cost},
        {'job': 'a job of earlier versions', 'runs': 1, 'here': cost},
    ]
    (tmp_path / 'waits.json').write_text(json.dumps(before), encoding='utf-8')
    words = ['lab', 'waits', '--only', 'twin --help', '--runs', '1', '--out', str(tmp_path)]
    assert main(words) == 0
    now, kept = json.loads((tmp_path / 'waits.json').read_text())
    assert kept == before[0]
    assert now['job'] == '`weld-twin --help`'
    assert 0.0 < now['here']['cpu'] < 5.0 and now['here']['wall'] > 0.0
    assert now['measured']['on'] == date.today().isoformat()
    assert len(now['measured']['engine']) == 16
    told = capsys.readouterr().out
    assert '2026-01-02, abc1234, load 0.2' in told and told.strip() == _table(tmp_path).strip()


def _table(place):
    page = (place / 'waits.md').read_text(encoding='utf-8')
    return page[page.index('| job') :]


def test_memory_is_that_of_the_program_and_not_of_who_started_it():
    held = b'x' * (300 * MEGABYTE)
    small = cost_of([sys.executable, '-c', 'pass'])[1].peak
    large = cost_of([sys.executable, '-c', "b'x' * 200_000_000"])[1].peak
    assert 5 * MEGABYTE < small < 60 * MEGABYTE < len(held)
    assert 200 * MEGABYTE < large < 260 * MEGABYTE


def test_a_program_that_takes_too_long_is_ended_and_one_that_fails_says_so():
    code, cost = cost_of([sys.executable, '-c', 'import time; time.sleep(60)'], limit=0.3)
    assert code == -9 and cost.wall < 30.0
    assert cost_of([sys.executable, '-c', 'raise SystemExit(3)'])[0] == 3
    assert cost_of(['a program that is not there'])[0] == 127


def test_a_table_that_is_damaged_is_refused(tmp_path, capsys):
    (tmp_path / 'waits.json').write_text('[{', encoding='utf-8')
    assert main(['lab', 'waits', '--only', 'twin --help', '--out', str(tmp_path)]) == 2
    assert 'is damaged' in capsys.readouterr().err


def test_a_job_or_an_environment_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(DataError, match='run make setup'):
        measured(tmp_path, tmp_path, 1, [], quiet)
    with pytest.raises(DataError, match='no job is called tea'):
        measured(None, tmp_path, 1, ['tea'], quiet)
