# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What was measured after corrections, kept beside the diagnoses of a cell."""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from weld_twin_core.errors import DataError

from .database import Database, key_of, there_already
from .entry import date_of_stamp
from .schema import stored

if TYPE_CHECKING:
    from sqlalchemy import Connection

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
