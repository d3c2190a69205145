# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is whole of a sqlite3 bag whose writer died, or that is damaged."""

from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from .salvage import Damage, Found, channel_of
from .segment import Channel

JOURNALS = ('-journal', '-wal')
"""Files beside a database in which a writer that died has left a step half done."""


def salvage_sqlite(path: Path, damage: Damage) -> Iterator[Found]:
    """Yield messages in the order they were written, up to the first that cannot be read."""
    with ExitStack() as stack:
        try:
            base = _open(path, stack)
            channels = _channels(base)
            rows = base.execute('SELECT topic_id, timestamp, data FROM messages ORDER BY id')
            for number, log_ns, data in rows:
                if number in channels and isinstance(log_ns, int) and isinstance(data, bytes):
                    yield channels[number], log_ns, data
                else:
                    damage.tell(path, 'holds rows that are no messages, which are left out')
        except (sqlite3.Error, OverflowError) as error:
            damage.tell(path, f'is damaged ({error})')


def _open(path: Path, stack: ExitStack) -> sqlite3.Connection:
    """
    Open a database as it is, or as a copy that can be mended.

    Opening undoes a step that was half done; half a page at the end is cut off, for it would
    read as half a message and zeros.
    """
    journals = [file for file in _beside(path) if file.exists()]
    torn = path.stat().st_size % _page(path)
    mode = 'immutable=1'
    if journals or torn:
        folder = Path(
            stack.enter_context(TemporaryDirectory(dir=path.parent, prefix='.recovering-'))
        )
        for file in (path, *journals):
            shutil.copy(file, folder / file.name)
        path, mode = folder / path.name, 'mode=rw'
        os.truncate(path, path.stat().st_size - torn)
    base = sqlite3.connect(f'{path.resolve().as_uri()}?{mode}', uri=True)
    stack.enter_context(closing(base))
    base.execute('PRAGMA trusted_schema = OFF')
    base.execute('PRAGMA writable_schema = ON')  # or a file that lacks its last page is refused
    return base


def _page(path: Path) -> int:
    """Return the size of a page [bytes]."""
    with path.open('rb') as file:
        size = int.from_bytes(file.read(18)[16:18], 'big')
    return 65536 if size == 1 else max(size, 512)


def _beside(path: Path) -> list[Path]:
    return [path.with_name(path.name + suffix) for suffix in JOURNALS]


def _channels(base: sqlite3.Connection) -> dict[Any, Channel]:
    listed = base.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
    tables = {name for (name,) in listed}
    if not {'messages', 'topics'} <= tables:  # a view of that name might never end
        raise sqlite3.DatabaseError('it lacks the tables of a bag')
    texts: dict[str, str] = {}
    if 'message_definitions' in tables:
        texts = dict(
            base.execute(
                'SELECT topic_type, encoded_message_definition FROM message_definitions '
                "WHERE encoding = 'ros2msg'"
            )
        )
    known = {row[1] for row in base.execute('PRAGMA table_info(topics)')}
    qos = 'offered_qos_profiles' if 'offered_qos_profiles' in known else "''"
    return {
        number: channel_of(str(topic), str(kind), str(texts.get(kind, '')), text)
        for number, topic, kind, text in base.execute(f'SELECT id, name, type, {qos} FROM topics')
    }
