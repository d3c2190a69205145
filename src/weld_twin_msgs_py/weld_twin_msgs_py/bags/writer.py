# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Writing a bag so that nothing half-written is ever found under its name.

The bag grows in a hidden directory beside its final place and is renamed when it is complete.
"""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any

from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer

from weld_twin_core.errors import DataError

from ..convert import stamp_ns
from ..topics import BY_NAME, RELIABLE
from ..topics import Qos as TopicQos
from .flush import flush
from .reader import PROVENANCE_PREFIX
from .store import TYPES

STORAGES = {'mcap': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}
_NEVER = QosTime(9223372036, 854775807)
_DEFAULT_QOS = TopicQos(RELIABLE, 10)


class BagWriter:
    """
    A bag being written; a context manager, or `open` and `close` (or `discard`) by hand.

    Leaving the block by an exception discards everything.

    Parameters
    ----------
    path : Path or str
        Must not exist yet.
    storage : str
        'mcap' or 'sqlite3'.
    provenance : mapping, optional
        How the bag came about (robot, effects, seed, version); plain JSON values, kept in the
        bag's ``custom_data`` and read back by `provenance`.

    """

    def __init__(
        self,
        path: Path | str,
        *,
        storage: str = 'mcap',
        provenance: Mapping[str, Any] | None = None,
    ) -> None:
        if storage not in STORAGES:
            raise DataError(f'storage must be one of {", ".join(STORAGES)}, got {storage!r}')
        self.path = Path(path)
        self._storage = storage
        self._provenance = dict(provenance or {})
        self._scratch: Path | None = None
        self._writer: Writer | None = None
        self._connections: dict[str, Connection] = {}

    def open(self) -> BagWriter:
        """
        Start the bag.

        Raises
        ------
        DataError
            Something of that name exists, or the place cannot be written.

        """
        self._refuse_existing()
        with self._clear_errors():
            self.path.parent.mkdir(parents=True, exist_ok=True)
            scratch = tempfile.mkdtemp(prefix=f'.{self.path.name}-', dir=self.path.parent)
            self._scratch = Path(scratch)
            self._writer = Writer(
                self._scratch / self.path.name,
                version=Writer.VERSION_LATEST,
                storage_plugin=STORAGES[self._storage],
            )
            self._writer.open()
        for key, value in self._provenance.items():
            self.note(key, value)
        return self

    def note(self, key: str, value: Any) -> None:
        """
        Add to the provenance of the open bag, or change it.

        Raises
        ------
        DataError
            The bag is not open.

        """
        self._opened().set_custom_data(PROVENANCE_PREFIX + key, json.dumps(value))

    def flush(self) -> None:
        """
        Put what was written on the disk, where it outlives this process.

        Raises
        ------
        DataError
            The bag is not open, or the disk refuses.

        """
        with self._clear_errors():
            flush(self._opened())

    def write(self, topic: str, message: Any, log_ns: int | None = None) -> None:
        """
        Write a message made by `bag_messages`.

        Parameters
        ----------
        topic : str
        message : rosbags message
        log_ns : int, optional [ns]
            When it was recorded; left out, its header stamp.

        """
        kind = message.__msgtype__
        when = stamp_ns(message) if log_ns is None else log_ns
        self.write_cdr(topic, kind, bytes(TYPES.serialize_cdr(message, kind)), when)

    def write_cdr(self, topic: str, kind: str, data: bytes, log_ns: int) -> None:
        """
        Write a serialised message, as a raw subscription receives it.

        Raises
        ------
        DataError
            The bag is not open, or the disk refuses.

        """
        writer = self._opened()
        with self._clear_errors():
            writer.write(self._connection(topic, kind), log_ns, data)

    def add_topic(self, topic: str, kind: str) -> None:
        """Announce a topic that may stay without messages."""
        with self._clear_errors():
            self._connection(topic, kind)

    def close(self) -> None:
        """
        Finish the bag and put it in its place.

        Raises
        ------
        DataError
            Something of that name has appeared meanwhile, or the disk refuses.

        """
        if self._writer is None or self._scratch is None:
            return
        try:
            with self._clear_errors():
                self._writer.close()
                self._refuse_existing()
                (self._scratch / self.path.name).rename(self.path)
        finally:
            self.discard()

    def discard(self) -> None:
        """Throw away what was written; does nothing once the bag is closed."""
        writer, self._writer = self._writer, None
        if writer is not None and writer.storage is not None:
            with suppress(Exception):  # the reason to discard is what the caller wants to see
                writer.abort()
        if self._scratch is not None:
            shutil.rmtree(self._scratch, ignore_errors=True)
        self._scratch = None
        self._connections.clear()

    def __enter__(self) -> BagWriter:
        """Start the bag."""
        return self.open()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Finish the bag, or throw it away when the block failed."""
        if kind is None:
            self.close()
        else:
            self.discard()

    def _connection(self, topic: str, kind: str) -> Connection:
        known = self._connections.get(topic)
        if known is None:
            writer = self._opened()
            if kind not in TYPES.types:
                raise DataError(f"topic '{topic}' has the type {kind!r}, which no bag here holds")
            row = BY_NAME.get(topic)
            offered = _offered(_DEFAULT_QOS if row is None else row.offered)
            known = writer.add_connection(
                topic, kind, typestore=TYPES, offered_qos_profiles=[offered]
            )
            self._connections[topic] = known
        return known

    def _opened(self) -> Writer:
        if self._writer is None:
            raise DataError(f"bag '{self.path}' is not open for writing")
        return self._writer

    def _refuse_existing(self) -> None:
        if self.path.exists():
            raise DataError(f"'{self.path}' exists already and is not overwritten")

    @contextmanager
    def _clear_errors(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            self.discard()
            reason = error.strerror or str(error)
            raise DataError(f"bag '{self.path}' cannot be written: {reason}") from None


def _offered(qos: TopicQos) -> Qos:
    return Qos(
        history=QosHistory.KEEP_LAST,
        depth=qos.depth,
        reliability=QosReliability[qos.reliability.upper()],
        durability=QosDurability.VOLATILE,
        deadline=_NEVER,
        lifespan=_NEVER,
        liveliness=QosLiveliness.AUTOMATIC,
        liveliness_lease_duration=_NEVER,
        avoid_ros_namespace_conventions=False,
    )
