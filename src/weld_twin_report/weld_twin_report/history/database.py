# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The history in a database: one schema on SQLite and PostgreSQL, through SQLAlchemy.

Arrays are kept as bytes of little-endian doubles, packed: a history of 10,000 diagnoses is some
100 MB. An entry is written in one transaction, and once.
"""

from __future__ import annotations

import logging
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from .entry import ARRAYS, Entry
from .schema import (
    VERSION,
    WRITES,
    Unavailable,
    alone,
    bring_up,
    engine_of,
    not_a_cell,
    passes,
    refuse_missing,
    schema,
    stored,
    unavailable,
    version_of,
    waits,
)

if TYPE_CHECKING:
    from sqlalchemy import Connection, Engine, Row

PATIENCE = 60.0
"""Seconds for which a write is tried again where others hold the database, or its server restarts."""
DAMAGED = (zlib.error, ValueError, TypeError, KeyError, AttributeError)
"""What reading a row raises that somebody or something has changed."""
T = TypeVar('T')
_LOGGER = logging.getLogger(__name__)
"""A program that sets up no handler, as the commands do not, has its warnings on stderr."""


class Refused(DataError):
    """A diagnosis does not fit what the history holds; trying again would not help."""


class Damaged(DataError):
    """A row of the history cannot be read."""


class Database:
    """
    The history of many cells.

    url: of SQLAlchemy (``postgresql+psycopg://...``), or the path of an SQLite file.
    make: whether an empty database, or a file that is not there, becomes a history.
    patience: seconds for which a write is tried again while the database cannot be used; a minute
    unless given.
    """

    def __init__(self, url: str, *, make: bool = True, patience: float | None = None) -> None:
        try:
            import sqlalchemy
        except ImportError:
            raise DataError(
                "a history needs SQLAlchemy; install it with: pip install 'weld-twin[history]'"
            ) from None
        self.sql, self._tables = sqlalchemy, schema()
        self._patience = PATIENCE if patience is None else patience
        self.url = url if '://' in url else f'sqlite:///{Path(url).absolute()}'
        with self._clear():
            address = sqlalchemy.make_url(self.url)
            self.url = address.render_as_string(hide_password=True)
            if not make:
                refuse_missing(address, self.url)
            self._engine: Engine = engine_of(address)
        if make or self._version() != VERSION:
            self.write(self._brought_up, connecting=True)

    def _version(self) -> int:
        with self.reading() as connection:
            return version_of(connection, self.url, make=False)

    def _brought_up(self, connection: Connection) -> None:
        if version_of(connection, self.url, make=True) == VERSION:
            return
        alone(connection)
        version = version_of(connection, self.url, make=True)  # somebody may have been quicker
        if version != VERSION:
            bring_up(connection, self._tables, version)

    def close(self) -> None:
        """Let go of the connections."""
        self._engine.dispose()

    def add(self, cell: str, entry: Entry) -> bool:
        """Add a diagnosis to a cell, perhaps a new one; return whether it was new."""
        return self.write(lambda connection: self.put(connection, cell, entry)) is not None

    def put(self, connection: Connection, cell: str, entry: Entry) -> int | None:
        """
        Add a diagnosis within a transaction; return its number, None if it was there already.

        Raises Refused, and has written nothing, where it is there with another date, or does not fit.
        """
        sql, verdicts = self.sql, self.table('verdicts')
        number = self._number(connection, cell, entry)
        mine = verdicts.c.cell_id == number
        query = sql.select(verdicts.c.at).where(mine, verdicts.c.recording == entry.recording)
        if there_already(connection.execute(query).first(), entry.at, cell):
            return None
        query = sql.select(verdicts.c.id).where(mine, verdicts.c.at == stored(entry.at))
        if connection.execute(query).first() is not None:
            raise Refused(
                f'cell {cell!r} has another recording of {entry.at.isoformat()}; give this one '
                'its own date with --at'
            )
        made = connection.execute(verdicts.insert().values(cell_id=number, **_row(entry)))
        return key_of(made)

    def _number(self, connection: Connection, cell: str, entry: Entry) -> int:
        """Return the number of a cell, held until the transaction ends; refuse another robot."""
        if why := not_a_cell(cell):
            raise Refused(why)
        cells = self.table('cells')
        new = {'name': cell, 'robot': entry.robot, 'kinematics': entry.kinematics}
        connection.execute(self.insert(cells).values(new).on_conflict_do_nothing())
        # Whoever writes to the same cell waits here, and then sees what was written.
        query = self.sql.select(cells).where(cells.c.name == cell).with_for_update()
        row = connection.execute(query).one()
        if row.kinematics != entry.kinematics:
            raise Refused(
                f'cell {cell!r} has the robot {row.robot!r}, and this diagnosis is of '
                f'{entry.robot!r} with other kinematics; add it to a cell of its own'
            )
        return int(row.id)

    def insert(self, table: Any) -> Any:
        """Return an insertion that can say what happens where the row is there already."""
        from sqlalchemy.dialects import postgresql, sqlite

        lite = self._engine.dialect.name == 'sqlite'
        return sqlite.insert(table) if lite else postgresql.insert(table)

    def cells(self) -> list[str]:
        cells = self.table('cells')
        with self.reading() as connection:
            query = self.sql.select(cells.c.name).order_by(cells.c.name)
            return [row.name for row in connection.execute(query)]

    def entries(self, cell: str, newest: int | None = None) -> list[Entry]:
        """Return the diagnoses of a cell, in the order of time; raise Damaged where one is."""
        cells, verdicts = self.table('cells'), self.table('verdicts')
        if cell not in (known := self.cells()):
            raise DataError(
                f'there is no cell {cell!r} in the history; it has {", ".join(known) or "none yet"}'
            )
        query = (
            self.sql.select(verdicts, cells.c.robot, cells.c.kinematics)
            .join(cells, cells.c.id == verdicts.c.cell_id)
            .where(cells.c.name == cell)
            .order_by(verdicts.c.at.desc())
            .limit(newest)
        )
        with self.reading(f'a diagnosis of cell {cell!r}') as connection:
            return [_entry(row) for row in connection.execute(query)][::-1]

    def table(self, name: str) -> Any:
        return self._tables.tables[name]

    def write(
        self,
        work: Callable[[Connection], T],  # takes the connection
        *,
        connecting: bool = False,  # whether to report at once a server that is not there
        patience: float | None = None,  # seconds; that of the database unless given
    ) -> T:
        """
        Do some work in one transaction, and return what it returns.

        It is done again while others hold the database, or its server is being restarted; so it
        must change nothing but the database; that it waits is said once. Raises Unavailable when
        patience [s] is over.
        """
        patience = self._patience if patience is None else patience
        remaining, waiting = waits(patience), False
        while True:
            try:
                with self._engine.connect() as plain:
                    connection = plain.execution_options(**{WRITES: True})
                    with connection.begin():
                        return work(connection)
            except self.sql.exc.SQLAlchemyError as error:
                wait = next(remaining, None) if passes(error, connecting=connecting) else None
                if wait is None:
                    with self._clear():
                        raise
                reason = str(getattr(error, 'orig', error)).strip()
            if not waiting:
                _LOGGER.warning(
                    "waiting up to %.0f s for the history '%s', which cannot be written now: %s",
                    patience,
                    self.url,
                    reason,
                )
            waiting = True
            time.sleep(wait)

    @contextmanager
    def reading(self, what: str = 'a row') -> Iterator[Connection]:
        """Yield a connection to read from; ``what`` is named where it is damaged."""
        with self._clear():
            try:
                with self._engine.connect() as connection:
                    yield connection
            except DAMAGED as error:
                raise Damaged(
                    f"{what} in the history '{self.url}' is damaged ({error}); restore it from a "
                    'copy, or delete that row'
                ) from None

    @contextmanager
    def _clear(self) -> Iterator[None]:
        """Turn errors of the database into one sentence."""
        try:
            yield
        except ModuleNotFoundError as error:
            raise DataError(
                f"the history '{self.url}' needs {error.name}; for PostgreSQL install it with: "
                "pip install 'weld-twin[postgresql]'"
            ) from None
        except self.sql.exc.SQLAlchemyError as error:
            said = str(getattr(error, 'orig', None) or error).splitlines()[0]
            kind = Unavailable if unavailable(error) else DataError
            raise kind(f"the history '{self.url}' cannot be used: {said}") from None


def key_of(made: Any) -> int:
    """Return the number of a row that was inserted."""
    assert made.inserted_primary_key is not None
    return int(made.inserted_primary_key[0])


def there_already(row: Any, at: datetime, cell: str) -> bool:
    """Tell whether a recording is in a cell, by its row; raise Refused where that has another date."""
    if row is not None and row.at != stored(at):
        raise Refused(
            f'cell {cell!r} has this recording already, of {row.at.isoformat()}, and keeps that date; '
            'where it is wrong, begin a history anew (--db) with the right dates'
        )
    return row is not None


def _row(entry: Entry) -> dict[str, Any]:
    plain = ('recording', 'status', 'confidence', 'gap_m', 'floor_m', 'unexplained_m', 'effects')
    return {
        **{name: getattr(entry, name) for name in plain},
        **{name: _packed(getattr(entry, name)) for name in ARRAYS},
        'at': stored(entry.at),
        'names': list(entry.names),
    }


def _packed(array: Array) -> bytes:
    return zlib.compress(np.ascontiguousarray(array, '<f8').tobytes())


def _unpacked(data: bytes, shape: tuple[int, ...]) -> Array:
    return np.frombuffer(zlib.decompress(data), '<f8').reshape(shape).astype(float)


def _entry(row: Row[Any]) -> Entry:
    count = len(row.names)
    shapes = {'value': (count,), 'prior_std': (count,), 'covariance': (count,) * 2, 'tool': (4, 4)}
    return Entry(
        row.at.replace(tzinfo=timezone.utc),
        row.robot,
        row.kinematics,
        row.recording,
        row.status,
        row.confidence,
        row.gap_m,
        row.floor_m,
        row.unexplained_m,
        row.effects,
        tuple(row.names),
        **{name: _unpacked(getattr(row, name), shapes[name]) for name in ARRAYS},
    )
