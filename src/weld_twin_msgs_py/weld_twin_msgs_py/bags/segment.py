# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Storage files that grow, put on the disk piece by piece, and the metadata.yaml that lists them.

rosbags keeps an open transaction (sqlite3) or up to 1 MiB of messages (mcap) in memory and
offers nothing to part with them before the end, so this reaches into its writers. Chunks of an
mcap get the checksum rosbags leaves out: after a power cut a file may have its length without its
content, and only a checksum tells.
"""

import os
import shlex
import shutil
import sqlite3
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple
from zlib import crc32

import yaml
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
from rosbags.rosbag2.storage_mcap import Channel as McapChannel
from rosbags.rosbag2.storage_mcap import McapWriter, write_channel, write_string
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Writer

from weld_twin_core.errors import DataError

from ..messages.topics import BY_NAME, RELIABLE
from ..messages.topics import Qos as TopicQos
from ..messages.typestore import TYPES

STORAGES = {'mcap': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}
SUFFIXES = ('.mcap', '.db3')
CHUNK = 512 * 1024
"""Bytes of messages in a chunk; less than rosbags waits for before it closes one by itself."""
OVERHEAD = 32
"""Bytes either storage adds to a message, about."""
OFFERED, TYPE_HASH = 'offered_qos_profiles', 'topic_type_hash'
"""Keys under which rosbag2 keeps these in a channel of an mcap."""
_CRC_AT = 1 + 8 + 8 + 8 + 8
"""Where in a chunk record its checksum is: after opcode, length, two times and a size."""
_NEVER = QosTime(9223372036, 854775807)
"""A duration that stands for none at all in the profiles of rosbag2."""
_DEFAULT_QOS = TopicQos(RELIABLE, 10)
"""Of a topic that is none of ours."""


class _Sqlite3Writer(Sqlite3Writer):
    """Begins a file in one step instead of nine, and puts a second on the disk with one wait."""

    SQLITE_SCHEMA = f'PRAGMA journal_mode = WAL; BEGIN; {Sqlite3Writer.SQLITE_SCHEMA} COMMIT;'


class _McapWriter(McapWriter):
    """Writes the hash of the type beside the quality of service, as rosbag2 does."""

    def add_connection(self, connection: Connection, offered_qos_profiles: str) -> None:
        metadata = BytesIO()
        for text in (OFFERED, offered_qos_profiles, TYPE_HASH, connection.digest):
            write_string(metadata, text)
        own = connection.id, connection.msgtype, connection.topic
        channel = McapChannel(*own, 'cdr', metadata.getvalue())
        self.channels.append(channel)
        self.channel_stats[connection.id] = 0
        write_channel(self.chunk.bio, channel, self.schemas)


class _Writer(Writer):
    STORAGE_PLUGINS = {
        **Writer.STORAGE_PLUGINS,
        StoragePlugin.SQLITE3: _Sqlite3Writer,
        StoragePlugin.MCAP: _McapWriter,
    }


class Channel(NamedTuple):
    """What the messages of one topic are."""

    topic: str
    type: str
    definition: str = ''
    """Text of a message definition that Jazzy does not know, with its hash; else empty."""
    digest: str = ''
    qos: tuple[Qos, ...] = ()  # as offered; empty for what the table of topics says


class Segment:
    """A storage file being written, in a directory that is made for it."""

    def __init__(self, folder: Path, storage: str) -> None:
        self.folder = folder
        self.size = 0
        """Bytes written, about."""
        self.first_ns: int | None = None
        """When the first message was recorded [ns]."""
        self._pending = 0
        self._unflushed = False
        self._connections: dict[tuple[str, str], Connection] = {}
        self._writer = _Writer(
            folder, version=Writer.VERSION_LATEST, storage_plugin=STORAGES[storage]
        )
        self._writer.open()

    @property
    def file(self) -> Path:
        files = list(self.folder.iterdir()) if self.folder.is_dir() else []
        for file in files:
            if file.suffix in SUFFIXES:
                return file
        raise FileNotFoundError(0, f"'{self.folder}' was removed while it was written")

    def announce(self, channel: Channel) -> Connection:
        """Return the connection of a channel, made when it is new."""
        known = self._connections.get(channel[:2])
        if known is None:
            known = self._connections[channel[:2]] = self._connect(channel)
        return known

    def write(self, channel: Channel, data: bytes, log_ns: int) -> None:
        self._writer.write(self.announce(channel), log_ns, data)
        size = len(data) + OVERHEAD
        self.size += size
        self._pending += size
        self._unflushed = True
        if self.first_ns is None:
            self.first_ns = log_ns
        if self._pending > CHUNK:
            self._part()

    def flush(self) -> None:
        """Put everything written so far where it outlives this process and a power cut."""
        if not self._unflushed:
            return
        self._part()
        storage: Any = self._writer.storage
        if hasattr(storage, 'bio'):
            storage.bio.flush()
        else:
            storage.conn.commit()
        sync(self.file)  # by its name: a file that was removed is written on without an error
        self._unflushed = False

    def close(self, custom: dict[str, str]) -> None:
        """Complete the file and write what is in it to a metadata.yaml beside it."""
        if self._unflushed:
            self._part()
        storage: Any = self._writer.storage
        if hasattr(storage, 'conn'):  # or whoever reads it must be able to write beside it
            storage.conn.commit()
            storage.conn.execute('PRAGMA journal_mode = DELETE')
        for key, value in custom.items():
            self._writer.set_custom_data(key, value)
        self._writer.close()
        sync(self.file)
        sync(self.folder / 'metadata.yaml')

    def abort(self) -> None:
        """Let go of the file as it is."""
        with suppress(Exception):  # the reason to let go is what the caller wants to see
            self._writer.abort()

    def _connect(self, channel: Channel) -> Connection:
        topic, kind = channel[:2]
        row = BY_NAME.get(topic)
        qos = list(channel.qos) or [_offered(_DEFAULT_QOS if row is None else row.offered)]
        self._unflushed = True
        if kind in TYPES.types:
            return self._writer.add_connection(
                topic, kind, typestore=TYPES, offered_qos_profiles=qos
            )
        if not channel.definition or not channel.digest:
            raise DataError(f"topic '{topic}' has the type {kind!r}, which no bag here holds")
        return self._writer.add_connection(
            topic,
            kind,
            msgdef=channel.definition,
            rihs01=channel.digest,
            offered_qos_profiles=qos,
        )

    def _part(self) -> None:
        """Close the pending chunk of an mcap, with its checksum."""
        self._pending = 0
        storage: Any = self._writer.storage
        if not hasattr(storage, 'close_chunk') or not storage.chunk.bio.tell():
            return
        checksum = crc32(storage.chunk.bio.getbuffer())
        start = storage.bio.tell()
        storage.close_chunk()
        end = storage.bio.tell()
        storage.bio.seek(start + _CRC_AT)
        storage.bio.write(checksum.to_bytes(4, 'little'))
        storage.bio.seek(end)


def sync(path: Path) -> None:
    """Put a closed file, or the names in a directory, on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextmanager
def clear_write_errors(path: Path, remaining: Callable[[], str] = str) -> Iterator[None]:
    """
    Turn what a full or missing disk makes the storages raise into one sentence.

    remaining: returns what is to be said behind it, by the time that it happens.
    """
    try:
        yield
    except (OSError, sqlite3.Error) as error:
        reason = getattr(error, 'strerror', None) or str(error)
        raise DataError(f"bag '{path}' cannot be written: {reason}{remaining()}") from None


def check_storage(storage: str) -> str:
    if storage not in STORAGES:
        raise DataError(f'storage must be one of {", ".join(STORAGES)}, got {storage!r}')
    return storage


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


INFORMATION = 'rosbag2_bagfile_information'
METADATA = 'metadata.yaml'


class Segments:
    """
    The storage files of a bag, NAME_0, NAME_1 and so on.

    The one that grows lies in a directory of its own and joins the others when it is complete.
    """

    def __init__(self, folder: Path, name: str, storage: str) -> None:
        self.folder = folder
        self._name = name
        self._storage = storage
        self._complete: list[dict[str, Any]] = []
        self.growing = self._next()

    def split(self) -> None:
        """Complete the file that grows and begin another."""
        self._settle()
        self.growing = self._next()

    def finish(self, custom: dict[str, str]) -> None:
        """Complete the last file and list them all."""
        self._settle(custom)
        listing = self.folder / METADATA
        scratch = listing.with_suffix('.yaml.tmp')
        text = yaml.safe_dump({INFORMATION: _merged(self._complete, custom)}, sort_keys=False)
        scratch.write_text(text, encoding='utf-8')
        sync(scratch)
        scratch.replace(listing)
        sync(self.folder)

    def _next(self) -> Segment:
        segment = Segment(self.folder / f'{self._name}_{len(self._complete)}', self._storage)
        sync(segment.folder)
        sync(self.folder)
        return segment

    def _settle(self, custom: dict[str, str] | None = None) -> None:
        """Close the file that grows and put it beside the others."""
        segment = self.growing
        segment.close(custom or {})
        file = segment.file
        text = (segment.folder / METADATA).read_text(encoding='utf-8')
        self._complete.append(yaml.safe_load(text)[INFORMATION])
        file.rename(self.folder / file.name)
        shutil.rmtree(segment.folder)
        sync(self.folder)


def _merged(parts: list[dict[str, Any]], custom: Mapping[str, str]) -> dict[str, Any]:
    """Return the metadata of a bag from those of its files."""
    filled = [part for part in parts if part['message_count']] or parts[:1]
    starts = [_start(part) for part in filled]
    ends = [_start(part) + part['duration']['nanoseconds'] for part in filled]
    topics: dict[tuple[str, str], dict[str, Any]] = {}
    for part in parts:
        for row in part['topics_with_message_count']:
            key = (row['topic_metadata']['name'], row['topic_metadata']['type'])
            known = topics.setdefault(key, {**row, 'message_count': 0})
            known['message_count'] += row['message_count']
    return {
        **parts[0],
        'relative_file_paths': [path for part in parts for path in part['relative_file_paths']],
        'duration': {'nanoseconds': max(ends) - min(starts)},
        'starting_time': {'nanoseconds_since_epoch': min(starts)},
        'message_count': sum(part['message_count'] for part in parts),
        'topics_with_message_count': list(topics.values()),
        'files': [file for part in parts for file in part['files']],
        'custom_data': dict(custom) or None,
    }


def _start(part: Mapping[str, Any]) -> int:
    return int(part['starting_time']['nanoseconds_since_epoch'])


SPARE = 10_000_000
"""Bytes [B] that a disk must have left beside the copy: others write on it, too."""


def recover_command(path: Path, growing: Path | None = None) -> str:
    """
    Return ``weld-twin bag recover`` for a recording, and where to if it can't be where it was meant.

    growing: where it grew; there may be no room beside it, or something else of its name by now.
    """
    source = path if growing is None or not path.exists() else growing
    name = path.name if source == path else f'{path.name}_recovered'
    needed = _size(growing or path) + SPARE
    places = (path.parent, Path.cwd(), Path.home(), Path(tempfile.gettempdir()))
    place = next((place for place in places if _has_room(place, needed)), Path('ANOTHER_DISK'))
    command = ['weld-twin', 'bag', 'recover', str(source)]
    return shlex.join(command if place / name == path else [*command, '--out', str(place / name)])


def _has_room(folder: Path, needed: int) -> bool:
    with suppress(OSError):
        return os.access(folder, os.W_OK) and shutil.disk_usage(folder).free >= needed
    return False


def _size(folder: Path) -> int:
    """Return the bytes of all files in a directory; those that go meanwhile count nothing."""
    total = 0
    with suppress(OSError):
        for file in [folder, *folder.rglob('*')]:
            total += file.stat().st_size
    return total
