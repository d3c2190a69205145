# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is killed besides the recorder; each case is a row of the table."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

import numpy as np

from weld_twin_core.errors import DataError
from weld_twin_nodes.cli.in_process import weld_twin

from .commands import KillRow, Words, file_case, folder_case
from .services import fleet_case, server_case

Once = Callable[[np.random.Generator], KillRow]
"""Kills once, at a moment drawn, and says what came of it."""

VERDICT, OF = 'name, at, status, gap_m, effects', 'WHERE cells.id = cell_id'
"""What of a diagnosis is compared: not its number, which may differ after a kill."""


class KillCase(NamedTuple):
    """
    Something that is killed.

    Attributes
    ----------
    name : str
    begin : callable
        Takes an empty folder to work in, and returns what kills once.

    """

    name: str
    begin: Callable[[Path], Once]


ROBOT = 'kuka_kr6_r900'
EFFECT = '- {{effect: backlash, joint: joint_a3, width: {width}}}\n'
PROGRAM = (
    'DEF bracket()\nPTP {{A1 0,A2 -90,A3 90,A4 0,A5 10,A6 0}}\n'
    'PTP {{A1 {turn},A2 -80,A3 80,A4 0,A5 15,A6 0}}\nEND\n'
)


def done(*words: object) -> None:
    """
    Run a command that has to succeed.

    Raises
    ------
    DataError
        It did not.

    """
    said = weld_twin(*words)
    if said.code:
        raise DataError(f'weld-twin {words[0]} ended with {said.code}: {said.err.strip()}')


def _bag(place: Path, width: float) -> Path:
    """Return a short recording of an arm with play."""
    effects, bag = place / f'{width:g}.yaml', place / f'bag_{width:g}'
    effects.write_text(EFFECT.format(width=width), encoding='utf-8')
    done('simulate', '--robot', ROBOT, '--effects', effects, '--path', 'spline',
         '--profile', 'aggressive', '--rate', 30, '--out', bag)  # fmt: skip
    return bag


def _diagnose(place: Path) -> Once:
    bags = [_bag(place, width) for width in (4e-4, 9e-4)]

    def words(k: int, out: Path) -> Words:
        return ('diagnose', bags[k], '--robot', ROBOT, '--out', out)

    return folder_case('diagnose', place, words)


def _plan(place: Path) -> Once:
    def words(k: int, out: Path) -> Words:
        return ('investigate', '--robot', ROBOT, '--tolerance', 0.3, '--minutes', 9,
                '--controller', ('krl', 'csv')[k], '--out', out)  # fmt: skip

    return folder_case('plan-measurement', place, words)


def _correct(place: Path) -> Once:
    model = place / 'model.yaml'
    model.write_text(EFFECT.format(width=4e-4), encoding='utf-8')
    programs = [place / f'{k}/bracket.src' for k in range(2)]
    for k, program in enumerate(programs):
        program.parent.mkdir()
        program.write_text(PROGRAM.format(turn=10 + k), encoding='utf-8')

    def words(k: int, out: Path) -> Words:
        return ('correct', programs[k], '--robot', ROBOT,
                '--model', model, '--out', out)  # fmt: skip

    return folder_case('correct-program', place, words)


def _histories(place: Path) -> tuple[list[Path], list[Path]]:
    """Return two diagnoses, and a database that holds the first, one that holds both."""
    found = []
    for k, width in enumerate((4e-4, 9e-4)):
        found.append(place / f'found_{k}')
        done('diagnose', _bag(place, width), '--robot', ROBOT, '--out', found[-1])
    databases = [place / f'{k}.db' for k in range(2)]
    for k, database in enumerate(databases):
        for j, each in enumerate(found[: k + 1]):
            done('history', 'add', each, '--cell', f'line {j}', '--at', f'2026-03-0{j + 1}',
                 '--db', database)  # fmt: skip
    return found, databases


def _page(place: Path) -> Once:
    _, databases = _histories(place)

    def words(k: int, out: Path) -> Words:
        return ('history', 'page', '--db', databases[k], '--out', out)

    return folder_case('fleet page', place, words)


def _history(place: Path) -> Once:
    found, databases = _histories(place)

    def words(file: Path) -> Words:
        return ('history', 'add', found[1], '--cell', 'line 1', '--at', '2026-03-02', '--db', file)

    return file_case('history add', place, databases[0], words, _dump)


def _dump(file: Path) -> str:
    """Return what a database tells of cells and diagnoses; where it is damaged, that."""
    with closing(sqlite3.connect(file)) as connection:
        told = connection.execute('PRAGMA integrity_check').fetchall()
        for query in ('name, robot FROM cells', f'{VERDICT} FROM cells, verdicts {OF}'):
            told += sorted(connection.execute(f'SELECT {query}'))
    return '\n'.join(map(str, told))


def _fleet(place: Path) -> Once:
    return fleet_case(place, _bag(place, 4e-4), ROBOT)


def _serve(place: Path) -> Once:
    return server_case(place, _bag(place, 4e-4), ROBOT)


CASES = (
    KillCase('diagnose', _diagnose),
    KillCase('plan-measurement', _plan),
    KillCase('correct-program', _correct),
    KillCase('fleet page', _page),
    KillCase('history add', _history),
    KillCase('fleet run', _fleet),
    KillCase('serve', _serve),
)
"""In the order of the table."""
