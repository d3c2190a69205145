# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Storage files one after the other in one directory, and the metadata.yaml that lists them."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from .segment import Channel, Segment, sync

INFORMATION = 'rosbag2_bagfile_information'
METADATA = 'metadata.yaml'


class Segments:
    """
    The storage files of a bag, NAME_0, NAME_1 and so on.

    The one that grows lies in a directory of its own and joins the others when it is complete.

    folder: directory of the bag; exists.
    name: what the files are called.
    """

    def __init__(self, folder: Path, name: str, storage: str) -> None:
        self.folder = folder
        self._name = name
        self._storage = storage
        self._complete: list[dict[str, Any]] = []
        self.growing = self._next()

    def write(self, channel: Channel, data: bytes, log_ns: int) -> None:
        """Write a serialised message."""
        self.growing.write(channel, data, log_ns)

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

    def abort(self) -> None:
        """Let go of everything as it is."""
        self.growing.abort()

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
