# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is kept beside the diagnoses: how recordings went, what changed, what was measured afterwards."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from weld_twin_core.errors import DataError

from .database import Damaged, Database, Refused, key_of, there_already
from .entry import Entry, date_of_stamp
from .schema import Unavailable, stored
from .words import as_dict, changed, observations

if TYPE_CHECKING:
    from sqlalchemy import Connection


DONE, UNSOUND, REFUSED, FAILED = 'done', 'unsound', 'refused', 'failed'
"""States of a recording: diagnosed; data or set-up wrong; not readable; ended by a limit or a crash."""
NEWEST = 260
"""Diagnoses of a cell that are looked at together, the newest: five years of weeks."""


@dataclass(frozen=True)
class Run:
    """How one recording went."""

    key: str
    """Of what was asked: recording, robot, options and program. The same is not asked twice."""
    cell: str
    recording: str
    state: str  # 'done', 'unsound', 'refused' or 'failed'
    sentence: str  # what was reported last: the verdict's status, or why there is none
    seconds: float
    memory: int  # bytes it needed at most


class Runs:
    """What a database keeps of runs and of changes."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def write(self, run: Run, entry: Entry | None, patience: float | None = None) -> Run | None:
        """
        Write how a recording went, and its diagnosis, in one transaction; return what was written.

        It was refused where the diagnosis does not fit its cell, and failed where the database does not
        take it. None where it was there: what was written before stays. Raises Unavailable: nothing was
        written, and may be tried again.
        """
        try:
            return run if self._write(run, entry, patience) else None
        except Unavailable:
            raise
        except DataError as error:
            if entry is None:
                raise
            state = REFUSED if isinstance(error, Refused) else FAILED
            failed = replace(run, state=state, sentence=str(error))
            return failed if self._write(failed, None, patience) else None

    def _write(self, run: Run, entry: Entry | None, patience: float | None) -> bool:
        sql, runs = self._database.sql, self._database.table('runs')

        def work(connection: Connection) -> bool:
            known = sql.select(runs.c.state).where(runs.c.key == run.key)
            before = connection.execute(known).first()
            if before is not None and before.state != FAILED:
                return False
            number = None
            if entry is not None:
                number = self._database.put(connection, run.cell, entry)
            values = {**asdict(run), 'verdict_id': number}
            # Another program may have written it since; only a failure is written over.
            new = self._database.insert(runs).values(values)
            new = new.on_conflict_do_update(
                index_elements=[runs.c.key], set_=values, where=runs.c.state == FAILED
            )
            return bool(connection.execute(new).rowcount == 1)

        return self._database.write(work, patience=patience)

    def finished(self, again: bool = False) -> set[str]:
        """Return the keys of what need not run any more; with ``again``, failures run again."""
        sql, runs = self._database.sql, self._database.table('runs')
        query = sql.select(runs.c.key)
        if again:
            query = query.where(runs.c.state != FAILED)
        with self._database.reading() as connection:
            return {row.key for row in connection.execute(query)}

    def troubles(self, cell: str | None = None) -> list[Run]:
        """Return the runs without a verdict, of one cell or of all, the newest first."""
        sql, runs = self._database.sql, self._database.table('runs')
        query = sql.select(runs).where(runs.c.state != DONE).order_by(runs.c.id.desc())
        if cell is not None:
            query = query.where(runs.c.cell == cell)
        names = Run.__dataclass_fields__
        with self._database.reading() as connection:
            rows = connection.execute(query).mappings()
            return [Run(**{name: row[name] for name in names}) for row in rows]

    def newest(self) -> list[dict[str, Any]]:
        """
        Return of every cell its newest diagnosis, how many it has, and what changed on it.

        Of a cell whose rows are damaged, ``name`` and ``damaged``, a sentence, are all there is.
        """
        try:
            return self._newest()
        except Damaged:
            pass
        rows: list[dict[str, Any]] = []
        for cell in self._database.cells():
            try:
                rows += self._newest(cell)
            except Damaged as error:
                rows.append({'name': cell, 'damaged': str(error)})
        return rows

    def _newest(self, cell: str | None = None) -> list[dict[str, Any]]:
        """Return the newest diagnosis of one cell, or of every cell."""
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
        if cell is not None:
            query = query.where(cells.c.name == cell)
        what = 'a row' if cell is None else f'the newest diagnosis of cell {cell!r}'
        with self._database.reading(what) as connection:
            return [dict(row) for row in connection.execute(query).mappings()]

    def look(self, cell: str, entries: Sequence[Entry] | None = None) -> list[dict[str, Any]]:
        """Return what changed on a cell; worked out once for the diagnoses it has."""
        sql, findings = self._database.sql, self._database.table('findings')
        number, newest, count = self._state(cell)
        with self._database.reading(f'what changed on cell {cell!r}') as connection:
            query = sql.select(findings).where(findings.c.cell_id == number)
            row = connection.execute(query).first()
        if row is not None and (row.newest, row.diagnoses) == (newest, count):
            return list(row.changes)
        entries = self._database.entries(cell, NEWEST) if entries is None else entries
        seen = observations(entries)
        changes = [as_dict(change) for change in changed(entries, seen)]
        new_row = {'cell_id': number, 'newest': newest, 'diagnoses': count, 'changes': changes}
        new = self._database.insert(findings).values(new_row)
        new = new.on_conflict_do_update(index_elements=[findings.c.cell_id], set_=new_row)
        # Who may only read works it out anew.
        with suppress(Unavailable):
            self._database.write(lambda connection: connection.execute(new), patience=0.0)
        return changes

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
        with self._database.reading() as connection:
            row = connection.execute(query).first()
        if row is None:
            raise DataError(f'there is no cell {cell!r} in the history')
        return int(row[0]), int(row[1]), int(row[2])


FILE = 'verification.json'
"""What `weld-twin verify` leaves in its folder."""


class Verified(NamedTuple):
    """One verification."""

    at: datetime  # when the cell was measured again, UTC
    recording: str  # SHA-256 of what was measured
    content: Mapping[str, Any]  # that of verification.json

    @property
    def status(self) -> str:
        """Return whether the promise was kept, in words."""
        return 'promise kept' if self.content['kept'] else 'promise not kept'


def verified_of(path: Path | str, at: datetime | None = None) -> Verified | None:
    """Return the verification that a file or a folder holds; None where it holds none."""
    file = Path(path)
    file = file / FILE if file.is_dir() else file
    if file.name != FILE or not file.is_file():
        return None
    try:
        content = json.loads(file.read_text(encoding='utf-8'))
        own = [item['sha256'] for item in content['inputs'] if item['use'] == 'recording']
        return Verified(at or date_of_stamp(int(content['epoch_ns']), file), own[0], content)
    except (OSError, ValueError, KeyError, TypeError, IndexError, RecursionError):
        raise DataError(
            f"'{file}' is no verification; make it anew with weld-twin verify"
        ) from None


def put_verified(
    database: Database, connection: Connection, cell: str, result: Verified
) -> int | None:
    """Add a verification within a transaction; return its number, None if it was there already."""
    sql, cells, rows = database.sql, database.table('cells'), database.table('verifications')
    # Whoever writes to the same cell waits here, and then sees what was written.
    query = sql.select(cells).where(cells.c.name == cell).with_for_update()
    own = connection.execute(query).first()
    if own is None:
        raise DataError(
            f'there is no cell {cell!r} yet; add the diagnosis that was verified first'
        )
    if own.kinematics != result.content.get('kinematics'):
        raise DataError(f'cell {cell!r} has the robot {own.robot!r}, and this is of another')
    query = sql.select(rows.c.at).where(
        rows.c.cell_id == own.id, rows.c.recording == result.recording
    )
    if there_already(connection.execute(query).first(), result.at, cell):
        return None
    values = {**result._asdict(), 'at': stored(result.at), 'content': dict(result.content)}
    return key_of(connection.execute(rows.insert().values(cell_id=own.id, **values)))


def verifications(database: Database, cell: str) -> list[Verified]:
    """Return the verifications of a cell, in the order of time."""
    sql, cells, rows = database.sql, database.table('cells'), database.table('verifications')
    query = (
        sql.select(rows)
        .join(cells, cells.c.id == rows.c.cell_id)
        .where(cells.c.name == cell)
        .order_by(rows.c.at)
    )
    with database.reading('a verification') as connection:
        return [
            Verified(row.at.replace(tzinfo=timezone.utc), row.recording, row.content)
            for row in connection.execute(query)
        ]
