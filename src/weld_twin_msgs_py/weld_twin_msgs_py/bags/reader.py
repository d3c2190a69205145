# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a path to a bag stands for, and streaming access: a message is decoded, handed over, forgotten.

A kilobyte of zstd can stand for gigabytes. rosbags unpacks whatever it finds, so the two unpackers
it looks up by name are replaced here by such as stop at a size that can be meant.
"""

from __future__ import annotations

import errno
import json
import shutil
import sqlite3
from collections.abc import Collection, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from traceback import clear_frames
from typing import Any, NamedTuple

import numpy as np
import yaml
from lz4.frame import LZ4FrameDecompressor
from mcap.reader import make_reader
from numpy.typing import NDArray
from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag2 import Reader, storage_mcap

from weld_twin_core.errors import DataError, TwinError

from ..messages.cdr import first_time_ns
from ..messages.typestore import PROVENANCE_PREFIX, TYPES, decode, types_with
from .segment import INFORMATION, METADATA, SUFFIXES, recover_command
from .writers import UNFINISHED, is_growing, unfinished

IntArray = NDArray[np.int64]
PACKED = '.zstd'
TABLES = ('.csv', '.tsv', '.txt')
SIZE_LIMIT = 16_000_000
"""Bytes of metadata.yaml; a bag of a thousand files has some hundred kilobytes."""
DEPTH_LIMIT = 50
"""Levels of metadata.yaml; it has six."""
SET_BACK = 100_000_000
"""Time [ns] by which messages of one topic never come in another order than they are written."""
_INDEX_HEAD = 1 + 8 + 2
"""Bytes of a record MessageIndex of MCAP before its list: what it is, its length, and the channel."""
_Loader: Any = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)


class Bag(NamedTuple):
    """Where a bag lies."""

    files: list[Path]  # storage files, in the order they were written
    custom: dict[str, str]  # the ``custom_data`` of its metadata
    packed: bool = False  # messages are compressed one by one


def look(path: Path) -> Bag:
    """
    Return what a path to a bag stands for.

    Raises ValueError, KeyError, TypeError, OSError, yaml.YAMLError: its metadata is damaged.
    """
    refuse_unfinished(path)
    if path.suffix == '.bag' and not path.is_dir():
        raise DataError(f"'{path}' is a ROS 1 bag; convert it with rosbags-convert first")
    if path.is_file():
        if path.suffix not in SUFFIXES:
            hint = '; a table becomes one with weld-twin import' if path.suffix in TABLES else ''
            raise DataError(
                f"'{path}' is no bag: expected a rosbag2 directory, a .mcap or a .db3 file{hint}"
            )
        made = _information(path.parent)
        return Bag([path], _custom(made) if path.name in _named(made) else _within(path))
    if (path / METADATA).exists():
        return _listed(path)
    files = storage_files(path)
    if not files:
        raise DataError(
            f"'{path}' is no bag: it holds neither metadata.yaml nor a .mcap or .db3 file"
        )
    return Bag(files, _within(files[-1]))


def refuse_unfinished(path: Path) -> None:
    """Refuse what is not there, and say so if it is there under the name of a growing bag."""
    growing = path if is_growing(path) else unfinished(path)
    named = growing.with_name(growing.name.removesuffix(UNFINISHED))
    if growing.is_dir() and not (path.exists() and path != growing):
        raise DataError(
            f"the recording of '{named}' is still running or was cut short; what is on the disk "
            f"becomes a bag with '{recover_command(named, growing)}'"
        )
    if not path.exists():
        raise DataError(f"there is no bag at '{path}'")


def storage_files(folder: Path) -> list[Path]:
    """Return the storage files of a directory, the tenth after the ninth."""
    files = [file for file in folder.iterdir() if file.suffix in SUFFIXES and file.is_file()]
    return sorted(files, key=lambda file: (_number(file), file.name))


def _number(file: Path) -> int:
    digits = file.stem.rpartition('_')[2]
    return int(digits) if digits.isdecimal() and digits.isascii() else 0


def _listed(path: Path) -> Bag:
    """Return the files that the metadata lists; only their names count, never their folders."""
    made = _information(path)
    files = [path / name for name in _named(made)]
    for file in files:
        if not file.is_file():
            raise ValueError(f'metadata.yaml lists {file.name!r}, which is not there')
        if file.suffix not in (*SUFFIXES, PACKED):
            raise ValueError(f'metadata.yaml lists {file.name!r}, which is no storage file')
    mode = str(made.get('compression_mode') or '').lower()
    return Bag(files, _custom(made), mode == 'message')


def _named(made: dict[str, Any]) -> list[str]:
    return [PurePath(str(name)).name for name in made['relative_file_paths']] if made else []


def _custom(made: dict[str, Any]) -> dict[str, str]:
    custom = made.get('custom_data') or {}
    return custom if isinstance(custom, dict) else {}


def _within(file: Path) -> dict[str, str]:
    """Return the ``custom_data`` that a storage file has in itself, as rosbag2 writes it at its end."""
    with suppress(Exception):  # of what is damaged the messages tell, or there is nothing to tell
        if file.suffix == '.mcap':
            with file.open('rb') as stream:
                reader = make_reader(stream)
                # Without a summary it would unpack all chunks on the way, however large they get.
                records = reader.iter_metadata() if reader.get_summary() else ()
                texts = [each.metadata['serialized_metadata'] for each in records]
        else:
            with closing(sqlite3.connect(f'{file.absolute().as_uri()}?mode=ro', uri=True)) as base:
                texts = [
                    row[0] for row in base.execute('SELECT metadata FROM metadata ORDER BY id')
                ]
        return _custom(_parsed(texts[-1].encode()))
    return {}


def _information(folder: Path) -> dict[str, Any]:
    """Return what metadata.yaml of a directory says; nothing without one."""
    file = folder / METADATA
    if not file.is_file():
        return {}
    if file.stat().st_size > SIZE_LIMIT:
        raise ValueError(f'metadata.yaml is larger than {SIZE_LIMIT / 1e6:g} MB')
    made = _parsed(file.read_bytes())[INFORMATION]
    if not isinstance(made, dict):
        raise ValueError('metadata.yaml is no mapping')
    return made


def _parsed(data: bytes) -> Any:
    """Return YAML, refused where its nesting would overflow the stack of the fast loader."""
    depth = 0
    for event in yaml.parse(data, Loader=_Loader):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if depth > DEPTH_LIMIT:
            raise ValueError('metadata.yaml is nested too deeply')
    return yaml.load(data, Loader=_Loader)


zstd: Any = storage_mcap.zstd  # type: ignore[attr-defined]
"""The one rosbags found; where it lies depends on the version of Python."""
RATIO = 200
"""Times smaller than its content that recorded motion ever gets."""
SMALL = 64_000_000
"""Bytes that are unpacked whatever the ratio."""
MOST = 2_000_000_000
"""Bytes that are never unpacked in memory."""
_HEAD = 18
"""Bytes of the longest header of a zstd frame (RFC 8878), which may tell the size of its content."""
_PIECE = 1 << 20
"""Bytes read at once."""


def allowed(packed: int) -> int:
    """Return how many bytes may come out of so many."""
    return min(max(SMALL, RATIO * packed), MOST)


def unzstd(data: bytes, size: int | None = None) -> bytes:
    """Return the content of a zstd frame, of a declared size."""
    limit = _limit(data, size)
    return _whole(zstd.ZstdDecompressor().decompress(data, limit + 1), limit)


def unlz4(data: bytes, size: int | None = None) -> bytes:
    """Return the content of an lz4 frame; as `unzstd`."""
    limit = _limit(data, size)
    return _whole(LZ4FrameDecompressor().decompress(data, limit + 1), limit)


def unpack_file(packed: Path, out: Path) -> None:
    most = max(SMALL, RATIO * packed.stat().st_size)
    free = shutil.disk_usage(out.parent).free
    with packed.open('rb') as raw:
        size = zstd.get_frame_info(raw.read(_HEAD)).decompressed_size or 0
    if size > most:
        raise _bomb()
    if size > free:
        raise _no_room(packed, out, f'unpacks to {size / 1e9:.1f} GB')
    done = 0
    try:
        with packed.open('rb') as raw, zstd.open(raw, 'rb') as source, out.open('wb') as sink:
            while piece := source.read(_PIECE):
                done += len(piece)
                if done > most:
                    raise _bomb()
                sink.write(piece)
    except OSError as error:
        if error.errno == errno.ENOSPC:
            raise _no_room(packed, out, 'unpacks to more than that') from None
        raise


def _no_room(packed: Path, out: Path, what: str) -> DataError:
    free = shutil.disk_usage(out.parent).free
    return DataError(
        f"'{packed}' {what}, and '{out.parent}' has room for {free / 1e9:.1f} GB; make room, or "
        'set TMPDIR to a place that has it'
    )


def guard_rosbags() -> None:
    """Put these unpackers in the place of those of rosbags."""
    table: dict[str, Any] = storage_mcap.DECOMPRESSORS
    table.update(zstd=unzstd, lz4=unlz4)


def _limit(data: bytes, size: int | None) -> int:
    most = allowed(len(data))
    if size is None:
        return most
    if size > most:
        raise _bomb()
    return size


def _whole(out: bytes, limit: int) -> bytes:
    if len(out) > limit:
        raise _bomb()
    return out


def _bomb() -> DataError:
    return DataError(
        f'compressed data in the bag would unpack to more than {RATIO} times its size; such a bag '
        'is not opened'
    )


guard_rosbags()


class BagMessage(NamedTuple):
    """One message: its topic, its type, when it was recorded [ns], and itself."""

    topic: str
    type: str
    log_ns: int
    message: Any


class BagReader:
    """An open bag; use as a context manager so that the storage is never left open."""

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.topics: dict[str, tuple[str, int]] = {}
        """Message type and count of each topic; of two types, both are named, and none is taken."""
        self.provenance: dict[str, Any] = {}
        """What the writer said about the bag's making; empty for bags made elsewhere."""
        self._packed = False
        self._definitions: dict[str, tuple[str, bool]] = {}
        self._readers: list[Reader] = []
        self._stack = ExitStack()

    def __enter__(self) -> BagReader:
        try:
            with clear_errors(self.path):
                bag = look(self.path)
                self._packed = bag.packed
                for file in bag.files:
                    self._open(file)
                self._list_topics()
                start = len(PROVENANCE_PREFIX)
                self.provenance = {
                    key[start:]: json.loads(value)
                    for key, value in bag.custom.items()
                    if str(key).startswith(PROVENANCE_PREFIX)
                }
        except BaseException:
            self._stack.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def messages(self, topics: Collection[str]) -> Iterator[BagMessage]:
        """Yield the messages of some topics, in the order of recording."""
        with clear_errors(self.path):
            for topic, kind, log_ns, data in self.raw(topics):
                yield BagMessage(topic, kind, log_ns, self.decoded(data, kind))

    def decoded(self, data: bytes, kind: str) -> Any:
        """Return a message by the definition of Jazzy, or by that of the bag where Jazzy has none."""
        if kind in TYPES.fielddefs:
            return decode(data, kind)
        definition, idl = self._definitions.get(kind, ('', False))
        return decode(data, kind, types_with(kind, definition, idl))

    def raw(self, topics: Collection[str]) -> Iterator[tuple[str, str, int, bytes]]:
        """Yield topic, type, time of recording [ns] and serialised message of some topics."""
        with clear_errors(self.path):
            for reader in self._readers:
                wanted = [c for c in reader.connections if c.topic in topics]
                if not wanted:
                    continue
                self._refuse_set_back(reader)
                for connection, log_ns, data in reader.messages(wanted):
                    whole = unzstd(data) if self._packed else data
                    yield connection.topic, connection.msgtype, log_ns, whole

    def stamps(self) -> Iterator[tuple[str, int, bool]]:
        """Yield topic, stamp [ns], and whether that is the header's or of the recording."""
        with clear_errors(self.path):
            for reader in self._readers:
                self._refuse_set_back(reader)
                stamped = {c.id: has_header(c.msgtype) for c in reader.connections}
                for connection, log_ns, data in reader.messages():
                    if stamped[connection.id]:
                        whole = unzstd(data) if self._packed else data
                        yield connection.topic, first_time_ns(whole), True
                    else:
                        yield connection.topic, log_ns, False

    def _refuse_set_back(self, reader: Reader) -> None:
        """Refuse messages that are read in the order of a clock that was set back meanwhile."""
        for number, times in _as_written(reader.storage):
            falls = _falls(times)
            if falls.max(initial=0) > SET_BACK:
                at = int(np.argmax(falls > SET_BACK))
                names = [c.topic for c in reader.connections if c.id == number]
                raise DataError(
                    f"the clock of the computer that recorded '{self.path}' was set back by "
                    f"{falls[at] * 1e-9:.3f} s at message {at} of '{names[0]}', so that what came "
                    f"before and after lies on each other; 'weld-twin bag recover {self.path}' parts "
                    'it there'
                )

    def _list_topics(self) -> None:
        for reader in self._readers:
            for connection in reader.connections:
                if not all(isinstance(x, str) for x in (connection.topic, connection.msgtype)):
                    raise ValueError('name or type of a topic is no text')
                kind, count = self.topics.get(connection.topic, ('', 0))
                kinds = kind.split(' and ') if count else []
                if connection.msgtype not in kinds and (connection.msgcount or not count):
                    kinds.append(connection.msgtype)
                both = ' and '.join(kinds)
                self.topics[connection.topic] = both, count + connection.msgcount
                defined = connection.msgdef
                self._definitions[connection.msgtype] = (
                    defined.data,
                    defined.format == MessageDefinitionFormat.IDL,
                )

    def _open(self, file: Path) -> None:
        if file.suffix == PACKED:
            scratch = Path(self._stack.enter_context(TemporaryDirectory())) / file.stem
            unpack_file(file, scratch)
            file = scratch
        if file.suffix == '.db3':
            _refuse_truncated(file)
        self._readers.append(self._stack.enter_context(Reader(file)))


def _falls(times: IntArray) -> IntArray:
    """Return by how much [ns] each time is before the latest of those before it."""
    return np.maximum.accumulate(times) - times


def _as_written(storage: Any) -> Iterator[tuple[int, IntArray]]:
    """Yield each connection and its times of recording [ns] as they were written, by the index alone."""
    if isinstance(storage, storage_mcap.McapReader) and storage.bio is not None:
        parts: dict[int, list[IntArray]] = {}
        for chunk in sorted(storage.chunks, key=lambda chunk: chunk.chunk_start_offset):
            for number, place in chunk.message_index_offsets.items():
                storage.bio.seek(place + _INDEX_HEAD)
                size = int.from_bytes(storage.bio.read(4), 'little')
                rows = np.frombuffer(storage.bio.read(size), '<i8').reshape(-1, 2)
                parts.setdefault(number, []).append(rows[np.argsort(rows[:, 1]), 0])
        yield from ((number, np.concatenate(times)) for number, times in parts.items())
        return
    # In this order the index of rosbag2 has all there is to know, and no message is read.
    rows = np.array(
        list(storage.dbconn.execute('SELECT timestamp, id FROM messages ORDER BY timestamp')),
        np.int64,
    ).reshape(-1, 2)
    times = rows[np.argsort(rows[:, 1]), 0]
    if _falls(times).max(initial=0) > SET_BACK:
        read = storage.dbconn.execute('SELECT topic_id, timestamp FROM messages ORDER BY id')
        rows = np.array(list(read), np.int64).reshape(-1, 2)
        yield from ((int(k), rows[rows[:, 0] == k, 1]) for k in np.unique(rows[:, 0]))


def has_header(kind: str) -> bool:
    """Return whether messages of a type start with a std_msgs/Header."""
    if kind not in TYPES.fielddefs:
        return False
    fields = TYPES.fielddefs[kind][1]
    return bool(fields) and fields[0][0] == 'header'


@contextmanager
def clear_errors(path: Path) -> Iterator[None]:
    """Turn whatever a damaged byte makes the storage libraries raise into one sentence."""
    try:
        yield
    except TwinError:
        raise
    except MemoryError:
        raise DataError(
            f"bag '{path}' needs more memory to be read than there is; where it is damaged, as by a "
            f"size that nothing has, 'weld-twin bag recover {path}' takes what is whole of it"
        ) from None
    except PermissionError:
        raise DataError(f"bag '{path}' cannot be read: permission denied") from None
    except Exception as error:  # a flipped bit surfaces as anything from KeyError to ZstdError
        _let_go(error)
        reason = ' '.join(str(error).split()).rstrip('.') or type(error).__name__
        raise DataError(
            f"bag '{path}' is damaged or was cut short ({reason[:200]}); what is whole of it "
            f"becomes a bag with 'weld-twin bag recover {path}'"
        ) from None


def _let_go(error: BaseException | None) -> None:
    """Drop what the frames of a failed open still hold: a database nobody else would close."""
    while error is not None:
        clear_frames(error.__traceback__)
        error = error.__context__


def _refuse_truncated(path: Path) -> None:
    """Refuse a file that lacks its last pages: SQLite reads it without a word; the header tells."""
    with path.open('rb') as file:
        head = file.read(32)
    if len(head) < 32:
        raise ValueError('the file is too short to be a database')
    page = int.from_bytes(head[16:18], 'big')
    pages = int.from_bytes(head[28:32], 'big')
    expected = (65536 if page == 1 else page) * pages
    if path.stat().st_size < expected:
        raise ValueError(f'the file has {path.stat().st_size} of {expected} bytes')


def provenance(path: Path | str) -> dict[str, Any]:
    """
    Return what the writer said about a bag's making; empty for bags made elsewhere.

    Raises
    ------
    DataError
        Nothing is there, it is no bag, or it is damaged.

    """
    with BagReader(path) as reader:
        return reader.provenance
