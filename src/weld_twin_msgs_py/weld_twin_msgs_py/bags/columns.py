# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Growing columns of stamped numbers, and what to do with stamps that repeat or go back."""

from __future__ import annotations

from array import array
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

CLOCK_JUMP = 1_000_000_000
"""A step back by more than this [ns] is a clock that was set, not a late packet."""


class Samples(NamedTuple):
    """Stamps, shape (N,) [int64 ns], strictly increasing, and values, shape (N, width)."""

    ns: np.ndarray
    values: Array
    notes: tuple[str, ...]


class Stream:
    """Samples of one topic; memory is 8 bytes per number, whatever the message weighs."""

    def __init__(self, topic: str, width: int) -> None:
        self.topic = topic
        self.width = width
        self.unstamped = 0
        self.frames: set[str] = set()
        self._ns = array('q')
        self._values = array('d')

    def __len__(self) -> int:
        """Return the number of samples so far."""
        return len(self._ns)

    def append(self, ns: int, values: Iterable[float]) -> None:
        """Add one sample."""
        self._ns.append(ns)
        self._values.extend(values)

    def samples(self) -> Samples:
        """
        Return the samples in the order of their stamps.

        Late packets are put in order and repeated stamps dropped, both with a note.

        Raises
        ------
        DataError
            No message has a stamp, or the clock jumped back during the recording.

        """
        if self.unstamped and not len(self):
            raise DataError(
                f"header.stamp is unset in all {self.unstamped} messages of '{self.topic}'; set "
                'it where the sample is taken, the time of recording cannot stand in for it'
            )
        ns = np.frombuffer(self._ns, dtype=np.int64)
        values = np.frombuffer(self._values, dtype=np.float64).reshape(-1, self.width)
        notes = []
        if self.unstamped:
            notes.append(f"{self.unstamped} messages of '{self.topic}' without a stamp dropped")
        late = np.flatnonzero(np.diff(ns) < 0)
        if late.size:
            self._refuse_jump(ns)
            order = np.argsort(ns, kind='stable')
            ns, values = ns[order], values[order]
            notes.append(f"{late.size} late messages of '{self.topic}' put in order")
        fresh = np.concatenate([[True], np.diff(ns) > 0]) if ns.size else np.zeros(0, bool)
        if not fresh.all():
            count = int((~fresh).sum())
            notes.append(f"{count} messages of '{self.topic}' with a repeated stamp dropped")
        if len(self.frames) > 1:
            notes.append(f"'{self.topic}' changes its frame_id: {', '.join(sorted(self.frames))}")
        return Samples(ns[fresh], values[fresh], tuple(notes))

    def _refuse_jump(self, ns: np.ndarray) -> None:
        back = np.maximum.accumulate(ns) - ns
        k = int(back.argmax())
        if back[k] > CLOCK_JUMP:
            raise DataError(
                f"the stamps of '{self.topic}' jump back by {back[k] * 1e-9:.3f} s at message "
                f'{k}: the clock was set or the bag holds two runs; cut it there'
            )
