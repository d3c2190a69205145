# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A bag written at once, of which nothing half-written is ever found, and one that grows for weeks.

That one grows in ``NAME.unfinished`` beside its final place, file after file, and takes its name when it
is complete. A process that is killed leaves that directory; `recover` makes a bag of it. A queue
before it lets whoever records never wait for the disk.
"""

from __future__ import annotations

import fcntl
import json
import os
import time
from collections import Counter, deque
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from threading import Condition, Thread
from typing import Any, NamedTuple

from weld_twin_core.errors import DataError, TwinError

from ..files.scratch import Scratch
from ..files.whole_files import followed, write_text
from ..messages.from_messages import stamp_ns
from ..messages.typestore import PROVENANCE_PREFIX, TYPES
from .segment import (
    METADATA,
    SUFFIXES,
    Channel,
    Segment,
    Segments,
    check_storage,
    clear_write_errors,
    recover_command,
    sync,
)


class BagWriter:
    """
    A bag being written, or discarded where its block is left by an exception.

    provenance: how the bag came about (robot, effects, seed, version); plain JSON values, kept in
    the bag's ``custom_data`` and read back by `provenance`.
    beside: texts that lie in the bag's directory, by name of the file.
    """

    def __init__(
        self,
        path: Path | str,
        *,
        storage: str = 'mcap',
        provenance: Mapping[str, Any] | None = None,
        beside: Mapping[str, str] | None = None,
    ) -> None:
        self.path = followed(path)
        self._storage = check_storage(storage)
        self._provenance = dict(provenance or {})
        self._beside = dict(beside or {})
        self._scratch: Scratch | None = None
        self._segment: Segment | None = None

    def open(self) -> BagWriter:
        self._refuse_existing()
        with self._clear_errors():
            self._scratch = Scratch(self.path.parent, f'.{self.path.name}-')
            self._segment = Segment(self._scratch.path / self.path.name, self._storage)
        return self

    def write(self, topic: str, message: Any, log_ns: int | None = None) -> None:
        """Write a message of `bag_messages`, recorded at a time [ns] or else at its stamp."""
        kind = message.__msgtype__
        when = stamp_ns(message) if log_ns is None else log_ns
        self.write_cdr(topic, kind, bytes(TYPES.serialize_cdr(message, kind)), when)

    def write_cdr(self, topic: str, kind: str, data: bytes, log_ns: int) -> None:
        """Write a serialised message, as a raw subscription receives it."""
        segment = self._opened()
        with self._clear_errors():
            segment.write(Channel(topic, kind), data, log_ns)

    def write_all(self, entries: Iterable[tuple[int, str, str, bytes]]) -> None:
        """Write many messages: time of recording [ns], topic, type and serialised message of each."""
        segment = self._opened()
        channels: dict[tuple[str, str], Channel] = {}
        with self._clear_errors():
            for ns, topic, kind, data in entries:
                channel = channels.get((topic, kind))
                if channel is None:
                    channel = channels[topic, kind] = Channel(topic, kind)
                segment.write(channel, data, ns)

    def close(self) -> None:
        """Finish the bag and put it in its place."""
        if self._segment is None or self._scratch is None:
            return
        try:
            with self._clear_errors():
                self._segment.close(custom_data(self._provenance))
                made = self._scratch.path / self.path.name
                for name, text in self._beside.items():
                    write_text(made / name, text)
                self._refuse_existing()
                made.rename(self.path)
        finally:
            self.discard()

    def discard(self) -> None:
        """Throw away what was written; does nothing once the bag is closed."""
        segment, self._segment = self._segment, None
        if segment is not None:
            segment.abort()
        if self._scratch is not None:
            self._scratch.close()
        self._scratch = None

    def __enter__(self) -> BagWriter:
        return self.open()

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self.close()
        else:
            self.discard()

    def _opened(self) -> Segment:
        if self._segment is None:
            raise DataError(f"bag '{self.path}' is not open for writing")
        return self._segment

    def _refuse_existing(self) -> None:
        if self.path.exists():
            raise DataError(
                f"'{self.path}' exists already and is not overwritten; give another name"
            )

    @contextmanager
    def _clear_errors(self) -> Iterator[None]:
        try:
            with clear_write_errors(self.path):
                yield
        except DataError:
            self.discard()
            raise


def custom_data(provenance: Mapping[str, Any]) -> dict[str, str]:
    """
    Return provenance as a bag's ``custom_data`` holds it: JSON without an apostrophe.

    A text with one is put between double quotes in ``metadata.yaml``, and where such a line is broken
    behind a backslash, ruamel.yaml reads another text than it wrote.
    """
    return {
        PROVENANCE_PREFIX + key: json.dumps(value).replace("'", r'\u0027')
        for key, value in provenance.items()
    }


UNFINISHED = '.unfinished'
NOTES = 'provenance.json'


class GrowingBag:
    """
    A bag being recorded; neither it nor the unfinished one of its name may exist.

    Files become about so many bytes large, or span so many ns; 0 is without limit.
    """

    def __init__(
        self,
        path: Path | str,
        *,
        storage: str = 'mcap',
        split_bytes: int = 0,
        split_ns: int = 0,
        provenance: Mapping[str, Any] | None = None,
    ) -> None:
        self.path = Path(path)
        self.folder = unfinished(self.path)
        self._storage = check_storage(storage)
        self._split_bytes = split_bytes
        self._split_ns = split_ns
        self._provenance = dict(provenance or {})
        self._segments: Segments | None = None
        self._channels: dict[tuple[str, str], Channel] = {}
        self._lock = -1

    def open(self) -> GrowingBag:
        self._refuse_existing()
        with clear_write_errors(self.path):
            self.folder.mkdir(parents=True)
            self._lock = lock(self.folder)
            self._write_notes()
            self._segments = Segments(self.folder, self.path.name, self._storage)
            sync(self.path.parent)
        return self

    def note(self, key: str, value: Any) -> None:
        """Add to the provenance of the open bag, or change it."""
        self._provenance[key] = value
        with self._clear_errors():
            self._write_notes()

    def announce(self, channel: Channel) -> None:
        """Say more of a topic than the table of topics does; before its first message."""
        self._channels[channel.topic, channel.type] = channel

    def write_cdr(self, topic: str, kind: str, data: bytes, log_ns: int) -> None:
        """Write a serialised message, as a raw subscription receives it."""
        segments = self._opened()
        with self._clear_errors():
            if self._full(segments, log_ns):
                segments.split()
            channel = self._channels.get((topic, kind)) or Channel(topic, kind)
            segments.growing.write(channel, data, log_ns)

    def flush(self) -> None:
        """Put what was written on the disk, where it outlives this process and a power cut."""
        segments = self._opened()
        with self._clear_errors():
            segments.growing.flush()

    def close(self) -> None:
        """Finish the bag and give it its name; what cannot be finished stays as it is."""
        if self._segments is None:
            return
        try:
            with self._clear_errors():
                self._segments.finish(custom_data(self._provenance))
                (self.folder / NOTES).unlink()
                if self.path.exists():
                    raise FileExistsError(0, 'something of that name has appeared meanwhile')
                self.folder.rename(self.path)
                sync(self.path.parent)
        finally:
            self.release()

    def release(self) -> None:
        """Let go of the bag as it is, unfinished."""
        if self._segments is not None:
            self._segments.growing.abort()
        if self._lock >= 0:
            os.close(self._lock)
        self._segments, self._lock = None, -1

    def _full(self, segments: Segments, log_ns: int) -> bool:
        growing = segments.growing
        if growing.first_ns is None:
            return False
        return 0 < self._split_bytes <= growing.size or (
            0 < self._split_ns <= log_ns - growing.first_ns
        )

    def _write_notes(self) -> None:
        write_text(self.folder / NOTES, json.dumps(self._provenance), overwrite=True)

    def _opened(self) -> Segments:
        if self._segments is None:
            raise DataError(f"bag '{self.path}' is not open for writing")
        return self._segments

    def _refuse_existing(self) -> None:
        if self.path.exists():
            raise DataError(
                f"'{self.path}' exists already and is not overwritten; give another name"
            )
        if self.folder.exists():
            raise DataError(
                f"'{self.folder}' is a recording that was cut short and is not overwritten; make "
                f"a bag of it with '{recover_command(self.path, self.folder)}', or choose another name"
            )

    def _clear_errors(self) -> Any:
        return clear_write_errors(self.path, self._kept)

    def _kept(self) -> str:
        """Return what can be had of it still."""
        if not any(file.suffix in SUFFIXES for file in self.folder.rglob('*')):
            return ''
        return (
            f"; what was recorded until then is kept: '{recover_command(self.path, self.folder)}'"
        )


def unfinished(path: Path) -> Path:
    """Return where a bag grows."""
    return path.with_name(path.name + UNFINISHED)


def is_growing(folder: Path) -> bool:
    """Return whether a directory is that of a recording under way or cut short, renamed or not."""
    if folder.name.endswith(UNFINISHED):
        return True
    return (folder / NOTES).is_file() and not (folder / METADATA).is_file()


def lock(folder: Path) -> int:
    """Return a descriptor that holds a directory; the end of the process lets go of it."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise DataError(f"'{folder}' is still being recorded; stop the recorder first") from None
    return descriptor


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

    flush_every: longest time a message is only in memory while the disk keeps up [s].
    """

    def __init__(self, bag: GrowingBag, *, flush_every: float, most_bytes: int) -> None:
        self.failure: TwinError | None = None
        """Why nothing is written any more."""
        self._bag = bag
        self._flush_every = flush_every
        self._most = most_bytes
        self._queued = 0
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
            if self.failure or self._closing or self._queued + size > self._most:
                self._dropped[topic] += 1
                return False
            self._queued += size
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
        """Write what waits and finish the bag."""
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
        with self._changed:
            for item in items:
                self._queue.popleft()
                self._queued -= len(item.data) + ITEM
                self._written[item.topic] += 1
