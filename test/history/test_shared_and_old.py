# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A history in either database: that many write to, of an older version, damaged, or none."""

import json
import logging
import multiprocessing
import shutil
import sqlite3
import threading
import time
from contextlib import contextmanager
from dataclasses import replace
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest
from command_line import done, refused, weld_twin
from own_postgres import NoServer, place_of, postgres, start, stop

from weld_twin_core.errors import DataError
from weld_twin_lab.benchmark.waiting_data import drawn as made
from weld_twin_lab.benchmark.waiting_data import fill
from weld_twin_report.history import Database, Unavailable

pytest.importorskip('sqlalchemy', reason='the history is an extra')

BAG = Path(__file__).parents[2] / 'bags/elbow_play'
WRITERS = 4


@pytest.fixture(scope='module')
def postgresql():
    pytest.importorskip('psycopg', reason='PostgreSQL needs its driver')
    try:
        with postgres() as url:
            yield url
    except NoServer as error:
        pytest.skip(str(error))


@pytest.fixture(params=['sqlite', 'postgresql'])
def url(request, tmp_path):
    if request.param == 'sqlite':
        return str(tmp_path / 'history.db')
    return request.getfixturevalue('postgresql')


def copies(diagnosed, place, count):
    """Return the diagnosis as that of other recordings."""
    out = []
    for k in range(count):
        data = json.loads((diagnosed / 'diagnosis.json').read_text())
        data['inputs'][0]['sha256'] = f'{k:064d}'
        file = place / f'diagnosis{k}.json'
        file.write_text(json.dumps(data))
        out.append(file)
    return out


def at_once(work, count):
    """Run a function of a number in processes of their own that begin together; return what they say."""
    context = multiprocessing.get_context('fork')
    barrier, answers = context.Barrier(count), context.Queue()

    def one(k):
        barrier.wait()
        answers.put((k, work(k)))

    processes = [context.Process(target=one, args=(k,)) for k in range(count)]
    for process in processes:
        process.start()
    out = dict(answers.get(timeout=60) for _ in processes)
    for process in processes:
        process.join()
    return [out[k] for k in range(count)]


def odd_entries():
    """Return weeks of an arm whose elbow has stepped, with values that a database may bend."""
    effect = {'effect': 'backlash', 'joint': "elbow's \u0416\U0001f600", 'std': {'width': 1e-9}}
    for week, entry in enumerate(made(1, 10)):
        odd = {2: {'confidence': None}, 3: {'gap_m': 5e-324}, 4: {'floor_m': None}}.get(week, {})
        at = entry.at + timedelta(microseconds=123456)
        yield replace(entry, at=at, effects=[effect], **{'confidence': 0.1 + 0.2, **odd})


def test_both_databases_give_back_what_was_written_and_tell_the_same(postgresql, tmp_path):
    told = []
    for url in (postgresql, str(tmp_path / 'history.db')):
        database = Database(url)
        for again in (True, False):
            assert [database.add('line 7', each) for each in odd_entries()] == [again] * 10
        for back, entry in zip(database.entries('line 7'), odd_entries(), strict=True):
            for name in ('value', 'prior_std', 'covariance', 'tool'):
                np.testing.assert_array_equal(getattr(back, name), getattr(entry, name))
            for name in ('at', 'recording', 'confidence', 'gap_m', 'floor_m', 'effects', 'names'):
                assert getattr(back, name) == getattr(entry, name)
        database.close()
        words = ('history', 'changed', '--cell', 'line 7', '--db', url, '--json')
        told.append(json.loads(done(*words)))
    assert told[0] == told[1]
    (change,) = told[0]['changes']
    assert (change['coordinate'], change['date']) == ('joint_offset elbow_joint 0', '2025-02-10')


def test_a_server_that_is_gone_is_told_in_a_sentence(tmp_path):
    pytest.importorskip('psycopg', reason='PostgreSQL needs its driver')
    url = f'postgresql+psycopg://weld:secret@/postgres?host={tmp_path}'
    said = refused('history', 'show', '--db', url)
    assert 'cannot be used' in said and 'No such file or directory' in said
    assert 'secret' not in said


def test_all_who_add_at_once_to_a_database_that_is_new_are_heard(url, elbow_found, tmp_path):
    files = copies(elbow_found, tmp_path, WRITERS)

    def add(k):
        words = ['--cell', 'line 1', '--at', f'2026-03-{k + 1:02d}', '--db', url]
        return tuple(weld_twin('history', 'add', files[k], *words))

    said = at_once(add, WRITERS)
    assert [code for code, _, _ in said] == [0] * WRITERS, said
    database = Database(url, make=False)
    assert [entry.at.day for entry in database.entries('line 1')] == list(range(1, WRITERS + 1))
    database.close()
    # The same recording once more, by all of them: it is there once.
    said = at_once(lambda _: add(0)[1], WRITERS)
    assert all('was there already' in out for out in said)


def test_of_two_robots_that_come_to_a_new_cell_at_once_one_stays(url):
    first, second = (list(made(k, 1)) for k in (1, 2))
    other = replace(second[0], robot='ur10', kinematics='other', at=datetime.now(timezone.utc))

    def add(k):
        database = Database(url)
        try:
            return database.add('line 2', (first[0], other)[k])
        except DataError as error:
            return str(error)
        finally:
            database.close()

    said = at_once(add, 2)
    assert sorted(isinstance(each, str) for each in said) == [False, True]
    assert any('with other kinematics' in str(each) for each in said)


@contextmanager
def locked(file, seconds):
    """Hold an SQLite file for a while, as another program that writes does."""
    connection = sqlite3.connect(file, check_same_thread=False, isolation_level=None)
    connection.execute('BEGIN EXCLUSIVE')
    free = threading.Timer(seconds, connection.execute, ('ROLLBACK',))
    free.start()
    yield
    free.join()
    connection.close()


@pytest.fixture
def listed(tmp_path):
    file = tmp_path / 'list.csv'
    file.write_text(f'cell,recording,robot,at\nline 1,{BAG},ur5,2026-03-02\n')
    Database(str(tmp_path / 'fleet.db')).close()
    return file, tmp_path / 'fleet.db'


def states(db):
    with sqlite3.connect(db) as connection:
        return [row[0] for row in connection.execute('select state from runs')]


def test_a_lock_that_passes_costs_a_fleet_nothing_and_one_that_stays_is_no_refusal(
    listed, monkeypatch
):
    file, db = listed
    monkeypatch.setattr('weld_twin_report.history.schema.BUSY', 0.1)
    words = ('history', 'run', file, '--db', db, '--workers', '1')
    real = Database.write

    def held(self, work, **how):
        """Lock the database while the recording is diagnosed, for as long as is asked."""
        if how.get('connecting'):
            return real(self, work, **how)
        with locked(db, hold):
            return real(self, work, **how)

    monkeypatch.setattr(Database, 'write', held)
    monkeypatch.setattr('weld_twin_report.history.database.PATIENCE', 0.3)
    hold = 1.0
    said = weld_twin(*words)
    assert (said.code, said.out) == (1, f'{file}: 1 failed\n')
    assert 'not written; run it again' in said.err and 'locked' in said.err
    assert states(db) == []
    monkeypatch.setattr('weld_twin_report.history.database.PATIENCE', 20.0)
    monkeypatch.setattr(logging.root, 'handlers', [])  # the command has none, pytest has some
    said = weld_twin(*words, '--again')
    assert (said.code, said.out) == (0, f'{file}: 1 done\n')
    assert said.err.count('waiting up to 20 s') == 1 and 'locked' in said.err
    assert states(db) == ['done']


def test_a_server_that_restarts_loses_nothing(postgresql):
    database = Database(postgresql)
    one, other = list(made(3, 2))
    assert database.add('line 3', one)
    place = place_of(postgresql)
    stop(place, 'fast')
    back = threading.Timer(1.0, start, (place,))
    back.start()
    try:
        hasty = replace(other, at=other.at + timedelta(days=1))
        with pytest.raises(Unavailable, match='cannot be used'):
            database.write(lambda c: database.put(c, 'line 3', hasty), patience=0.0)
        assert database.add('line 3', other)
    finally:
        back.join()
    assert len(database.entries('line 3')) == 2
    database.close()


def test_a_history_of_the_first_version_opens_and_its_lock_can_run_again(tmp_path):
    db = tmp_path / 'old.db'
    with sqlite3.connect(db) as connection:
        connection.executescript((Path(__file__).parent / 'version_1.sql').read_text())
    said = done('history', 'changed', '--cell', 'line 3', '--db', db, '--json')
    (change,) = json.loads(said)['changes']
    assert (change['coordinate'], change['date']) == ('joint_offset elbow_joint 0', '2026-03-30')
    with sqlite3.connect(db) as connection:
        rows = dict(connection.execute('select key, state from runs'))
        assert rows == {'k1': 'done', 'k2': 'failed', 'k3': 'refused'}
        assert connection.execute('select count(*) from verdicts').fetchone() == (9,)
        connection.execute('update about set version = 99')
    said = refused('history', 'show', '--db', db)
    assert 'version 99' in said and 'install a newer' in said


def test_reading_makes_nothing_and_another_application_is_left_alone(tmp_path):
    for job in (('history', 'show'), ('history', 'changed', '--cell', 'a')):
        assert 'there is no history' in refused(*job, '--db', tmp_path / 'none.db')
    assert list(tmp_path.iterdir()) == []
    db = tmp_path / 'shop.db'
    with sqlite3.connect(db) as connection:
        connection.execute('create table runs (id integer, distance real)')
        connection.execute('create table about (author text)')
    before = db.read_bytes()
    (tmp_path / 'list.csv').write_text(f'cell,recording,robot\na,{BAG},ur5\n')
    for job in (
        ('history', 'show'),
        ('history', 'run', tmp_path / 'list.csv'),
        ('history', 'page', '--out', tmp_path / 'pages'),
    ):
        assert 'belongs to another application' in refused(*job, '--db', db)
    assert db.read_bytes() == before and not (tmp_path / 'pages').exists()


def test_a_version_that_is_no_number_is_a_sentence_for_who_writes_too(elbow_found, tmp_path):
    add = ('history', 'add', elbow_found, '--cell', 'a', '--at', '2026-03-02')
    for k, version in enumerate(('first', b'1', 1.5)):
        db = tmp_path / f'{k}.db'
        with sqlite3.connect(db) as connection:
            for name in ('cells', 'verdicts', 'runs', 'findings', 'about'):
                connection.execute(f'create table {name} (version)')
            connection.execute('insert into about values (?)', (version,))
        before = db.read_bytes()
        for job in (add, ('history', 'show')):
            assert 'its version is' in refused(*job, '--db', db)
        assert db.read_bytes() == before


def test_a_cell_that_no_page_could_show_is_not_made(elbow_found, tmp_path):
    db = tmp_path / 'history.db'
    for name in ('', '  ', 'a\nb', 'x' * 201):
        words = ('--cell', name, '--at', '2026-03-02', '--db', db)
        assert 'is no name of a cell' in refused('history', 'add', elbow_found, *words)
    database = Database(str(db))
    assert not database.cells()
    database.close()


def test_a_damaged_row_ends_one_cell_and_not_the_page_of_all(tmp_path):
    db = tmp_path / 'fleet.db'
    database = Database(str(db))
    fill(database, 3, 4)
    database.close()
    with sqlite3.connect(db) as connection:
        connection.execute("update verdicts set covariance = x'00' where cell_id = 1 and id = 2")
        connection.execute("update verdicts set effects = '[{' where cell_id = 3")
    said = done('history', 'page', '--db', db, '--out', tmp_path / 'pages')
    index = (tmp_path / 'pages/index.html').read_text()
    assert 'line 002' in index and 'line 001' in index
    assert 'Cells that cannot be read' in index and 'line 003' in index
    pages = [file.read_text() for file in (tmp_path / 'pages').glob('cell_*.html')]
    assert len(pages) == 3
    assert sum('This cell cannot be read' in page for page in pages) == 2
    said = refused('history', 'show', '--cell', 'line 001', '--db', db)
    assert "of cell 'line 001'" in said and 'damaged' in said
    done('history', 'show', '--cell', 'line 002', '--db', db)


def test_a_history_that_may_only_be_read_is_read_and_says_so_to_who_writes(elbow_found, tmp_path):
    db = tmp_path / 'fleet.db'
    database = Database(str(db))
    fill(database, 2, 4)
    database.close()
    before = db.read_bytes()
    url = f'sqlite:///file:{db}?mode=ro&uri=true'
    done('history', 'page', '--db', url, '--out', tmp_path / 'pages')
    words = ('--cell', 'a', '--at', '2026-03-02', '--db', url)
    assert 'readonly' in refused('history', 'add', elbow_found, *words)
    assert db.read_bytes() == before


def test_who_writes_waits_for_a_lock_on_a_server_no_longer_than_his_patience(postgresql):
    database = Database(postgresql, patience=1.0)
    one, other = list(made(5, 2))
    assert database.add('line 5', one)
    cells = database.table('cells')
    with database._engine.begin() as held:
        held.execute(database.sql.text("SET lock_timeout = '200ms'"))
        held.execute(database.sql.select(cells).with_for_update())
        hasty = Database(f'{postgresql}&options=-c%20lock_timeout%3D200', patience=1.0)
        with pytest.raises(Unavailable, match='lock timeout'):
            hasty.add('line 5', other)
    assert hasty.add('line 5', other)
    for each in (hasty, database):
        each.close()


@pytest.mark.parametrize(
    ('spoil', 'said'),
    [
        (lambda row, k: row.__setitem__(k, -abs(row[k])), 'variances below zero'),
        (lambda row, k: row.__setitem__(0, 1e3), 'a variance below zero'),
        (lambda row, k: row.__setitem__(k, 1e999), 'not finite'),
    ],
)
def test_an_impossible_covariance_is_refused_at_the_door(elbow_found, tmp_path, spoil, said):
    out = tmp_path / 'spoilt'
    shutil.copytree(elbow_found, out)
    data = json.loads((out / 'diagnosis.json').read_text())
    named = [each['name'] for each in data['posterior']['coordinates']]
    place = named.index('backlash elbow_joint 0')
    spoil(data['posterior']['single_prior']['covariance'][place], place)
    (out / 'diagnosis.json').write_text(json.dumps(data))
    db = tmp_path / 'history.db'
    told = refused('history', 'add', out, '--cell', 'a', '--at', '2026-03-02', '--db', db)
    assert 'cannot be right' in told and said in told
    assert not db.exists()
    done('history', 'add', elbow_found, '--cell', 'a', '--at', '2026-03-02', '--db', db)


def test_what_is_written_waits_for_a_slow_writer_and_readers_for_nobody(tmp_path):
    """A reader sees the last state while somebody writes for seconds."""
    db = tmp_path / 'history.db'
    database = Database(str(db))
    fill(database, 1, 3)
    connection = sqlite3.connect(db, isolation_level=None)
    connection.execute('BEGIN IMMEDIATE')
    connection.execute("insert into cells (name, robot, kinematics) values ('b', 'c', 'd')")
    began = time.monotonic()
    assert np.size(database.entries('line 001')[0].value) > 0
    assert time.monotonic() - began < 2.0
    connection.execute('ROLLBACK')
    connection.close()
    database.close()
