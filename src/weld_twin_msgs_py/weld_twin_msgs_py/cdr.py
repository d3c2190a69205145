# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Serialised messages to objects that `convert` reads, and poses to serialised messages.

A node reads its inputs here instead of in the middleware's typed take, for two reasons: bytes
that are no message become a sentence with every length checked against what is there, and a
joint state costs a tenth of the time.

References
----------
.. [1] OMG, "DDS Interoperability Wire Protocol (DDSI-RTPS)", 2.5, section 10 (plain CDR).

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from struct import Struct, error, pack, unpack_from
from typing import Any, NamedTuple

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from .convert import NANOSECONDS
from .messages import quaternion

HEADER = 4
"""Bytes of encapsulation before the first field; alignment counts from behind them."""
_STAMP_END = HEADER + 8


class Time(NamedTuple):
    """builtin_interfaces/Time or Duration."""

    sec: int
    nanosec: int


class Header(NamedTuple):
    """std_msgs/Header."""

    stamp: Time
    frame_id: str


class Xyz(NamedTuple):
    """geometry_msgs/Point or Vector3."""

    x: float
    y: float
    z: float


class Xyzw(NamedTuple):
    """geometry_msgs/Quaternion."""

    x: float
    y: float
    z: float
    w: float


class Pose(NamedTuple):
    """geometry_msgs/Pose."""

    position: Xyz
    orientation: Xyzw


class PoseStamped(NamedTuple):
    """geometry_msgs/PoseStamped."""

    header: Header
    pose: Pose


class PointStamped(NamedTuple):
    """geometry_msgs/PointStamped."""

    header: Header
    point: Xyz


class Vector3Stamped(NamedTuple):
    """geometry_msgs/Vector3Stamped."""

    header: Header
    vector: Xyz


class Wrench(NamedTuple):
    """geometry_msgs/Wrench."""

    force: Xyz
    torque: Xyz


class WrenchStamped(NamedTuple):
    """geometry_msgs/WrenchStamped."""

    header: Header
    wrench: Wrench


class Temperature(NamedTuple):
    """sensor_msgs/Temperature."""

    header: Header
    temperature: float
    variance: float


class JointState(NamedTuple):
    """sensor_msgs/JointState without the effort."""

    header: Header
    name: tuple[str, ...]
    position: tuple[float, ...]
    velocity: tuple[float, ...]


class TrajectoryPoint(NamedTuple):
    """trajectory_msgs/JointTrajectoryPoint."""

    positions: tuple[float, ...]
    velocities: tuple[float, ...]
    accelerations: tuple[float, ...]
    effort: tuple[float, ...]
    time_from_start: Time


class JointTrajectory(NamedTuple):
    """trajectory_msgs/JointTrajectory."""

    header: Header
    joint_names: tuple[str, ...]
    points: tuple[TrajectoryPoint, ...]


class Path(NamedTuple):
    """nav_msgs/Path."""

    header: Header
    poses: tuple[PoseStamped, ...]


class String(NamedTuple):
    """std_msgs/String."""

    data: str


class _Cursor:
    """Reads fields one after the other; never beyond the end."""

    def __init__(self, data: bytes) -> None:
        if len(data) < HEADER or data[0] != 0 or data[1] > 1:
            raise DataError('it does not begin as a serialised message does')
        self.data = data
        self.at = HEADER
        self._order = '<' if data[1] else '>'

    def _read(self, size: int, kind: str, count: int = 1) -> tuple[Any, ...]:
        self.at += -(self.at - HEADER) % size if count else 0
        out = unpack_from(f'{self._order}{count}{kind}', self.data, self.at)
        self.at += size * count
        return out

    def count(self, least: int) -> int:
        """Return a length that the bytes left can hold, each item having at least so many."""
        n = int(self._read(4, 'I')[0])
        if n * least > len(self.data) - self.at:
            raise DataError(f'it promises {n} items and has {len(self.data) - self.at} bytes left')
        return n

    def doubles(self, n: int) -> tuple[float, ...]:
        return self._read(8, 'd', n)

    def sequence(self) -> tuple[float, ...]:
        return self.doubles(self.count(8))

    def string(self) -> str:
        n = self.count(1)
        text = self.data[self.at : self.at + max(n - 1, 0)]
        self.at += n
        return bytes(text).decode()

    def strings(self) -> tuple[str, ...]:
        return tuple(self.string() for _ in range(self.count(4)))

    def time(self) -> Time:
        return Time(*self._read(4, 'i'), *self._read(4, 'I'))

    def header(self) -> Header:
        return Header(self.time(), self.string())

    def pose_stamped(self) -> PoseStamped:
        header, v = self.header(), self.doubles(7)
        return PoseStamped(header, Pose(Xyz(*v[:3]), Xyzw(*v[3:])))


class JointStateDecoder:
    """Decodes joint states; one that repeats its frame and names is read without parsing them."""

    _KEPT = 8

    def __init__(self) -> None:
        self._known: dict[bytes, tuple[str, tuple[str, ...], Struct, int]] = {}

    def __call__(self, data: bytes) -> JointState:
        """
        Return the joint state.

        Raises
        ------
        DataError
            The bytes are none.

        """
        for head, (frame, name, body, at) in self._known.items():
            if data.startswith(head, _STAMP_END) and len(data) >= at + body.size:
                sec, nanosec = _STAMP.unpack_from(data, HEADER)
                values = body.unpack_from(data, at)
                n = len(name)
                if values[n] == n and data[1] == 1 and data[0] == 0:
                    header = Header(Time(sec, nanosec), frame)
                    return JointState(header, name, values[:n], values[n + 2 :])
        state: JointState = decoded('sensor_msgs/msg/JointState', self._slow, data)
        return state

    def _slow(self, cursor: _Cursor) -> JointState:
        header, name = cursor.header(), cursor.strings()
        head_end = cursor.at
        position, velocity = cursor.sequence(), cursor.sequence()
        cursor.sequence()
        self._remember(cursor.data, head_end, header.frame_id, name, len(position), len(velocity))
        return JointState(header, name, position, velocity)

    def _remember(
        self, data: bytes, end: int, frame: str, name: tuple[str, ...], q: int, qd: int
    ) -> None:
        """Keep the bytes of frame, names and count, for a usual state: one position per name."""
        n = len(name)
        if q != n or qd != n or data[1] != 1:
            return
        counted = end + -(end - HEADER) % 4 + 4
        at = counted + -(counted - HEADER) % 8
        if len(self._known) >= self._KEPT:
            self._known.clear()
        # The velocities' count lies on a multiple of 8; behind it four bytes of padding.
        body = Struct(f'<{n}dII{n}d')
        self._known[bytes(data[_STAMP_END:counted])] = (frame, name, body, at)


_STAMP = Struct('<iI')


def _point(c: _Cursor) -> PointStamped:
    return PointStamped(c.header(), Xyz(*c.doubles(3)))


def _vector(c: _Cursor) -> Vector3Stamped:
    return Vector3Stamped(c.header(), Xyz(*c.doubles(3)))


def _wrench(c: _Cursor) -> WrenchStamped:
    header, v = c.header(), c.doubles(6)
    return WrenchStamped(header, Wrench(Xyz(*v[:3]), Xyz(*v[3:])))


def _temperature(c: _Cursor) -> Temperature:
    return Temperature(c.header(), *c.doubles(2))


def _trajectory(c: _Cursor) -> JointTrajectory:
    header, names = c.header(), c.strings()
    points = tuple(
        TrajectoryPoint(c.sequence(), c.sequence(), c.sequence(), c.sequence(), c.time())
        for _ in range(c.count(24))
    )
    return JointTrajectory(header, names, points)


def _path(c: _Cursor) -> Path:
    return Path(c.header(), tuple(c.pose_stamped() for _ in range(c.count(64))))


READERS: dict[str, Callable[[_Cursor], Any]] = {
    'geometry_msgs/msg/PoseStamped': _Cursor.pose_stamped,
    'geometry_msgs/msg/PointStamped': _point,
    'geometry_msgs/msg/Vector3Stamped': _vector,
    'geometry_msgs/msg/WrenchStamped': _wrench,
    'sensor_msgs/msg/Temperature': _temperature,
    'trajectory_msgs/msg/JointTrajectory': _trajectory,
    'nav_msgs/msg/Path': _path,
    'std_msgs/msg/String': lambda c: String(c.string()),
}


def decoded(kind: str, read: Callable[[_Cursor], Any], data: bytes) -> Any:
    """
    Return what a reader makes of a serialised message.

    Raises
    ------
    DataError
        The bytes are no message of the type.

    """
    try:
        return read(_Cursor(data))
    except (error, UnicodeDecodeError, DataError) as reason:
        raise DataError(
            f'{len(data)} bytes that are no {kind} ({reason}); something else publishes there'
        ) from None


def decoder(kind: str) -> Callable[[bytes], Any]:
    """Return what turns serialised messages of a type into objects for `convert`."""
    if kind == 'sensor_msgs/msg/JointState':
        return JointStateDecoder()
    read = READERS[kind]
    return lambda data: decoded(kind, read, data)


def checked(kind: str) -> Callable[[bytes], bytes]:
    """Return what hands serialised messages on after reading them, where the type is known."""
    if kind != 'sensor_msgs/msg/JointState' and kind not in READERS:
        return bytes
    decode = decoder(kind)

    def check(data: bytes) -> bytes:
        decode(data)
        return data

    return check


class PoseEncoder:
    """
    Serialises PoseStamped messages of one frame.

    Parameters
    ----------
    frame_id : str

    """

    def __init__(self, frame_id: str) -> None:
        self._head, self._body = _stamped(frame_id, '7d')

    def __call__(self, ns: int, position: Array, rotation: Array) -> bytes:
        """Return the message of a stamp [ns], a position (3,) [m] and a rotation (3, 3)."""
        return self._body.pack(
            b'\0\1\0\0', *divmod(ns, NANOSECONDS), self._head,
            *position.tolist(), *quaternion(rotation),
        )  # fmt: skip


class Vector3Encoder:
    """
    Serialises Vector3Stamped messages of one frame.

    Parameters
    ----------
    frame_id : str

    """

    def __init__(self, frame_id: str) -> None:
        self._head, self._body = _stamped(frame_id, '3d')

    def __call__(self, ns: int, vector: Array) -> bytes:
        """Return the message of a stamp [ns] and a vector (3,)."""
        return self._body.pack(
            b'\0\1\0\0', *divmod(ns, NANOSECONDS), self._head, *vector.tolist()
        )


class JointStateEncoder:
    """
    Serialises joint states of one set of joints, without frame or effort.

    Parameters
    ----------
    joint_names : sequence of str

    """

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
