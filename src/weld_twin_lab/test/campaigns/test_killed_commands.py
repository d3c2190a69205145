# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Commands that are killed: the kill hits, and what is lost or half is seen."""

from __future__ import annotations

import numpy as np
import pytest

from weld_twin_lab.campaigns.killing import commands
from weld_twin_lab.campaigns.killing.commands import Kill, drawn, run_killed

OLD = {'a.json': b'old', 'b.html': b'old', 'gone.txt': b'old'}
NEW = {'a.json': b'new', 'b.html': b'new'}


def test_a_kill_at_a_change_comes_before_the_file_is_there(tmp_path):
    assert run_killed(
        ('export', 'schema', 'robot', '--out', tmp_path / 'robot.json'), Kill(change=1)
    )
    assert not (tmp_path / 'robot.json').exists()


@pytest.mark.parametrize(
    ('left', 'there', 'half'),
    [
        (OLD, True, False),
        (NEW, True, False),
        ({**OLD, 'a.json': b'new'}, True, False),
        ({**OLD, 'a.json': b'ne'}, True, True),
        ({'a.json': b'new', 'gone.txt': b'old'}, True, True),
        ({**NEW, 'stray.txt': b'new'}, True, True),
        ({}, False, False),
        (NEW, False, False),
        ({'a.json': b'new'}, False, True),
    ],
)
def test_a_half_is_told_from_the_older_and_the_newer_result(left, there, half):
    assert bool(commands._half(left, OLD, NEW, there)) == half
    assert commands._is_one(left, OLD, NEW) == (left in (OLD, NEW))


def test_a_persons_file_that_is_gone_or_changed_is_lost():
    assert not commands._lost({**NEW, **commands.PERSON}, commands.PERSON)
    assert 'notes.txt' in commands._lost({**commands.PERSON, 'notes.txt': b''}, commands.PERSON)
    assert 'photos/cell.jpg' in commands._lost(NEW, commands.PERSON)


def test_kills_are_drawn_over_the_time_and_over_the_changes():
    rng = np.random.default_rng(1)
    kills = [drawn(rng, 2.0, 30) for _ in range(400)]
    moments = np.array([kill.seconds for kill in kills if not kill.change])
    changes = np.array([kill.change for kill in kills if kill.change])
    assert 150 < moments.size < 250
    assert moments.min() < 0.6 and moments.max() > 1.9
    assert set(changes) == set(range(1, 31))
