# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Arrays to serialised messages: with message objects it takes seven times as long."""

from collections.abc import Sequence
from struct import Struct, pack
from typing import ClassVar

from weld_twin_core.arrays import Array

from .from_messages import NANOSECONDS
from .to_messages import quaternion

_BEGIN = b'\0\1\0\0'
"""How plain CDR with the low byte first begins."""


class _Stamped:
    """Serialises messages of one frame that are a header and so many doubles."""

    numbers: ClassVar[int]

    def __init__(self, frame_id: str) -> None:
        frame = frame_id.encode() + b'\0'
        head = pack(f'<I{len(frame)}s', len(frame), frame)
        self._head = head + bytes(-len(head) % 8)  # the stamp before it takes eight
        self._pack = Struct(f'<4siI{len(self._head)}s{self.numbers}d').pack


class PoseEncoder(_Stamped):
    """Serialises PoseStamped messages."""

    numbers = 7

    def __call__(self, ns: int, position: Array, rotation: Array) -> bytes:
        """Return the message of a stamp [ns], a position (3,) [m] and a rotation (3, 3)."""
        when, pose = divmod(ns, NANOSECONDS), (*position.tolist(), *quaternion(rotation))
        return self._pack(_BEGIN, *when, self._head, *pose)


class PoseCovarianceEncoder(_Stamped):
    """Serialises PoseWithCovarianceStamped messages."""

    numbers = 43

    def __call__(self, ns: int, position: Array, rotation: Array, covariance: Array) -> bytes:
        """Return the message of a stamp [ns], (3,) [m], (3, 3) and (6, 6) [m^2, rad^2]."""
        when, pose = divmod(ns, NANOSECONDS), (*position.tolist(), *quaternion(rotation))
        return self._pack(_BEGIN, *when, self._head, *pose, *covariance.ravel().tolist())


class Vector3Encoder(_Stamped):
    """Serialises Vector3Stamped messages."""

    numbers = 3

    def __call__(self, ns: int, vector: Array) -> bytes:
        """Return the message of a stamp [ns] and a vector, shape (numbers,)."""
        return self._pack(_BEGIN, *divmod(ns, NANOSECONDS), self._head, *vector.tolist())


class TwistEncoder(Vector3Encoder):
    """Serialises TwistStamped messages; the vector is a way and a turn."""

    numbers = 6


class JointStateEncoder:
    """Serialises joint states of one set of joints, without frame or effort."""

    def __init__(self, joint_names: Sequence[str]) -> None:
        head = pack('<I4sI', 1, b'', len(joint_names))
        for name in joint_names:
            text = name.encode() + b'\0'
            head += pack(f'<I{len(text)}s', len(text), text)
            head += bytes(-len(head) % 4)
        n = len(joint_names)
        head += pack('<I', n)
        self._head = head + bytes(-len(head) % 8)
        size = len(self._head)
        self._both = Struct(f'<4siI{size}s{n}dI4x{n}dI')
        self._alone = Struct(f'<4siI{size}s{n}dII')
        self._count = n

    def __call__(self, ns: int, q: Array, qd: Array | None = None) -> bytes:
        """Return the message of a stamp [ns], positions (n,) and velocities (n,) if known."""
        start = (_BEGIN, *divmod(ns, NANOSECONDS), self._head, *q.tolist())
        if qd is None:
            return self._alone.pack(*start, 0, 0)
        return self._both.pack(*start, self._count, *qd.tolist(), 0)
