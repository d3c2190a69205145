# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Arrays to serialised messages, for what a node sends with every sample.

Plain CDR as in `cdr`; making the message object first takes seven times as long.
"""

from __future__ import annotations

from collections.abc import Sequence
from struct import Struct, pack

from weld_twin_core.arrays import Array

from .from_messages import NANOSECONDS
from .to_messages import quaternion


class PoseEncoder:
    """Serialises PoseStamped messages of one frame."""

    def __init__(self, frame_id: str) -> None:
        self._head, self._body = _stamped(frame_id, '7d')

    def __call__(self, ns: int, position: Array, rotation: Array) -> bytes:
        """Return the message of a stamp [ns], a position (3,) [m] and a rotation (3, 3)."""
        return self._body.pack(
            b'\0\1\0\0',
            *divmod(ns, NANOSECONDS),
            self._head,
            *position.tolist(),
            *quaternion(rotation),
        )


class PoseCovarianceEncoder:
    """Serialises PoseWithCovarianceStamped messages of one frame."""

    def __init__(self, frame_id: str) -> None:
        self._head, self._body = _stamped(frame_id, '43d')

    def __call__(self, ns: int, position: Array, rotation: Array, covariance: Array) -> bytes:
        """Return the message of a stamp [ns], (3,) [m], (3, 3) and (6, 6) [m^2, rad^2]."""
        return self._body.pack(
            b'\0\1\0\0',
            *divmod(ns, NANOSECONDS),
            self._head,
            *position.tolist(),
            *quaternion(rotation),
            *covariance.ravel().tolist(),
        )


class Vector3Encoder:
    """Serialises Vector3Stamped messages of one frame."""

    def __init__(self, frame_id: str) -> None:
        self._head, self._body = _stamped(frame_id, '3d')

    def __call__(self, ns: int, vector: Array) -> bytes:
        """Return the message of a stamp [ns] and a vector (3,)."""
        return self._body.pack(b'\0\1\0\0', *divmod(ns, NANOSECONDS), self._head, *vector.tolist())


class TwistEncoder:
    """Serialises TwistStamped messages of one frame."""

    def __init__(self, frame_id: str) -> None:
        self._head, self._body = _stamped(frame_id, '6d')

    def __call__(self, ns: int, twist: Array) -> bytes:
        """Return the message of a stamp [ns] and a way and turn (6,), linear part first."""
        return self._body.pack(b'\0\1\0\0', *divmod(ns, NANOSECONDS), self._head, *twist.tolist())


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
        start = (b'\0\1\0\0', *divmod(ns, NANOSECONDS), self._head, *q.tolist())
        if qd is None:
            return self._alone.pack(*start, 0, 0)
        return self._both.pack(*start, self._count, *qd.tolist(), 0)


def _stamped(frame_id: str, values: str) -> tuple[bytes, Struct]:
    """Return the serialised frame, padded for doubles behind it, and the whole message."""
    frame = frame_id.encode() + b'\0'
    head = pack(f'<I{len(frame)}s', len(frame), frame)
    head += bytes(-len(head) % 8)  # the stamp before it takes eight
    return head, Struct(f'<4siI{len(head)}s{values}')
