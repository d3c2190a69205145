# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""All splits one after the other, each kept as soon as it is done."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from weld_twin_core import __version__
from weld_twin_nodes.offline.output_directory import write_owned

from ..parts import Parts, Tell, refuse_foreign, write_results
from ..real_robots.data import tables
from .goals import Measure, measures
from .judging import judge
from .servo_axis import judge_axis
from .splits import Split, splits
from .tables import axis_table, goal_table, split_table

RESULTS, TABLE, PARTS = 'transfer.json', 'transfer.md', 'splits'
SCHEMA = 'weld_twin/transfer/1'
HOME = {'ur5': 0, 'ur10': 1}
"""Rows before this one are left out: the UR10's first is its home pose, far from the rest."""


def study(
    ur5: Path, ur10: Path, emps: Path, out: Path, only: str = '', tell: Tell = lambda text: None
) -> dict[str, Any]:
    """
    Judge every split that has not been judged yet, and write the results.

    Parameters
    ----------
    ur5, ur10, emps : Path
        Directories with the published data.
    out : Path
        Keeps a file per split; an interrupted run goes on from there.
    only : str
        Part of the names of the splits to run; all when empty.
    tell : callable
        Told what is being done.

    Raises
    ------
    DataError
        Data are missing, or ``out`` holds something else.

    """
    refuse_foreign(out, RESULTS, TABLE, PARTS)
    part = Parts(out / PARTS, tell)
    entries = []
    for split in _all(ur5, ur10):
        if only in split.name:
            entries.append(part(split.name, partial(judge, split)))
    if only in 'servo_axis':
        entries.append(part('servo_axis', partial(judge_axis, emps)))
    found = measures(entries)
    result = {
        'schema': SCHEMA,
        'version': __version__,
        'measures': [m._asdict() for m in found],
        'splits': entries,
    }
    write_owned(out / TABLE, page(entries, found))
    write_results(out / RESULTS, result)
    return result


def page(entries: Sequence[dict[str, Any]], found: Sequence[Measure]) -> str:
    """Return both tables, and that of the servo axis."""
    parts = [goal_table(found), split_table(entries)]
    parts += [axis_table(e) for e in entries if e['kind'] == 'servo_axis']
    return '\n'.join(parts)


def _all(ur5: Path, ur10: Path) -> Iterator[Split]:
    for robot, directory in (('ur5', ur5), ('ur10', ur10)):
        yield from splits(robot, tables(robot, directory)[0].recording, HOME[robot])
