# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Pages of a fleet, and what commands say of its cells, are as they were kept."""

from datetime import datetime, timedelta, timezone

import numpy as np
import pytest

from weld_twin_nodes.cli.in_process import weld_twin
from weld_twin_report.history import Database, Entry
from weld_twin_report.history.runs import Run, Runs, Verified, put_verified

pytest.importorskip('sqlalchemy', reason='the history is an extra')

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
