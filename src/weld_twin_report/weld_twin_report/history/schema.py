# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The tables of the history, alike on SQLite and PostgreSQL, and a database opened as one.

It is recognised, made where it is empty, and brought to this version. A change of the schema is a
function here that makes version k + 2 of version k + 1, in its place in `STEPS`, with plain SQL that
both take. A kit for migrations is left out on purpose: users open a history by their first command,
and there is nobody who runs an upgrade.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING, Any

from weld_twin_core.errors import DataError

from .entry import ARRAYS

if TYPE_CHECKING:
    from sqlalchemy import Connection, Engine, MetaData


BUSY = 5.0
"""Seconds in which SQLite waits for another program that writes; then it is asked once more."""
CONNECT = 10
"""Seconds in which a server must answer."""
LOCKED = 10
"""Seconds after which PostgreSQL says that somebody holds a lock; then it is asked once more."""
LOCK = 7_246_198_015
"""Number of the lock on PostgreSQL under which tables are made and changed; any other would do."""
FIRST = ('about', 'cells', 'verdicts', 'runs', 'findings')
"""Tables of the first version; a history of any version has them."""
WRITES = 'weld_twin_writes'
"""Option of a connection that takes SQLite's lock at its beginning, not in its middle."""


def engine_of(address: Any) -> Engine:
    """Return the engine of an address; on SQLite, a transaction holds from its first word on."""
    import sqlalchemy

    lite = address.get_backend_name() == 'sqlite'
    patience: dict[str, Any] = {'timeout': BUSY} if lite else {}
    if address.drivername.startswith('postgresql+psycopg'):
        # Neither a server that does not answer nor somebody's forgotten lock is waited for in vain.
        patience = {'connect_timeout': CONNECT, 'options': f'-c lock_timeout={LOCKED}s'}
        patience = {key: value for key, value in patience.items() if key not in address.query}
    made = sqlalchemy.create_engine(address, connect_args=patience, pool_pre_ping=not lite)
    if lite:
        # Python's driver begins late and ends at a CREATE; both would let others in between.
        @sqlalchemy.event.listens_for(made, 'connect')
        def _plain(connection: Any, _: Any) -> None:
            connection.isolation_level = None

        @sqlalchemy.event.listens_for(made, 'begin')
        def _begin(connection: Connection) -> None:
            writes = connection.get_execution_options().get(WRITES)
            connection.exec_driver_sql('BEGIN IMMEDIATE' if writes else 'BEGIN')

    return made


def refuse_missing(address: Any, shown: str) -> None:
    """Refuse to read an SQLite file that is not there, which opening would make."""
    name = address.database or ''
    plain = address.get_backend_name() == 'sqlite' and not name.startswith('file:')
    if plain and not Path(name).exists():
        raise DataError(_nothing_yet(shown))


def version_of(connection: Connection, shown: str, *, make: bool) -> int:
    """Return the version of a history; 0 where an empty database may become one."""
    import sqlalchemy

    there = set(sqlalchemy.inspect(connection).get_table_names())
    if not there:
        if not make:
            raise DataError(_nothing_yet(shown))
        return 0
    columns = sqlalchemy.inspect(connection).get_columns('about') if 'about' in there else []
    if not there.issuperset(FIRST) or [column['name'] for column in columns] != ['version']:
        others = ', '.join(sorted(there)[:3])
        raise DataError(
            f"'{shown}' is no history but belongs to another application (it has tables such as "
            f'{others}); give the history a database of its own with --db'
        )
    row = connection.execute(sqlalchemy.text('SELECT version FROM about')).first()
    if row is not None and not isinstance(row[0], int):  # SQLite takes anything as a number
        raise DataError(
            f"'{shown}' is no history, or a damaged one: its version is {row[0]!r}; give another "
            'with --db, or restore it from a copy'
        )
    if row is None or not 0 < row[0] <= VERSION:
        result = 'no version' if row is None else f'version {row[0]}'
        raise DataError(
            f"'{shown}' is a history of {result}, and this program knows versions up to {VERSION}; "
            'install a newer weld-twin'
        )
    return int(row[0])


def bring_up(connection: Connection, tables: MetaData, version: int) -> None:
    """Make the tables in a transaction that writes, or bring those of an older version to this one."""
    import sqlalchemy

    tables.create_all(connection)  # those that are not there yet
    for step in STEPS[version - 1 :] if version else ():
        step(connection)
    about = tables.tables['about']
    connection.execute(sqlalchemy.delete(about))
    connection.execute(sqlalchemy.insert(about).values(version=VERSION))


def alone(connection: Connection) -> None:
    """Wait until nobody else makes or changes tables; SQLite's transaction does that already."""
    if connection.dialect.name == 'postgresql':
        connection.exec_driver_sql(f'SELECT pg_advisory_xact_lock({LOCK})')


def _nothing_yet(shown: str) -> str:
    return (
        f"there is no history in '{shown}' yet; its first diagnosis makes one: "
        'weld-twin history add DIAGNOSIS --cell NAME --db URL'
    )


FIRST_WAIT, LONGEST_WAIT = 0.02, 1.0
"""Seconds before the second attempt, and at most before any; each wait is twice the last one."""
_STATES = ('40001', '40P01', '55P03', '57P01', '57P02', '57P03', '53300')
"""SQLSTATE codes of PostgreSQL that pass by themselves."""
_CONNECTION = '08'
"""Class of its codes that tell of a lost connection."""
_LOCKED = ('locked', 'busy')
"""What SQLite says where another program writes."""


class Unavailable(DataError):
    """The database cannot be used now; what was to be written may be written later."""


def passes(error: Exception, *, connecting: bool = False) -> bool:
    """
    Return whether an error of SQLAlchemy is likely to be gone with the next attempt.

    A server that is not there at the first connection is reported at once.
    """
    from sqlalchemy.exc import DBAPIError, OperationalError

    if not isinstance(error, DBAPIError):
        return False
    state = getattr(error.orig, 'sqlstate', None)
    if state is not None:
        return state in _STATES or str(state).startswith(_CONNECTION)
    said = str(error.orig).lower()
    if any(sign in said for sign in _LOCKED):
        return True
    lost = error.connection_invalidated or 'psycopg' in type(error.orig).__module__
    return lost and isinstance(error, OperationalError) and not connecting


def unavailable(error: Exception) -> bool:
    """Return whether an error says something of the database, and nothing of what was written."""
    from sqlalchemy.exc import DBAPIError, InterfaceError, InternalError, OperationalError
    from sqlalchemy.exc import TimeoutError as NoConnection

    kinds = (OperationalError, InterfaceError, InternalError, NoConnection)
    lost = isinstance(error, DBAPIError) and error.connection_invalidated
    return lost or isinstance(error, kinds) or passes(error)


def waits(patience: float) -> Iterator[float]:
    """Yield how long to wait before each further attempt, in all no longer than ``patience`` [s]."""
    wait = FIRST_WAIT
    while patience > 0.0:
        yield min(wait, patience)
        patience -= wait
        wait = min(2.0 * wait, LONGEST_WAIT)


def _locks_are_no_refusals(connection: Connection) -> None:
    """Version 2: a diagnosis that met a lock was written as refused; now it can run again."""
    from sqlalchemy import text

    connection.execute(
        text(
            "UPDATE runs SET state = 'failed' WHERE state = 'refused' "
            "AND sentence LIKE 'the history %cannot be used: %'"
        )
    )


def _promises_are_kept(connection: Connection) -> None:
    """Version 3: what was measured after corrections has a table, which `schema` makes."""


def _changes_are_looked_for_anew(connection: Connection) -> None:
    """Version 4: a knock is one change, which what was found before did not know."""
    from sqlalchemy import text

    connection.execute(text('DELETE FROM findings'))


STEPS: tuple[Callable[[Connection], None], ...] = (
    _locks_are_no_refusals,
    _promises_are_kept,
    _changes_are_looked_for_anew,
)
"""The step at place k makes version k + 2 of version k + 1."""


VERSION = 1 + len(STEPS)
"""Of the schema; an older database is brought to it, a newer one is refused."""
NAME = 200
"""Characters of the name of a cell or a robot; PostgreSQL refuses longer ones."""


def stored(at: datetime) -> datetime:
    """Return an instant as it is stored: UTC, without saying so."""
    return at.astimezone(timezone.utc).replace(tzinfo=None)


def not_a_cell(name: str) -> str:
    """Return why no cell can have a name; empty if one can."""
    if name.strip() and name.isprintable() and len(name) <= NAME:
        return ''
    return f'{name[:NAME]!r} is no name of a cell; it takes 1 to {NAME} signs that can be shown'


def schema() -> MetaData:
    import sqlalchemy as sql

    tables = sql.MetaData()
    sql.Table('about', tables, sql.Column('version', sql.Integer, primary_key=True))
    sql.Table(
        'cells',
        tables,
        sql.Column('id', sql.Integer, primary_key=True),
        sql.Column('name', sql.String(NAME), unique=True, nullable=False),
        sql.Column('robot', sql.String(NAME), nullable=False),
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
    _fleet(tables)
    _verifications(tables)
    return tables


def _verifications(tables: MetaData) -> None:
    """Add what was measured after corrections."""
    import sqlalchemy as sql

    sql.Table(
        'verifications',
        tables,
        sql.Column('id', sql.Integer, primary_key=True),
        sql.Column('cell_id', sql.ForeignKey('cells.id'), nullable=False, index=True),
        sql.Column('at', sql.DateTime, nullable=False),
        sql.Column('recording', sql.String(64), nullable=False),
        sql.Column('content', sql.JSON, nullable=False),
        sql.UniqueConstraint('cell_id', 'recording'),
    )


def _fleet(tables: MetaData) -> None:
    """Add what a fleet keeps: how each recording went, and what changed on each cell."""
    import sqlalchemy as sql

    sql.Table(
        'runs',
        tables,
        sql.Column('id', sql.Integer, primary_key=True),
        sql.Column('key', sql.String(64), unique=True, nullable=False),
        sql.Column('cell', sql.String(NAME), nullable=False, index=True),
        sql.Column('recording', sql.Text, nullable=False),
        sql.Column('state', sql.String(40), nullable=False),
        sql.Column('sentence', sql.Text, nullable=False),
        sql.Column('verdict_id', sql.ForeignKey('verdicts.id')),
        sql.Column('seconds', sql.Float, nullable=False),
        sql.Column('memory', sql.BigInteger, nullable=False),
    )
    sql.Table(
        'findings',
        tables,
        sql.Column('cell_id', sql.ForeignKey('cells.id'), primary_key=True),
        sql.Column('newest', sql.Integer, nullable=False),
        sql.Column('diagnoses', sql.Integer, nullable=False),
        sql.Column('changes', sql.JSON, nullable=False),
    )
