# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What goes wrong with a database, and whether it passes by itself.

Several programs write to one history, servers are started anew, disks fill up. None of that says
anything of a diagnosis, so none of it may be taken for a refusal.
"""

from __future__ import annotations

from collections.abc import Iterator

from weld_twin_core.errors import DataError

FIRST_WAIT, LONGEST_WAIT = 0.02, 1.0
"""Seconds before the second attempt, and at most before any; each wait is twice the last one."""
_STATES = (
    '40001',  # could not be put in an order with the others
    '40P01',  # each waits for the other
    '55P03',  # locked
    '57P01',  # the server is stopped
    '57P02',  # it has crashed
    '57P03',  # it starts
    '53300',  # too many connections
)
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

    ``error``: of SQLAlchemy. ``connecting``: whether it comes from the first connection: a server
    that is not there is then told at once.
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
