# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The tables of the history, alike on SQLite and PostgreSQL, and what brings an older version to them.

A change of the schema is a function here that makes version k + 2 of version k + 1, in its place in
`STEPS`, with plain SQL that both take. A kit for migrations is left out on purpose: users open a history
by their first command, and there is nobody who runs an upgrade.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, timezone
from typing import TYPE_CHECKING

from .entry import ARRAYS

if TYPE_CHECKING:
    from sqlalchemy import Connection, MetaData


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


STEPS: tuple[Callable[[Connection], None], ...] = (_locks_are_no_refusals, _promises_are_kept)
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
