# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Many serialised messages of one layout to columns of numbers and back, none decoded by itself.

A robot that moves sends the same message again and again: frame, names and counts stay, stamp and
numbers change, at places of plain CDR (DDSI-RTPS 2.5, section 10) that the first message tells.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from weld_twin_core.arrays import Array

from .cdr_read import HEADER, NUMBERS
from .from_messages import NANOSECONDS

JOINT_STATE = 'sensor_msgs/msg/JointState'
_LITTLE_ENDIAN = b'\x00\x01'
"""How plain CDR with the low byte first begins; all senders in use write it."""
_STAMP = slice(HEADER, HEADER + 8)
"""Seconds and nanoseconds."""


@dataclass(frozen=True)
class Layout:
    """Where in the messages of one kind the numbers are, and what is the same in all of them."""

    size: int  # bytes of a message
    same: tuple[tuple[int, bytes], ...]
    """What every message holds, and from which byte on. Padding is not among it: some senders
    leave there what was in memory."""
    doubles: tuple[tuple[int, int], ...]
    """Where runs of doubles begin, and how many they are."""

    def columns(self, block: np.ndarray) -> tuple[np.ndarray, list[Array]] | None:
        """
        Return stamps (N,) [ns] and runs of doubles (N, count) of messages (N, size).

        None where a message is of another layout.
        """
        for at, fixed in self.same:
            if (block[:, at : at + len(fixed)] != np.frombuffer(fixed, np.uint8)).any():
                return None
        stamp = np.ascontiguousarray(block[:, _STAMP])
        seconds = stamp.view('<i4')[:, 0].astype(np.int64)
        ns = seconds * NANOSECONDS + stamp.view('<u4')[:, 1]
        runs = [
            np.ascontiguousarray(block[:, at : at + 8 * count]).view('<f8')
            for at, count in self.doubles
        ]
        return ns, runs

    def filled(self, data: bytes, ns: np.ndarray, runs: Sequence[Array]) -> np.ndarray:
        """Return messages (N, size) like one of this layout, with other stamps [ns] and runs."""
        out = np.tile(np.frombuffer(data, np.uint8), (ns.size, 1))
        seconds, rest = np.divmod(ns, NANOSECONDS)
        out[:, _STAMP] = np.column_stack([seconds, rest]).astype('<u4').view(np.uint8)
        for (at, count), run in zip(self.doubles, runs, strict=True):
            if count:
                values = np.ascontiguousarray(run, dtype='<f8').reshape(ns.size, count)
                out[:, at : at + 8 * count] = values.view(np.uint8)
        return out


class _Walk:
    """Goes through one message that is known to be whole, and notes what lies where."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = HEADER + 8
        self.same = [(0, _LITTLE_ENDIAN)]
        self.doubles: list[tuple[int, int]] = []

    def count(self) -> int:
        self._align(4)
        return int.from_bytes(self._keep(4), 'little')

    def string(self) -> None:
        self._keep(self.count())

    def numbers(self, count: int) -> None:
        if count:
            self._align(8)
        self.doubles.append((self._at, count))
        self._at += 8 * count

    def _keep(self, size: int) -> bytes:
        fixed = self._data[self._at : self._at + size]
        self.same.append((self._at, fixed))
        self._at += size
        return fixed

    def _align(self, size: int) -> None:
        self._at += -(self._at - HEADER) % size


def layout_of(kind: str, data: bytes) -> Layout | None:
    """Return the layout of a message that can be decoded; None where it has none."""
    if data[:2] != _LITTLE_ENDIAN or (kind != JOINT_STATE and kind not in NUMBERS):
        return None
    walk = _Walk(data)
    walk.string()
    if kind == JOINT_STATE:
        for _ in range(walk.count()):
            walk.string()
        for _ in range(3):
            walk.numbers(walk.count())
    else:
        walk.numbers(NUMBERS[kind])
    return Layout(len(data), tuple(walk.same), tuple(walk.doubles))
