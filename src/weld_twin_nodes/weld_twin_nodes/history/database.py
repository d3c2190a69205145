# SPDX-FileCopyrightText: weld_twin contributors
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
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from .entry import Entry

if TYPE_CHECKING:
    from sqlalchemy import Engine, MetaData, Row

VERSION = 1
"""Of the schema; a database of another one is refused."""
ARRAYS = ('value', 'prior_std', 'covariance', 'tool')


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
        self._sql = sqlalchemy
        self.url = url if '://' in url else f'sqlite:///{Path(url).absolute()}'
        with self._clear():
            self._engine: Engine = sqlalchemy.create_engine(self.url)
            self._tables = _schema()
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
        sql, cells, verdicts = self._sql, self._table('cells'), self._table('verdicts')
        with self._clear(), self._engine.begin() as connection:
            row = connection.execute(sql.select(cells).where(cells.c.name == cell)).first()
            if row is None:
                made = connection.execute(
                    cells.insert().values(
                        name=cell, robot=entry.robot, kinematics=entry.kinematics
                    )
                )
                assert made.inserted_primary_key is not None
                number = made.inserted_primary_key[0]
            else:
                number = row.id
                _same_robot(cell, row, entry)
            mine = verdicts.c.cell_id == number
            query = sql.select(verdicts.c.id).where(mine, verdicts.c.recording == entry.recording)
            if connection.execute(query).first() is not None:
                return False
            query = sql.select(verdicts.c.id).where(mine, verdicts.c.at == _stored(entry.at))
            if connection.execute(query).first() is not None:
                raise DataError(
                    f'cell {cell!r} has another recording of {entry.at.isoformat()}; give this one '
                    'its own date with --at'
                )
            connection.execute(verdicts.insert().values(cell_id=number, **_row(entry)))
        return True

    def cells(self) -> list[str]:
        """Return the names of all cells."""
        cells = self._table('cells')
        with self._clear(), self._engine.connect() as connection:
            query = self._sql.select(cells.c.name).order_by(cells.c.name)
            return [row.name for row in connection.execute(query)]

    def entries(self, cell: str) -> list[Entry]:
        """
        Return the diagnoses of a cell, in the order of time.

        Raises
        ------
        DataError
            There is no such cell.

        """
        cells, verdicts = self._table('cells'), self._table('verdicts')
        if cell not in (known := self.cells()):
            raise DataError(
                f'there is no cell {cell!r} in the history; it has {", ".join(known) or "none yet"}'
            )
        query = (
            self._sql.select(verdicts, cells.c.robot, cells.c.kinematics)
            .join(cells, cells.c.id == verdicts.c.cell_id)
            .where(cells.c.name == cell)
            .order_by(verdicts.c.at)
        )
        with self._clear(), self._engine.connect() as connection:
            return [_entry(row) for row in connection.execute(query)]

    def _table(self, name: str) -> Any:
        return self._tables.tables[name]

    def _check_version(self) -> None:
        about = self._table('about')
        with self._engine.begin() as connection:
            row = connection.execute(self._sql.select(about)).first()
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
        except (self._sql.exc.SQLAlchemyError, ModuleNotFoundError) as error:
            said = str(getattr(error, 'orig', None) or error).splitlines()[0]
            raise DataError(f"the history '{self.url}' cannot be used: {said}") from None


def _schema() -> MetaData:
    import sqlalchemy as sql

    tables = sql.MetaData()
    sql.Table('about', tables, sql.Column('version', sql.Integer, primary_key=True))
    sql.Table(
        'cells',
        tables,
        sql.Column('id', sql.Integer, primary_key=True),
        sql.Column('name', sql.String(200), unique=True, nullable=False),
        sql.Column('robot', sql.String(200), nullable=False),
        sql.Column('kinematics', sql.String(64), nullable=False),
    )
    sql.Table(
        'verdicts',
        tables,
        sql.Column('id', sql.Integer, primary_key=True),
        sql.Column('cell_id', sql.ForeignKey('cells.id'), nullable=False),
        sql.Column('at', sql.DateTime, nullable=False),
        sql.Column('recording', sql.Text, nullable=False),
        sql.Column('status', sql.String(40), nullable=False),
        *(
            sql.Column(name, sql.Float)
            for name in ('confidence', 'gap_m', 'floor_m', 'unexplained_m')
        ),
        sql.Column('effects', sql.JSON, nullable=False),
        sql.Column('names', sql.JSON, nullable=False),
        *(sql.Column(name, sql.LargeBinary, nullable=False) for name in ARRAYS),
        sql.UniqueConstraint('cell_id', 'at'),
        sql.Index('verdicts_of_a_cell', 'cell_id', 'at'),
    )
    return tables


def _same_robot(cell: str, row: Row[Any], entry: Entry) -> None:
    if row.kinematics != entry.kinematics:
        raise DataError(
            f'cell {cell!r} has the robot {row.robot!r}, and this diagnosis is of {entry.robot!r} with '
            'other kinematics; add it to a cell of its own'
        )


def _stored(at: datetime) -> datetime:
    return at.astimezone(timezone.utc).replace(tzinfo=None)


def _row(entry: Entry) -> dict[str, Any]:
    plain = ('recording', 'status', 'confidence', 'gap_m', 'floor_m', 'unexplained_m', 'effects')
    return {
        **{name: getattr(entry, name) for name in plain},
        **{name: _packed(getattr(entry, name)) for name in ARRAYS},
        'at': _stored(entry.at),
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
