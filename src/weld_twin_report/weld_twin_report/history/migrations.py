# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A history of an older version brought to this one, step by step, in one transaction.

A change of the schema is a function here that makes version k + 2 of version k + 1, in its place in
`STEPS`. The tables of `schema` are the newest; a step adds what they have besides, with plain SQL that
SQLite and PostgreSQL both take. A kit for migrations is left out on purpose: users open a history by
their first command, there is nobody who runs an upgrade, and a table with one number says all that
five tables in one line of versions need.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sqlalchemy import Connection


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
