# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The serialised messages of a storage file as blocks of bytes, a row each.

rosbags hands over one message after the other. Where an hour of motion waits to be read, that
alone takes seconds; so this reads what the storages hold by the thousand: the chunks of an mcap by
their index, and the rows of a database. What is not as usual is left to rosbags.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import islice
from struct import unpack_from
from typing import Any

import numpy as np
from rosbags.rosbag2 import Reader
from rosbags.rosbag2.storage_mcap import ChunkInfo, McapReader, decompress
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

ROWS = 300
"""Messages taken from a database at once: some 70 kB of joint states, and little of the largest."""
_MESSAGE, _INDEX = 5, 7
"""What the records of an mcap with a message, and with the index of a chunk, begin with."""
_RECORD = 1 + 8
"""Bytes before the content of a record of an mcap: what it is, and its length."""
_BEFORE_DATA = 2 + 4 + 8 + 8
"""Bytes before the message in its record: channel, number, two times."""
_LOG_TIME = _RECORD + 2 + 4
"""Where in its record the time is at which a message was recorded."""


class Unusual(Exception):
    """The file is not as usual: its messages are to be read one by one."""


def blocks(reader: Reader, topics: Mapping[int, str]) -> Iterator[tuple[str, np.ndarray]]:
    """
    Yield topic and messages, shape (N, size), in the order in which each topic was recorded.

    Raises Unusual: messages of a topic differ in size, were not recorded in order, or lie where
    the index does not tell.

    reader: open, of one storage file.
    topics: names by the number that connections have in it.
    """
    storage: Any = reader.storage
    if not isinstance(storage, McapReader | Sqlite3Reader):
        raise Unusual
    source = _of_mcap if isinstance(storage, McapReader) else _of_sqlite
    last = dict.fromkeys(topics, -1)
    for number, log_ns, block in source(storage, topics):
        if not log_ns.size:
            continue
        if log_ns[0] < last[number] or (np.diff(log_ns) < 0).any():
            raise Unusual
        last[number] = int(log_ns[-1])
        yield topics[number], block


def _of_sqlite(
    storage: Any, topics: Mapping[int, str]
) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    marks = ','.join('?' * len(topics))
    rows = storage.dbconn.execute(  # in this order rosbags reads them, so damage shows alike
        'SELECT topic_id, timestamp, data FROM messages '
        f'WHERE topic_id IN ({marks}) ORDER BY timestamp',
        tuple(topics),
    )
    while piece := list(islice(rows, ROWS)):
        of_row, times, data = zip(*piece, strict=True)
        if {*map(type, data)} != {bytes}:
            raise Unusual
        numbers = np.array(of_row)
        for number in {*of_row}:
            chosen = np.flatnonzero(numbers == number).tolist()
            own = [data[k] for k in chosen]
            if len({*map(len, own)}) > 1:
                raise Unusual
            block = np.frombuffer(b''.join(own), np.uint8).reshape(len(own), len(own[0]))
            yield number, np.array([times[k] for k in chosen], dtype=np.int64), block


def _of_mcap(
    storage: Any, topics: Mapping[int, str]
) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    if not storage.chunks:
        raise Unusual
    for chunk in sorted(storage.chunks, key=lambda each: each.message_start_time):
        if not any(chunk.channel_count.get(number, 0) for number in topics):
            continue
        data, at = _content(storage.bio, chunk), _indexed(storage.bio, chunk)
        sizes = _checked(data, chunk, at)
        for number in topics.keys() & at.keys():
            log_ns, block = _rows(data, at[number], sizes[number])
            if log_ns.min() < chunk.message_start_time or log_ns.max() > chunk.message_end_time:
                raise Unusual
            yield number, log_ns, block


def _content(file: Any, chunk: ChunkInfo) -> np.ndarray:
    """Return what a chunk holds, unpacked and with its checksum compared."""
    file.seek(chunk.chunk_start_offset + _RECORD)
    head = 40 + len(chunk.compression)
    packed = file.read(head + chunk.compressed_size)
    (checksum,) = unpack_from('<I', packed, 24)
    whole = decompress(packed[head:], chunk.compression, chunk.uncompressed_size, checksum)
    return np.frombuffer(whole, np.uint8)


def _indexed(file: Any, chunk: ChunkInfo) -> dict[int, np.ndarray]:
    """Return where the records of each channel begin in a chunk, in the order of the file."""
    out = {}
    for number, offset in chunk.message_index_offsets.items():
        file.seek(offset)
        head = file.read(_RECORD + 6)
        kind, length, channel, size = unpack_from('<BQHI', head)
        if (kind, channel) != (_INDEX, number) or length != size + 6:
            raise Unusual
        out[number] = np.sort(np.frombuffer(file.read(size), '<u8').reshape(-1, 2)[:, 1])
    return {number: at.astype(np.int64) for number, at in out.items() if at.size}


def _checked(
    data: np.ndarray, chunk: ChunkInfo, at: Mapping[int, np.ndarray]
) -> dict[int, np.ndarray]:
    """
    Return the sizes of the records of each channel.

    Raises Unusual: the index does not name every message of the chunk, or names what is none.
    """
    sizes = {}
    for number, begin in at.items():
        if begin[0] < 0 or begin[-1] + _RECORD + _BEFORE_DATA > data.size:
            raise Unusual
        channel = _field(data, begin + _RECORD, '<u2')
        if (data[begin] != _MESSAGE).any() or (channel != number).any():
            raise Unusual
        sizes[number] = _field(data, begin + 1, '<u8').astype(np.int64)
    begin = np.concatenate(list(at.values()))
    end = begin + _RECORD + np.concatenate([sizes[number] for number in at])
    order = np.argsort(begin)
    begin, end = np.append(begin[order], data.size), np.append(0, end[order])
    for k in np.flatnonzero(begin != end):
        _refuse_messages(data, int(end[k]), int(begin[k]))
    return sizes


def _refuse_messages(data: np.ndarray, at: int, end: int) -> None:
    """Walk through what lies between messages: schemas and channels, and no further message."""
    while at < end:
        if data[at] == _MESSAGE or at + _RECORD > end:
            raise Unusual
        at += _RECORD + int(_field(data, np.array([at + 1]), '<u8')[0])
    if at != end:
        raise Unusual


def _field(data: np.ndarray, at: np.ndarray, kind: str) -> np.ndarray:
    """Return a number of each record."""
    dtype = np.dtype(kind)
    window = np.lib.stride_tricks.sliding_window_view(data, dtype.itemsize)
    return np.ascontiguousarray(window[at]).view(dtype)[:, 0]


def _rows(data: np.ndarray, at: np.ndarray, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return when the messages of a channel were recorded [ns], and the messages."""
    size = int(sizes[0]) - _BEFORE_DATA
    if size < 0 or (sizes != sizes[0]).any():
        raise Unusual
    log_ns = _field(data, at + _LOG_TIME, '<u8').astype(np.int64)
    window = np.lib.stride_tricks.sliding_window_view(data, size)
    return log_ns, window[at + _RECORD + _BEFORE_DATA]
