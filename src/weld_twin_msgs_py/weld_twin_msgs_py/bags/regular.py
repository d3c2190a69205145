# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The usual bag, read by the thousand.

In most bags every message of a topic has the layout of the first, stamps increase, and numbers are
finite. Such a topic is read as columns. The first message goes through the same intake as in a
running node; whatever is not as usual in any other one is left to the reader that takes every
message by itself, so that both give the same samples and the same refusals.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from weld_twin_core.arrays import Array

from ..assembly import Intake, Role
from ..assembly.intake import UNIT
from ..messages.from_messages import COLDEST, HOTTEST, VARIANCES
from ..messages.layout import Layout, layout_of
from .blocks import Unusual, blocks
from .columns import LEFT_OUT, Stream
from .reader import BagReader


class _Topic:
    """One topic while it is read: the layout of its first message, and where the joints are."""

    def __init__(self, stream: Stream, role: Role, kind: str) -> None:
        self.stream, self._role, self._kind = stream, role, kind
        self._layout: Layout | None = None
        self._index: list[int] = []
        self._last = 0

    def take(self, block: np.ndarray, bag: BagReader, intake: Intake) -> None:
        """
        Take messages, shape (N, size).

        Raises Unusual: one of them has to be looked at by itself.
        """
        first = self._first(block, bag, intake) if self._layout is None else None
        if self._layout is None or block.shape[1] != self._layout.size:
            raise Unusual
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

    def _first(self, block: np.ndarray, bag: BagReader, intake: Intake) -> Array:
        """Return the row of the first message, as the intake takes it."""
        data = block[0].tobytes()
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
    Fill the columns of some topics, if all of them are as usual.

    bag: open.
    streams: empty; to be thrown away, with the intake, where this fails.

    Returns
    -------
    bool
        Whether they hold the whole recording now.

    """
    topics = {
        topic: _Topic(streams[role], role, bag.topics[topic][0]) for topic, role in roles.items()
    }
    try:
        for reader in bag.plain_readers():
            wanted = {c.id: c.topic for c in reader.connections if c.topic in topics}
            if len(set(wanted.values())) < len(wanted):
                return False
            for topic, block in blocks(reader, wanted):
                topics[topic].take(block, bag, intake)
    except Exception:  # whatever is wrong with the bag, the other reader has the sentence for it
        return False
    return all(len(streams[role]) == bag.topics[topic][1] for topic, role in roles.items())


def _joint_rows(runs: list[Array], index: list[int], width: int) -> Array:
    """
    Return positions, velocities and, in rows so wide, efforts.

    A state that does not tell every velocity tells none.
    """
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
