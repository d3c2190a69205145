# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is whole of an mcap file that ends early or is damaged."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import IO, Any
from zlib import crc32

from mcap.records import Channel as ChannelRecord
from mcap.records import Chunk, Footer, Message, Schema
from mcap.stream_reader import StreamReader

from .salvage import Damage, Found, channel_of
from .segment import Channel
from .unpack import unlz4, unzstd

_UNPACK = {'': lambda data, _: data, 'zstd': unzstd, 'lz4': unlz4}


def salvage_mcap(path: Path, damage: Damage) -> Iterator[Found]:
    """
    Yield messages in the order of the file, up to the first record that is not whole.

    A chunk whose content does not match its checksum is passed over and told.
    """
    channels: dict[int, Channel] = {}
    schemas: dict[int, Schema] = {}
    complete = False
    with path.open('rb') as file:
        for record in _records(file, path.stat().st_size):
            complete = complete or isinstance(record, Footer)
            for inner in _opened(record, path, damage):
                if isinstance(inner, Schema):
                    schemas[inner.id] = inner
                elif isinstance(inner, ChannelRecord) and inner.id not in channels:
                    channels[inner.id] = _channel(inner, schemas)
                elif isinstance(inner, Message) and inner.channel_id in channels:
                    yield channels[inner.channel_id], inner.log_time, bytes(inner.data)
    if not complete:
        damage.tell(path, 'ends early')


class _Bounded:
    """A file that is never asked for more than it has, whatever length a record claims."""

    def __init__(self, file: IO[bytes], size: int) -> None:
        self._file = file
        self._left = size

    def read(self, size: int) -> bytes:
        """Return the next bytes, all of them."""
        if size > self._left:
            raise EOFError
        self._left -= size
        return self._file.read(size)


def _records(file: IO[bytes], size: int, *, inside: bool = False) -> Iterator[Any]:
    """Yield whole records, of a file or from inside a chunk, up to the first that is not."""
    bounded: Any = _Bounded(file, size)
    reader = StreamReader(bounded, skip_magic=inside, emit_chunks=True, record_size_limit=size)
    with suppress(Exception):  # a cut or flipped byte surfaces as anything from EOFError on
        yield from reader.records


def _opened(record: Any, path: Path, damage: Damage) -> Iterator[Any]:
    """Yield a record, or those inside when it is a chunk."""
    if not isinstance(record, Chunk):
        yield record
        return
    try:
        data = _UNPACK[record.compression](record.data, record.uncompressed_size)
        whole = len(data) == record.uncompressed_size
    except Exception:  # every compressor has its own errors
        whole = False
    if not whole or (record.uncompressed_crc and crc32(data) != record.uncompressed_crc):
        damage.tell(path, 'holds a damaged chunk, which is left out')
        return
    yield from _records(BytesIO(data), len(data), inside=True)


def _channel(record: ChannelRecord, schemas: dict[int, Schema]) -> Channel:
    schema = schemas.get(record.schema_id)
    kind = '' if schema is None else schema.name
    text = ''
    if schema is not None and schema.encoding == 'ros2msg':
        with suppress(UnicodeDecodeError):
            text = schema.data.decode()
    return channel_of(record.topic, kind, text, record.metadata.get('offered_qos_profiles', ''))
