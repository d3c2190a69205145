# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Growing columns of stamped numbers, and a tally of the messages that gave none."""

from __future__ import annotations

from array import array
from collections.abc import Iterable

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from ..assembly import Samples
from ..assembly.frame_names import OtherFrame
from ..assembly.joint_states import Incomplete, Missing
from ..assembly.stamp_order import Late
from ..messages.from_messages import NANOSECONDS, Unstamped

CLOCK_JUMP = NANOSECONDS
"""A step back by more than this [ns] is a clock that was set, not a late packet."""

LEFT_OUT = (Unstamped, Late, Incomplete, OtherFrame)
"""What costs a sample and not the recording: the running nodes leave it out as well."""


class Stream:
    """Samples of one topic; memory is 8 bytes per number, whatever the message weighs."""

    def __init__(self, topic: str, width: int) -> None:
        self.topic = topic
        self.width = width
        self.messages = 0
        self.frames: set[str] = set()
        self._unstamped = self._late = self._repeated = 0
        self._other: dict[type[DataError], tuple[int, str]] = {}
        self._ns = array('q')
        self._values = array('d')

    def __len__(self) -> int:
        """Return the number of samples so far."""
        return len(self._ns)

    def append(self, ns: int, values: Iterable[float]) -> None:
        """Add one sample, later than the one before."""
        self._ns.append(ns)
        self._values.extend(values)

    def extend(self, ns: np.ndarray, rows: Array) -> None:
        """Add samples, shape (N,) and (N, width), later than those before."""
        self._ns.frombytes(np.ascontiguousarray(ns, dtype=np.int64).tobytes())
        self._values.frombytes(np.ascontiguousarray(rows, dtype=np.float64).tobytes())

    def leave_out(self, error: DataError) -> None:
        """
        Count a message that gives no sample, by what is wrong with it.

        Raises DataError: its stamp is so far behind that the clock was set.
        """
        if isinstance(error, Unstamped):
            self._unstamped += 1
        elif isinstance(error, Late):
            if error.behind > CLOCK_JUMP:
                raise self.jumped(error.behind)
            self._repeated += error.behind == 0
            self._late += error.behind > 0
        else:
            reported = f"message {self.messages - 1} of '{self.topic}': {error}"
            count, first = self._other.get(type(error), (0, reported))
            self._other[type(error)] = count + 1, first

    def jumped(self, back: int) -> DataError:
        """Return the error of a clock that was set back by so much [ns] at the last message."""
        return DataError(
            f"the stamps of '{self.topic}' jump back by {back * 1e-9:.3f} s at message "
            f'{self.messages - 1}: the clock was set or the bag holds two runs; cut it there'
        )

    def samples(self) -> Samples:
        """
        Return the samples.

        Raises DataError: there are none; the message says what all of its messages lack.
        """
        if not len(self):
            for _, sentence in self._other.values():
                raise DataError(sentence)
            if not self._unstamped:
                raise DataError(f"no message of '{self.topic}' gives a sample")
            raise DataError(
                f"header.stamp is unset in all {self._unstamped} messages of '{self.topic}'; set "
                'it where the sample is taken, the time of recording cannot stand in for it'
            )
        ns = np.frombuffer(self._ns, dtype=np.int64)
        return Samples(ns, np.frombuffer(self._values, dtype=np.float64).reshape(-1, self.width))

    def notes(self) -> tuple[str, ...]:
        """Return what was left out, and whether the frame changes."""
        counted = (
            (self._unstamped, 'without a stamp dropped'),
            (self._late, 'with a stamp before the last one dropped'),
            (self._repeated, 'with a repeated stamp dropped'),
            *(
                (count, f'left out, as {sentence}')
                for kind, (count, sentence) in self._other.items()
                if kind is not Missing  # the other publishers came a moment later
            ),
        )
        out = [f"{count} messages of '{self.topic}' {what}" for count, what in counted if count]
        if len(self.frames) > 1:
            out.append(f"'{self.topic}' changes its frame_id: {', '.join(sorted(self.frames))}")
        return tuple(out)
