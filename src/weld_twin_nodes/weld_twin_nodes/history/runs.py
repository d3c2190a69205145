# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How each recording of a fleet went, and what changed on each cell, beside the diagnoses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from weld_twin_core.errors import DataError

from .changed_words import as_dict
from .database import Database
from .entry import Entry
from .tracking import changed, observations

DONE, UNSOUND, REFUSED, FAILED = 'done', 'unsound', 'refused', 'failed'
"""States of a recording: diagnosed; data or set-up wrong; not readable; ended by a limit or a crash."""
NEWEST = 260
"""Diagnoses of a cell that are looked at together, the newest: five years of weeks."""


@dataclass(frozen=True)
class Run:
    """
    How one recording went.

    Attributes
    ----------
    key : str
        Of what was asked: recording, robot, options and program. The same is not asked twice.
    cell, recording : str
    state : str
        'done', 'unsound', 'refused' or 'failed'.
    sentence : str
        What was told last: the verdict's status, or why there is none.
    seconds : float
    memory : int
        Bytes it needed at most.

    """

    key: str
    cell: str
    recording: str
    state: str
    sentence: str
    seconds: float
    memory: int


class Runs:
    """What a database keeps of runs and of changes."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def write(self, run: Run, entry: Entry | None) -> bool:
        """
        Write how a recording went, and its diagnosis, in one transaction.

        Returns
        -------
        bool
            Whether it was new; what was written before stays as it is.

        """
        try:
            return self._write(run, entry)
        except DataError as error:
            if entry is None:
                raise
            refused = Run(**{**asdict(run), 'state': REFUSED, 'sentence': str(error)})
            return self._write(refused, None)

    def _write(self, run: Run, entry: Entry | None) -> bool:
        sql, runs = self._database.sql, self._database.table('runs')
        with self._database.transaction() as connection:
            known = sql.select(runs.c.id, runs.c.state).where(runs.c.key == run.key)
            before = connection.execute(known).first()
            if before is not None and before.state != FAILED:
                return False
            number = None
            if entry is not None:
                number = self._database.put(connection, run.cell, entry)
            if before is not None:
                connection.execute(runs.delete().where(runs.c.id == before.id))
            connection.execute(runs.insert().values(**asdict(run), verdict_id=number))
        return True

    def finished(self, again: bool = False) -> set[str]:
        """Return the keys of what need not run any more; with ``again``, failures run again."""
        sql, runs = self._database.sql, self._database.table('runs')
        query = sql.select(runs.c.key)
        if again:
            query = query.where(runs.c.state != FAILED)
        with self._database.transaction() as connection:
            return {row.key for row in connection.execute(query)}

    def troubles(self, cell: str | None = None) -> list[Run]:
        """Return the runs without a verdict, of one cell or of all, the newest first."""
        sql, runs = self._database.sql, self._database.table('runs')
        query = sql.select(runs).where(runs.c.state != DONE).order_by(runs.c.id.desc())
        if cell is not None:
            query = query.where(runs.c.cell == cell)
        names = Run.__dataclass_fields__
        with self._database.transaction() as connection:
            rows = connection.execute(query).mappings()
            return [Run(**{name: row[name] for name in names}) for row in rows]

    def newest(self) -> list[dict[str, Any]]:
        """Return of every cell its newest diagnosis, how many it has, and what changed on it."""
        sql = self._database.sql
        cells, verdicts = self._database.table('cells'), self._database.table('verdicts')
        findings = self._database.table('findings')
        last = (
            sql.select(
                verdicts.c.cell_id,
                sql.func.max(verdicts.c.at).label('at'),
                sql.func.count().label('diagnoses'),
            )
            .group_by(verdicts.c.cell_id)
            .subquery()
        )
        wanted = ('status', 'confidence', 'gap_m', 'floor_m', 'unexplained_m', 'effects', 'at')
        query = (
            sql.select(
                cells.c.name,
                cells.c.robot,
                last.c.diagnoses,
                findings.c.changes,
                *(verdicts.c[name] for name in wanted),
            )
            .join(last, last.c.cell_id == cells.c.id)
            .join(
                verdicts,
                sql.and_(verdicts.c.cell_id == cells.c.id, verdicts.c.at == last.c.at),
            )
            .outerjoin(findings, findings.c.cell_id == cells.c.id)
        )
        with self._database.transaction() as connection:
            return [dict(row) for row in connection.execute(query).mappings()]

    def look(self, cell: str, entries: Sequence[Entry] | None = None) -> list[dict[str, Any]]:
        """
        Return what changed on a cell; worked out once for the diagnoses it has.

        Parameters
        ----------
        cell : str
        entries : sequence of Entry, optional
            Its newest diagnoses, where they are there already.

        """
        sql, findings = self._database.sql, self._database.table('findings')
        number, newest, count = self._state(cell)
        with self._database.transaction() as connection:
            query = sql.select(findings).where(findings.c.cell_id == number)
            row = connection.execute(query).first()
        if row is not None and (row.newest, row.diagnoses) == (newest, count):
            return list(row.changes)
        entries = self._database.entries(cell, NEWEST) if entries is None else entries
        seen = observations(entries)
        told = [as_dict(change) for change in changed(entries, seen)]
        with self._database.transaction() as connection:
            connection.execute(findings.delete().where(findings.c.cell_id == number))
            connection.execute(
                findings.insert().values(
                    cell_id=number, newest=newest, diagnoses=count, changes=told
                )
            )
        return told

    def _state(self, cell: str) -> tuple[int, int, int]:
        """Return the number of a cell, that of its last diagnosis, and how many it has."""
        sql = self._database.sql
        cells, verdicts = self._database.table('cells'), self._database.table('verdicts')
        query = (
            sql.select(cells.c.id, sql.func.max(verdicts.c.id), sql.func.count())
            .join(verdicts, verdicts.c.cell_id == cells.c.id)
            .where(cells.c.name == cell)
            .group_by(cells.c.id)
        )
        with self._database.transaction() as connection:
            row = connection.execute(query).first()
        if row is None:
            raise DataError(f'there is no cell {cell!r} in the history')
        return int(row[0]), int(row[1]), int(row[2])
