# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Writing a bag so that nothing half-written is ever found under its name."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from weld_twin_core.errors import DataError

from ..files.scratch import Scratch
from ..files.whole_files import followed, write_text
from ..messages.from_messages import stamp_ns
from ..messages.typestore import PROVENANCE_PREFIX, TYPES
from .segment import Channel, Segment, check_storage, clear_write_errors


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
