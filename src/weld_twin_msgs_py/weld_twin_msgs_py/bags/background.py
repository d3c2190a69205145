# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A growing bag behind a queue, so that whoever records never waits for the disk."""

from __future__ import annotations

import time
from collections import Counter, deque
from itertools import islice
from threading import Condition, Thread
from typing import Any, NamedTuple

from weld_twin_core.errors import DataError, TwinError

from .growing import GrowingBag
from .recover_command import recover_command
from .segment import Channel

CLOSED_WITHIN = 15.0
"""Seconds that a bag may take to be finished: a slow disk, 5 MB/s, writes the usual queue of 64 MB."""
BATCH = 500
"""Messages written between two looks at the time."""
ITEM = 200
"""Bytes a message costs in the queue beside its own."""


class _Item(NamedTuple):
    topic: str
    kind: str
    data: bytes
    log_ns: int


class BackgroundBag:
    """
    Writes in a thread of its own; what does not fit into the queue is dropped and counted.

    bag: this opens and closes it.
    flush_every: longest time a message is only in memory while the disk keeps up [s].
    most_bytes: memory the queue may take.

    Raises TwinError: the bag cannot be opened.
    """

    def __init__(self, bag: GrowingBag, *, flush_every: float, most_bytes: int) -> None:
        self.failure: TwinError | None = None
        """Why nothing is written any more."""
        self._bag = bag
        self._flush_every = flush_every
        self._most = most_bytes
        self._held = 0
        self._written: Counter[str] = Counter()
        self._dropped: Counter[str] = Counter()
        self._queue: deque[_Item] = deque()
        self._notes: dict[str, Any] = {}
        self._open = self._closing = False
        self._changed = Condition()
        self._thread = Thread(target=self._run, name='bag writer', daemon=True)
        self._thread.start()
        with self._changed:
            self._changed.wait_for(lambda: self._open or self.failure)
        if self.failure is not None:
            raise self.failure

    def put(self, topic: str, kind: str, data: bytes, log_ns: int) -> bool:
        """Queue a serialised message; return whether there was room."""
        size = len(data) + ITEM
        with self._changed:
            if self.failure or self._closing or self._held + size > self._most:
                self._dropped[topic] += 1
                return False
            self._held += size
            self._queue.append(_Item(topic, kind, data, log_ns))
            if len(self._queue) == 1:
                self._changed.notify()
        return True

    def announce(self, channel: Channel) -> None:
        """Say more of a topic than the table of topics does; before its first message."""
        self._bag.announce(channel)

    def note(self, key: str, value: Any) -> None:
        """Add to the provenance, or change it."""
        with self._changed:
            self._notes[key] = value
            self._changed.notify()

    def counts(self) -> tuple[dict[str, int], dict[str, int]]:
        """Return how many messages of each topic were written and dropped; others wait."""
        with self._changed:
            return dict(self._written), dict(self._dropped)

    def end(self) -> bool:
        """Take nothing more; return whether what waited is written and the bag is finished."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        return not self._thread.is_alive()

    def close(self) -> None:
        """
        Write what waits and finish the bag.

        Raises TwinError: it could not all be written.
        """
        self.end()
        self._thread.join(CLOSED_WITHIN)
        if self._thread.is_alive():
            raise DataError(
                f"the bag '{self._bag.path}' is not complete: the disk has taken nothing for "
                f'{CLOSED_WITHIN:g} s; what it took is kept: '
                f"'{recover_command(self._bag.path, self._bag.folder)}'"
            )
        if self.failure is not None:
            raise self.failure

    def _run(self) -> None:
        try:
            self._bag.open()  # here, for a database belongs to the thread that opened it
            with self._changed:
                self._open = True
                self._changed.notify()
            self._serve()
            self._bag.close()
        except TwinError as error:
            self._bag.release()
            with self._changed:
                self.failure = error
                self._dropped.update(item.topic for item in self._queue)
                self._queue.clear()
                self._changed.notify()

    def _serve(self) -> None:
        due = time.monotonic() + self._flush_every
        while True:
            items, notes, last = self._look(due)
            for key, value in notes.items():
                self._bag.note(key, value)
            for item in items:
                self._bag.write_cdr(*item)
            self._settle(items)
            if time.monotonic() >= due:
                self._bag.flush()
                due = time.monotonic() + self._flush_every
            if last and not items:
                return

    def _look(self, due: float) -> tuple[list[_Item], dict[str, Any], bool]:
        """Return what waits, as soon as there is something to do; messages stay in the queue."""
        with self._changed:
            while not (self._queue or self._notes or self._closing):
                remaining = due - time.monotonic()
                if remaining <= 0.0:
                    break
                self._changed.wait(remaining)
            notes, self._notes = self._notes, {}
            return list(islice(self._queue, BATCH)), notes, self._closing

    def _settle(self, items: list[_Item]) -> None:
        """Take written messages out of the queue."""
        with self._changed:
            for item in items:
                self._queue.popleft()
                self._held -= len(item.data) + ITEM
                self._written[item.topic] += 1
