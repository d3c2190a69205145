# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A fleet run that is killed goes on: nothing finished is lost, and nothing is written twice."""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('sqlalchemy', reason='the history is an extra')

from weld_twin_report.history import Database

BAG = Path(__file__).parents[2] / 'bags/elbow_play'
COMPARED = ('cell', 'recording', 'state', 'sentence')
LINES = 2
KILLED_BETWEEN = 0.3, 1.0
"""Shares of the time of a whole run; the first part is Python's start."""


def run(listed, database, patience=3600.0):
    """Run the list; return how long that took, None where it was killed after so long."""
    words = ['-m', 'weld_twin_nodes', 'history', 'run', str(listed), '--db', str(database)]
    began = time.perf_counter()
    try:
        subprocess.run(
            [sys.executable, *words, '--workers', '1'], capture_output=True, timeout=patience
        ).check_returncode()
    except subprocess.TimeoutExpired:
        return None
    return time.perf_counter() - began


def rows(file):
    """Return what a database holds of every run, and what tells a run that was written again."""
    database = Database(str(file))
    runs, verdicts = database.table('runs'), database.table('verdicts')
    query = database.sql.select(runs, verdicts).outerjoin(
        verdicts, verdicts.c.id == runs.c.verdict_id
    )
    with database.reading() as connection:
        found = connection.execute(query).all()
        diagnoses = len(connection.execute(database.sql.select(verdicts.c.id)).all())
    database.close()
    kept, written = {}, {}
    for row in found:
        told = dict(zip(runs.c.keys(), row, strict=False))
        verdict = dict(zip(verdicts.c.keys(), row[len(runs.c) :], strict=True))
        assert told['key'] not in kept
        written[told['key']] = told['id'], told['seconds'], verdict.pop('id')
        verdict.pop('cell_id')
        kept[told['key']] = [*(told[name] for name in COMPARED), *map(repr, verdict.values())]
    assert diagnoses == sum(row[2] == 'done' for row in kept.values())
    return kept, written


def test_a_killed_run_goes_on_and_ends_with_the_rows_of_one_that_was_not(tmp_path):
    listed, killed = tmp_path / 'list.csv', tmp_path / 'killed.db'
    lines = [f'line {k},{BAG},ur5,2026-03-0{k + 1}' for k in range(LINES)]
    listed.write_text('cell,recording,robot,at\n' + '\n'.join(lines) + '\n', encoding='utf-8')
    took = run(listed, tmp_path / 'whole.db')
    whole, _ = rows(tmp_path / 'whole.db')
    rng = np.random.default_rng(3)
    while run(listed, killed, took * rng.uniform(*KILLED_BETWEEN)) is not None:
        for file in tmp_path.glob('killed.db*'):
            file.unlink()
    left, before = rows(killed) if killed.exists() else ({}, {})
    assert all(whole[key] == row for key, row in left.items())
    run(listed, killed)
    final, after = rows(killed)
    assert final == whole and len(final) == LINES
    assert before.items() <= after.items()
    assert {row[2] for row in final.values()} == {'done'}
