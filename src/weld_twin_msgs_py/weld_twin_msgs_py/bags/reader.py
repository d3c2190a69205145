# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Streaming access to one bag: a message is decoded, handed over and forgotten.

A kilobyte of zstd can stand for gigabytes. rosbags unpacks whatever it finds, so the two unpackers
it looks up by name are replaced here by such as stop at a size that can be meant.
"""

from __future__ import annotations

import errno
import json
import shutil
from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from traceback import clear_frames
from typing import Any, NamedTuple

from lz4.frame import LZ4FrameDecompressor
from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag2 import Reader, storage_mcap

from weld_twin_core.errors import DataError, TwinError

from ..messages.cdr_read import first_time_ns
from ..messages.typestore import PROVENANCE_PREFIX, TYPES, decode, types_with
from .storage import PACKED, look

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
    """Unpack a zstd file."""
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
        """Message type and count of each topic."""
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
                self.provenance = _provenance(bag.custom)
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
                for connection, log_ns, data in reader.messages(wanted):
                    whole = unzstd(data) if self._packed else data
                    yield connection.topic, connection.msgtype, log_ns, whole

    def stamps(self) -> Iterator[tuple[str, int, bool]]:
        """Yield topic, stamp [ns], and whether that is the header's or of the recording."""
        with clear_errors(self.path):
            for reader in self._readers:
                stamped = {c.id: has_header(c.msgtype) for c in reader.connections}
                for connection, log_ns, data in reader.messages():
                    if stamped[connection.id]:
                        whole = unzstd(data) if self._packed else data
                        yield connection.topic, first_time_ns(whole), True
                    else:
                        yield connection.topic, log_ns, False

    def _list_topics(self) -> None:
        for reader in self._readers:
            for connection in reader.connections:
                if not all(isinstance(x, str) for x in (connection.topic, connection.msgtype)):
                    raise ValueError('name or type of a topic is no text')
                count = self.topics.get(connection.topic, ('', 0))[1]
                self.topics[connection.topic] = (connection.msgtype, count + connection.msgcount)
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


def _provenance(custom: Mapping[Any, Any]) -> dict[str, Any]:
    start = len(PROVENANCE_PREFIX)
    return {
        key[start:]: json.loads(value)
        for key, value in custom.items()
        if str(key).startswith(PROVENANCE_PREFIX)
    }


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
