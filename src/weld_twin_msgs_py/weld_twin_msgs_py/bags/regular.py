# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The usual bag, read by the thousand.

In most bags every message of a topic has the layout of the first, stamps increase, and numbers are
finite. Such a topic is read as columns; whatever is not as usual in any message is left to the
reader that takes them one by one, so that both give the same samples and the same refusals.
"""

from array import array
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.recording import COLDEST, HOTTEST

from ..assembly import Intake, Role, Samples
from ..assembly.frames import OtherFrame
from ..assembly.intake import UNIT, Late
from ..assembly.joint_states import Incomplete, Missing
from ..messages.cdr import Layout, layout_of
from ..messages.from_messages import NANOSECONDS, VARIANCES, Unstamped
from .reader import BagReader

MOST = 300
"""Messages of a topic that are read at once: some 70 kB of joint states, and little of the largest."""


class Unusual(Exception):
    """The messages are not as usual: they are to be read one by one."""


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
        """Count a message that gives no sample, by what is wrong with it."""
        if isinstance(error, Unstamped):
            self._unstamped += 1
        elif isinstance(error, Late):
            if error.behind > CLOCK_JUMP:
                raise self.jumped(error.behind)
            self._repeated += error.behind == 0
            self._late += error.behind > 0
        else:
            sentence = f"message {self.messages - 1} of '{self.topic}': {error}"
            count, first = self._other.get(type(error), (0, sentence))
            self._other[type(error)] = count + 1, first

    def jumped(self, back: int) -> DataError:
        """Return the error of a clock that was set back by so much [ns] at the last message."""
        return DataError(
            f"the stamps of '{self.topic}' jump back by {back * 1e-9:.3f} s at message "
            f'{self.messages - 1}: the clock was set or the bag holds two runs; cut it there'
        )

    def samples(self) -> Samples:
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


class _Topic:
    """One topic while it is read: the layout of its first message, and where the joints are."""

    def __init__(self, stream: Stream, role: Role, kind: str) -> None:
        self.stream, self._role, self._kind = stream, role, kind
        self._layout: Layout | None = None
        self._index: list[int] = []
        self._last = 0
        self._waiting: list[bytes] = []

    def take(self, kind: str, data: bytes, bag: BagReader, intake: Intake) -> None:
        """Take a message; raise Unusual where one has to be looked at by itself."""
        if kind != self._kind:
            raise Unusual
        self._waiting.append(data)
        if len(self._waiting) == MOST:
            self.read_waiting(bag, intake)

    def read_waiting(self, bag: BagReader, intake: Intake) -> None:
        """Read the messages that wait; raise Unusual where one has to be looked at by itself."""
        data, self._waiting = self._waiting, []
        if not data:
            return
        first = self._first(data[0], bag, intake) if self._layout is None else None
        if self._layout is None or {*map(len, data)} != {self._layout.size}:
            raise Unusual
        block = np.frombuffer(b''.join(data), np.uint8).reshape(len(data), -1)
        read = self._layout.columns(block)
        if read is None:
            raise Unusual
        ns, runs = read
        if ns[0] <= self._last or (np.diff(ns) <= 0).any():
            raise Unusual
        rows = (
            _joint_rows(runs, self._index, self.stream.width)
            if self._index
            else _ROWS[self._role](runs[0])
        )
        if first is not None and not np.array_equal(rows[0], first, equal_nan=True):
            raise Unusual
        self._last = int(ns[-1])
        self.stream.messages += ns.size
        self.stream.extend(ns, rows)

    def _first(self, data: bytes, bag: BagReader, intake: Intake) -> Array:
        """Return the row of the first message, as the intake takes it."""
        message = bag.decoded(data, self._kind)
        try:
            taken = intake.take(self._role, message)
        except LEFT_OUT:
            raise Unusual from None
        if taken is None:
            raise Unusual
        self._layout = layout_of(self._kind, data)
        self.stream.frames.add(message.header.frame_id)
        if self._role is Role.JOINTS:
            names = list(message.name)
            self._index = [names.index(name) for name in intake.joints.names]
        return taken.row


def fill_regular(
    bag: BagReader, roles: Mapping[str, Role], streams: Mapping[Role, Stream], intake: Intake
) -> bool:
    """
    Fill the empty columns of topics if all are as usual; return whether that is so.

    Where they do not, the columns and the intake are to be thrown away.
    """
    topics = {
        topic: _Topic(streams[role], role, bag.topics[topic][0]) for topic, role in roles.items()
    }
    try:
        for topic, kind, _, data in bag.raw(topics):
            topics[topic].take(kind, data, bag, intake)
        for each in topics.values():
            each.read_waiting(bag, intake)
    except Exception:  # whatever is wrong with the bag, the other reader has the sentence for it
        return False
    return all(len(streams[role]) == bag.topics[topic][1] for topic, role in roles.items())


def _joint_rows(runs: list[Array], index: list[int], width: int) -> Array:
    """Return positions, velocities (none where one lacks) and, in rows so wide, efforts."""
    position, velocity = runs[0][:, index], runs[1]
    if velocity.shape[1] == runs[0].shape[1]:
        velocity = velocity[:, index]
        velocity[np.isnan(velocity).any(axis=1)] = np.nan
        if np.isinf(velocity).any():
            raise Unusual
    else:
        velocity = np.full_like(position, np.nan)
    rows = [_finite(position), velocity]
    if width > 2 * len(index):
        if runs[2].shape[1] != runs[0].shape[1]:
            raise Unusual
        rows.append(_finite(runs[2][:, index]))
    return np.hstack(rows)


def _pose_rows(values: Array) -> Array:
    pose = _finite(values[:, :7])
    if (np.abs(np.linalg.norm(pose[:, 3:], axis=1) - 1.0) >= UNIT).any():
        raise Unusual
    return np.column_stack([pose, _sigma(values[:, 7:]), values[:, 7:]])


def _sigma(covariance: Array) -> Array:
    """Return the deviation of positions; NaN without a covariance, or where it is left at zero."""
    if not covariance.size:
        return np.full(covariance.shape[0], np.nan)
    variances = _finite(covariance[:, VARIANCES])
    if (variances < 0.0).any():
        raise Unusual
    return np.where(variances.any(axis=1), np.sqrt(variances.mean(axis=1)), np.nan)


def _temperature_rows(values: Array) -> Array:
    degrees = _finite(values[:, :1])
    if (degrees < COLDEST).any() or (degrees > HOTTEST).any():
        raise Unusual
    return degrees


def _finite(values: Array) -> Array:
    if not np.isfinite(values).all():
        raise Unusual
    return values


_ROWS: Mapping[Role, Callable[[Any], Array]] = {
    Role.POSE: _pose_rows,
    Role.POINT: _finite,
    Role.SIGMA: _finite,
    Role.WRENCH: _finite,
    Role.TEMPERATURE: _temperature_rows,
}
"""From the doubles of a message to the row of its role, as `Intake` makes it of one message."""
