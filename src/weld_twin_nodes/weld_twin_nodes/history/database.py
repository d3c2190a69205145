# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The history in a database: one schema on SQLite and PostgreSQL, through SQLAlchemy.

Arrays are kept as bytes of little-endian doubles, packed: a history of 10,000 diagnoses is some
100 MB. An entry is written in one transaction, whole or not at all, and once: the same recording of
the same cell is not added twice.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timezone
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from .entry import Entry
from .schema import ARRAYS, VERSION, schema, stored

if TYPE_CHECKING:
    from sqlalchemy import Connection, Engine, Row


class Database:
    """
    The history of many cells.

    Parameters
    ----------
    url : str
        Of SQLAlchemy (``postgresql+psycopg://...``), or the path of an SQLite file.

    Raises
    ------
    DataError
        SQLAlchemy is not installed, or the database cannot be opened or is no history.

    """

    def __init__(self, url: str) -> None:
        try:
            import sqlalchemy
        except ImportError:
            raise DataError(
                "a history needs SQLAlchemy; install it with: pip install 'weld-twin[history]'"
            ) from None
        self.sql = sqlalchemy
        self.url = url if '://' in url else f'sqlite:///{Path(url).absolute()}'
        with self._clear():
            address = sqlalchemy.make_url(self.url)
            self.url = address.render_as_string(hide_password=True)
            self._engine: Engine = sqlalchemy.create_engine(address)
            self._tables = schema()
            self._tables.create_all(self._engine)
            self._check_version()

    def close(self) -> None:
        """Let go of the connections."""
        self._engine.dispose()

    def add(self, cell: str, entry: Entry) -> bool:
        """
        Add a diagnosis to a cell; return whether it was new.

        Parameters
        ----------
        cell : str
            A new name makes a new cell.
        entry : Entry

        Raises
        ------
        DataError
            The cell has another robot, or a diagnosis of that instant already.

        """
        with self.transaction() as connection:
            return self.put(connection, cell, entry) is not None

    def put(self, connection: Connection, cell: str, entry: Entry) -> int | None:
        """
        Add a diagnosis within a transaction; return its number, None if it was there already.

        Raises
        ------
        DataError
            As of `add`; nothing was written then.

        """
        sql, verdicts = self.sql, self.table('verdicts')
        number = self._number(connection, cell, entry)
        mine = verdicts.c.cell_id == number
        query = sql.select(verdicts.c.id).where(mine, verdicts.c.recording == entry.recording)
        if number is not None and connection.execute(query).first() is not None:
            return None
        query = sql.select(verdicts.c.id).where(mine, verdicts.c.at == stored(entry.at))
        if number is not None and connection.execute(query).first() is not None:
            raise DataError(
                f'cell {cell!r} has another recording of {entry.at.isoformat()}; give this one '
                'its own date with --at'
            )
        if number is None:
            new = self.table('cells').insert()
            made = connection.execute(
                new.values(name=cell, robot=entry.robot, kinematics=entry.kinematics)
            )
            number = _key(made)
        made = connection.execute(verdicts.insert().values(cell_id=number, **_row(entry)))
        return _key(made)

    def _number(self, connection: Connection, cell: str, entry: Entry) -> int | None:
        """Return the number of a cell, None if there is none; refuse another robot."""
        cells = self.table('cells')
        row = connection.execute(self.sql.select(cells).where(cells.c.name == cell)).first()
        if row is None:
            return None
        _same_robot(cell, row, entry)
        return int(row.id)

    def cells(self) -> list[str]:
        """Return the names of all cells."""
        cells = self.table('cells')
        with self._clear(), self._engine.connect() as connection:
            query = self.sql.select(cells.c.name).order_by(cells.c.name)
            return [row.name for row in connection.execute(query)]

    def entries(self, cell: str, newest: int | None = None) -> list[Entry]:
        """
        Return the diagnoses of a cell, in the order of time.

        Parameters
        ----------
        cell : str
        newest : int, optional
            Only so many, the last ones.

        Raises
        ------
        DataError
            There is no such cell.

        """
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
        with self._clear(), self._engine.connect() as connection:
            return [_entry(row) for row in connection.execute(query)][::-1]

    def table(self, name: str) -> Any:
        """Return a table of the schema."""
        return self._tables.tables[name]

    @contextmanager
    def transaction(self) -> Iterator[Connection]:
        """Yield a connection; what is written through it is written whole or not at all."""
        with self._clear(), self._engine.begin() as connection:
            yield connection

    def _check_version(self) -> None:
        about = self.table('about')
        with self._engine.begin() as connection:
            row = connection.execute(self.sql.select(about)).first()
            if row is None:
                connection.execute(about.insert().values(version=VERSION))
            elif row.version != VERSION:
                raise DataError(
                    f"'{self.url}' is a history of version {row.version}, this program writes "
                    f'{VERSION}'
                )

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
            raise DataError(f"the history '{self.url}' cannot be used: {said}") from None


def _key(made: Any) -> int:
    assert made.inserted_primary_key is not None
    return int(made.inserted_primary_key[0])


def _same_robot(cell: str, row: Row[Any], entry: Entry) -> None:
    if row.kinematics != entry.kinematics:
        raise DataError(
            f'cell {cell!r} has the robot {row.robot!r}, and this diagnosis is of {entry.robot!r} with '
            'other kinematics; add it to a cell of its own'
        )


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
