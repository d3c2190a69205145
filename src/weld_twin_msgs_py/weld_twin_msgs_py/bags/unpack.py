# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Unpacking what a bag holds compressed, up to a size that can be meant.

A kilobyte of zstd can stand for gigabytes. rosbags unpacks whatever it finds, so the two unpackers
it looks up by name are replaced by these.
"""

from __future__ import annotations

import errno
import shutil
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
_HEAD = 18
"""Bytes of the longest header of a zstd frame (RFC 8878), which may tell the size of its content."""
_PIECE = 1 << 20
"""Bytes read at once."""


def allowed(packed: int) -> int:
    """Return how many bytes may come out of so many."""
    return min(max(SMALL, RATIO * packed), MOST)


def unzstd(data: bytes, size: int | None = None) -> bytes:
    """
    Return the content of a zstd frame.

    Raises DataError: it is larger than declared or than can be meant.

    size: what is declared beside it.
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

    Raises DataError: it holds more than can be meant, or than there is room for.
    """
    most = max(SMALL, RATIO * packed.stat().st_size)
    free = shutil.disk_usage(out.parent).free
    with packed.open('rb') as raw:
        reported = zstd.get_frame_info(raw.read(_HEAD)).decompressed_size or 0
    if reported > most:
        raise _bomb()
    if reported > free:
        raise _no_room(packed, out, f'unpacks to {reported / 1e9:.1f} GB')
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
