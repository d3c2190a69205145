# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Fleets of recordings: what is refused or runs again, and pages as they were kept."""

import shutil
import sqlite3
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest

from weld_twin_core.errors import DataError
from weld_twin_nodes.cli.in_process import weld_twin
from weld_twin_report.fleet import read_list
from weld_twin_report.history import Database, Entry
from weld_twin_report.history.runs import Run, Runs, Verified, put_verified

pytest.importorskip('sqlalchemy', reason='the history is an extra')


BAG = Path(__file__).parents[4] / 'bags/elbow_play'


def rows(db, query):
    with sqlite3.connect(db) as connection:
        return connection.execute(query).fetchall()


@pytest.fixture
def plant(tmp_path):
    """Return a folder with a list of five recordings: two are sound, three are not."""
    shutil.copytree(BAG, tmp_path / 'sound')
    (tmp_path / 'noise.mcap').write_bytes(b'\x89MCAP0\r\n' + bytes(range(256)) * 40)
    (tmp_path / 'list.csv').write_text(
        'cell,recording,robot,at,align\n'
        'line 1,sound,ur5,2026-03-02,\n'
        'line 2,sound,ur5,2026-03-02T10:00,base\n'
        'line 3,noise.mcap,ur5,2026-03-02,\n'
        'line 4,missing,ur5,2026-03-02,\n'
        'line 5,sound,no_robot,2026-03-02,\n'
    )
    return tmp_path


def test_bad_recordings_harm_nobody_and_nothing_runs_twice(plant):
    db = plant / 'fleet.db'
    words = ['history', 'run', plant / 'list.csv', '--db', db, '--workers', '2']
    first = weld_twin(*words, '--keep', plant / 'kept')
    assert (first.code, first.out) == (1, f'{plant}/list.csv: 2 done, 3 refused\n')
    assert 'line 3' in first.err and 'line 4' in first.err and "'no_robot'" in first.err
    written = rows(db, 'select * from runs order by id')
    assert [row[2] for row in sorted(written, key=lambda row: row[2])] == [
        f'line {k}' for k in range(1, 6)
    ]
    assert sorted(
        rows(db, 'select name, status from cells join verdicts on cell_id = cells.id')
    ) == [('line 1', 'identified'), ('line 2', 'identified')]
    assert len(list((plant / 'kept').glob('*/report.html'))) == 2
    second = weld_twin(*words)
    assert (second.code, second.out) == (0, f'{plant}/list.csv: 5 there already\n')
    assert rows(db, 'select * from runs order by id') == written
    shown = weld_twin('history', 'show', '--cell', 'line 1', '--db', db)
    assert 'backlash of elbow_joint' in shown.out


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('cell,recording\na,b\n', "no column 'robot'"),
        ('cell,recording,robot,colour\na,b,c,red\n', "column 'colour' is not known"),
        ('cell,recording,robot\na,,ur5\n', 'line 2 has no recording'),
        ('cell,recording,robot\na,b\n', 'line 2 has not as many cells'),
        ('cell,recording,robot,at\na,b,ur5,Monday\n', "'Monday' is no date"),
        ('cell,recording,robot,apply\na,b,ur5,maybe\n', 'apply is yes or no'),
        ('cell,recording,robot\n"a\nb",c,ur5\n', 'is no name of a cell'),
        ('cell,recording,robot\n', 'names no recording'),
        ('', "no column 'cell'"),
        ('cell,recording,robot\n"a,b,c\n', 'no table of text'),
    ],
)
def test_a_list_that_is_wrong_is_refused_in_a_sentence(tmp_path, text, said):
    file = tmp_path / 'list.csv'
    file.write_text(text)
    with pytest.raises(DataError, match=said):
        read_list(file)


def test_a_request_is_known_by_what_is_asked_not_by_its_names(plant):
    (one, other, *_) = read_list(plant / 'list.csv')
    key = one.key()
    assert key != other.key()
    shutil.move(plant / 'sound', plant / 'moved')
    text = (plant / 'list.csv').read_text().replace('sound', 'moved')
    (plant / 'list.csv').write_text(text)
    assert read_list(plant / 'list.csv')[0].key() == key
    (plant / 'moved/more').write_bytes(b'x')
    assert read_list(plant / 'list.csv')[0].key() != key


def test_a_robot_of_ones_own_is_its_file_so_that_a_changed_one_runs_again(plant, monkeypatch):
    monkeypatch.setenv('WELD_TWIN_ROBOTS', str(plant / 'robots'))
    (plant / 'robots').mkdir()
    file = plant / 'robots/cell7.yaml'
    file.write_text('joints: [{name: one, a: 0.3}]\n')
    (plant / 'list.csv').write_text('cell,recording,robot\nline 1,sound,cell7\nline 2,sound,ur5\n')
    own, bundled = read_list(plant / 'list.csv')
    assert (own.robot, bundled.robot) == (str(file), 'ur5')
    before = own.key(), bundled.key()
    file.write_text('joints: [{name: one, a: 0.4}]\n')
    after = own.key(), bundled.key()
    assert (before[0] == after[0], before[1] == after[1]) == (False, True)


MONDAY = datetime(2026, 3, 2, 8, 30, tzinfo=timezone.utc)
NAMES = ('joint_offset elbow_joint 0', 'tool.x', 'tool.turn_z', 'backlash elbow_joint 0',
         'transmission_ripple wrist_1_joint 1')  # fmt: skip
SIGMA = np.array([1e-5, 2e-5, 5e-5, 3e-6, 4e-6])
CELLS = {
    'quiet': lambda week: np.zeros(5),
    'stepped': lambda week: np.array([1.5e-4 * (week >= 6), 0.0, 0.0, 0.0, 0.0]),
    'worn': lambda week: np.array([0.0, 0.0, 0.0, 8e-6 * week, 0.0]),
    'hit': lambda week: np.array([0.0, 4e-4 * (week >= 8), 0.0, 0.0, 5e-5 * (week >= 4)]),
}
"""What is added to the five coordinates of an arm, week by week."""


def entries(seed, moved):
    """Return twelve weekly diagnoses; one without a belief, one without a gap."""
    rng = np.random.default_rng(seed)
    for week in range(12):
        value = rng.normal(size=5) * SIGMA + [0.0, 1e-3, 0.0, 5e-4, 1e-4] + moved(week)
        play = {'effect': 'backlash', 'joint': 'elbow_joint', 'parameters': {'width': value[3]}}
        zero = {'effect': 'joint_offset', 'joint': 'elbow_joint'}
        status = ('identified', 'ambiguous', 'unknown', 'none')[week % 4]
        yield Entry(
            MONDAY + timedelta(weeks=week), 'ur5', 'abc', f'{seed:032d}{week:032d}', status,
            None if week == 2 else 0.8 + 0.01 * week, None if week == 3 else 1e-4 * (4 - seed % 3),
            2e-5, 3e-5, [play, zero][: week % 3], NAMES, value, np.full(5, 1e-3),
            np.diag(SIGMA**2), np.eye(4),
        )  # fmt: skip


@pytest.fixture(scope='module')
def fleet(tmp_path_factory):
    """Return a history of four cells, and its pages."""
    place = tmp_path_factory.mktemp('fleet')
    database = Database(str(place / 'fleet.db'))
    for seed, (cell, moved) in enumerate(CELLS.items()):
        assert all(database.add(cell, entry) for entry in entries(seed, moved))
    why = "'<b>noise</b>.mcap' is damaged"
    Runs(database).write(
        Run('key', 'worn', '/data/<b>noise</b>.mcap', 'refused', why, 0.1, 1), None
    )
    measured, promised = {'rms_m': 3e-4}, {'rms_m': 1e-4, 'interval_m': [0.0, 2e-4]}
    content = {'kept': False, 'kinematics': 'abc', 'causes': [], 'inputs': []}
    content |= {'measured': measured, 'promised': promised}
    late = Verified(MONDAY + timedelta(days=80), 'f' * 64, content)
    database.write(lambda connection: put_verified(database, connection, 'hit', late))
    database.close()
    said = weld_twin('history', 'page', '--db', place / 'fleet.db', '--out', place / 'pages')
    assert (said.code, said.out) == (0, f'{place}/pages/index.html: 4 cells\n')
    return place


def test_pages_are_as_they_were_kept(fleet, kept):
    pages = sorted((fleet / 'pages').glob('*.html'))
    assert len(pages) == 1 + len(CELLS)
    for page in pages:
        kept(page.stem, page.read_text(encoding='utf-8'))


@pytest.mark.parametrize('cell', CELLS)
def test_what_commands_say_of_a_cell_is_as_it_was_kept(cell, fleet, kept):
    words = ('--cell', cell, '--db', fleet / 'fleet.db')
    limit = ('--limit', 'backlash=1.1e-3')
    asked = [('show',), ('changed', *limit), ('changed', '--since', '2026-05-01'),
             ('changed', *limit, '--json')]  # fmt: skip
    said = [weld_twin('history', job, *words, *more) for job, *more in asked]
    assert [each.code for each in said] == [0] * len(asked)
    kept(f'said_{cell}', '\n'.join(each.out for each in said))
