# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A fleet run that is killed goes on: nothing finished is lost, and nothing is written twice."""

from __future__ import annotations

from pathlib import Path

import pytest

from weld_twin_lab.fleet.fleet_runs import kills, rows, same, timed

pytest.importorskip('sqlalchemy', reason='the history is an extra')

BAG = Path(__file__).parents[2] / 'bags/elbow_play'


def test_a_killed_run_goes_on_and_ends_with_the_rows_of_one_that_was_not(tmp_path):
    listed = tmp_path / 'list.csv'
    lines = [f'cell {k},{BAG},ur5,2026-03-0{k + 1}' for k in range(3)]
    listed.write_text('cell,recording,robot,at\n' + '\n'.join(lines) + '\n')
    found = kills(listed, str(tmp_path / 'killed.db'), 1, seed=3)
    assert found['lost_or_rewritten'] == 0
    timed(listed, str(tmp_path / 'whole.db'), '--workers', '1')
    killed, whole = rows(str(tmp_path / 'killed.db')), rows(str(tmp_path / 'whole.db'))
    assert len(whole) == 3
    assert same(killed, whole) == 0
    assert {row[2] for row in whole.values()} == {'done'}
