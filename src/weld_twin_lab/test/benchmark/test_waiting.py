# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The table of waits: whole commands, timed from outside."""

import json
import sys
from datetime import date

import pytest

from weld_twin_core.errors import DataError
from weld_twin_lab.benchmark.race import cost_of
from weld_twin_lab.benchmark.waiting import measured
from weld_twin_nodes.cli import main

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


def test_a_checkout_without_an_environment_is_refused(tmp_path):
    with pytest.raises(DataError, match='run make setup'):
        measured(tmp_path, tmp_path, 1, [], quiet)


def test_a_job_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(DataError, match='no job is called tea'):
        measured(None, tmp_path, 1, ['tea'], quiet)
