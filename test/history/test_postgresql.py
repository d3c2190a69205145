# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The history on a real PostgreSQL server, beside the same on SQLite."""

import json
from dataclasses import replace
from datetime import datetime, timedelta, timezone

import numpy as np
import pytest
from command_line import done, refused
from own_postgres import NoServer, postgres

from weld_twin_core.errors import DataError
from weld_twin_report.history import Database, Entry

pytest.importorskip('sqlalchemy', reason='the history is an extra')
pytest.importorskip('psycopg', reason='PostgreSQL needs its driver')

NAMES = ('joint_offset elbow_joint 0', 'tool.x', 'backlash elbow_joint 0')
MONDAY = datetime(2026, 3, 2, 8, 30, 15, 123456, tzinfo=timezone.utc)
STEPPED = 6
"""Week in which the elbow's zero steps, by ten standard errors."""


@pytest.fixture(scope='module')
def server():
    try:
        with postgres() as url:
            yield url
    except NoServer as error:
        pytest.skip(str(error))


def entries():
    """Return ten weeks of an arm whose elbow steps, the odd values that a database may bend too."""
    rng = np.random.default_rng(3)
    sigma = np.array([1e-5, 2e-5, 3e-6])
    for week in range(10):
        value = rng.normal(size=3) * sigma + np.array([1e-4 * (week >= STEPPED), 0.0, 5e-4])
        yield Entry(
            MONDAY + timedelta(weeks=week),
            'ur5',
            'abc',
            f'{week:064d}',
            'identified',
            None if week == 2 else 0.1 + 0.2,
            5e-324 if week == 3 else 1.27e-4,
            None,
            1e-5,
            [{'effect': 'backlash', 'joint': "elbow's \u0416\U0001f600", 'std': {'width': 1e-9}}],
            NAMES,
            value,
            np.array([1e-3, 1e-3, 1e-3]),
            np.diag(sigma**2),
            np.eye(4),
        )


def told(url, cell):
    said = done('history', 'changed', '--cell', cell, '--db', url, '--json')
    return json.loads(said)


def filled(url, cell):
    database = Database(url)
    assert [database.add(cell, entry) for entry in entries()] == [True] * 10
    assert [database.add(cell, entry) for entry in entries()] == [False] * 10
    database.close()


def test_both_databases_give_back_what_was_written_and_tell_the_same(server, tmp_path):
    here = str(tmp_path / 'history.db')
    for url in (server, here):
        filled(url, 'line 3')
        database = Database(url)
        for back, entry in zip(database.entries('line 3'), entries(), strict=True):
            for name in ('value', 'prior_std', 'covariance', 'tool'):
                np.testing.assert_array_equal(getattr(back, name), getattr(entry, name))
            for name in ('at', 'recording', 'status', 'confidence', 'gap_m', 'effects', 'names'):
                assert getattr(back, name) == getattr(entry, name)
        database.close()
    assert told(server, 'line 3') == told(here, 'line 3')
    (change,) = told(server, 'line 3')['changes']
    assert (change['coordinate'], change['date']) == (NAMES[0], '2026-04-13')


def test_a_second_user_adds_to_what_the_first_has_made(server):
    first, second = Database(server), Database(server)
    one, other = list(entries())[:2]
    assert first.add('line 4', one) and second.add('line 4', other)
    assert not second.add('line 4', one)
    with pytest.raises(DataError, match='another recording of'):
        second.add('line 4', replace(one, recording='x'))
    assert len(first.entries('line 4')) == 2
    for each in (first, second):
        each.close()


def test_a_server_that_is_gone_is_told_in_a_sentence(tmp_path):
    url = f'postgresql+psycopg://weld:secret@/postgres?host={tmp_path}'
    said = refused('history', 'show', '--db', url)
    assert 'cannot be used' in said and 'No such file or directory' in said
    assert 'secret' not in said
