# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A fleet run that is killed goes on: nothing finished is lost, and nothing is written twice."""

from __future__ import annotations

from pathlib import Path

import pytest

from weld_twin_lab.fleet.fleet_runs import kills, rows

pytest.importorskip('sqlalchemy', reason='the history is an extra')

BAG = Path(__file__).parents[2] / 'bags/elbow_play'


def test_a_killed_run_goes_on_and_ends_with_the_rows_of_one_that_was_not(tmp_path):
    listed = tmp_path / 'list.csv'
    lines = [f'cell {k},{BAG},ur5,2026-03-0{k + 1}' for k in range(3)]
    listed.write_text('cell,recording,robot,at\n' + '\n'.join(lines) + '\n')
    found = kills(listed, tmp_path, 1, seed=3)
    assert found['kills'] == 1
    assert found['lost_or_rewritten'] == found['differing_rows'] == 0
    whole, killed = (rows(str(tmp_path / f'{name}.db')) for name in ('whole', 'killed'))
    assert len(whole) == len(killed) == 3
    assert {row[2] for row in killed.values()} == {'done'}
