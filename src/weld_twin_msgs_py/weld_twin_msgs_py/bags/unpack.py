# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Unpacking what a bag holds compressed, up to a size that can be meant.

A kilobyte of zstd can stand for gigabytes. rosbags unpacks whatever it finds, so the two unpackers
it looks up by name are replaced by these.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lz4.frame import LZ4FrameDecompressor
from rosbags.rosbag2 import storage_mcap

from weld_twin_core.errors import DataError

zstd: Any = storage_mcap.zstd  # type: ignore[attr-defined]
"""The one rosbags found; where it lies depends on the version of Python."""
RATIO = 200
"""Times smaller than its content that recorded motion ever gets."""
SMALL = 64_000_000
"""Bytes that are unpacked whatever the ratio."""
MOST = 2_000_000_000
"""Bytes that are never unpacked in memory."""
_PIECE = 1 << 20
"""Bytes read at once."""


def allowed(packed: int) -> int:
    """Return how many bytes may come out of so many."""
    return min(max(SMALL, RATIO * packed), MOST)


def unzstd(data: bytes, size: int | None = None) -> bytes:
    """
    Return the content of a zstd frame.

    Parameters
    ----------
    data : bytes
    size : int, optional
        What is declared beside it.

    Raises
    ------
    DataError
        It is larger than declared or than can be meant.

    """
    limit = _limit(data, size)
    return _whole(zstd.ZstdDecompressor().decompress(data, limit + 1), limit)


def unlz4(data: bytes, size: int | None = None) -> bytes:
    """Return the content of an lz4 frame; as `unzstd`."""
    limit = _limit(data, size)
    return _whole(LZ4FrameDecompressor().decompress(data, limit + 1), limit)


def unpack_file(packed: Path, out: Path) -> None:
    """
    Unpack a zstd file.

    Raises
    ------
    DataError
        It holds more than can be meant.

    """
    most = max(SMALL, RATIO * packed.stat().st_size)
    done = 0
    with packed.open('rb') as raw, zstd.open(raw, 'rb') as source, out.open('wb') as sink:
        while piece := source.read(_PIECE):
            done += len(piece)
            if done > most:
                raise _bomb()
            sink.write(piece)


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
