# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Serialised messages (plain CDR, DDSI-RTPS 2.5, section 10) to objects that `from_messages` reads.

Against the middleware's typed take, bytes that are no message become a sentence, and a joint state
costs a tenth of the time. The objects have the names and fields of the standard types. Arrays are
serialised here, too: with message objects it takes seven times as long.

A robot that moves sends the same message again and again: frame, names and counts stay, stamp and
numbers change, at places that the first message tells. Many of them are read as columns.
"""

from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from struct import Struct, error, pack, unpack_from
from typing import Any, ClassVar, NamedTuple

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from .from_messages import NANOSECONDS
from .to_messages import quaternion

Time = namedtuple('Time', 'sec nanosec')
"""Or a duration."""
Header = namedtuple('Header', 'stamp frame_id')
String = namedtuple('String', 'data')

Xyz = namedtuple('Xyz', 'x y z')
"""A Point or a Vector3."""
Xyzw = namedtuple('Xyzw', 'x y z w')
"""A Quaternion."""
Pose = namedtuple('Pose', 'position orientation')
PoseStamped = namedtuple('PoseStamped', 'header pose')
PoseWithCovariance = namedtuple('PoseWithCovariance', 'pose covariance')
PoseWithCovarianceStamped = namedtuple('PoseWithCovarianceStamped', 'header pose')
PointStamped = namedtuple('PointStamped', 'header point')
Vector3Stamped = namedtuple('Vector3Stamped', 'header vector')
Wrench = namedtuple('Wrench', 'force torque')
WrenchStamped = namedtuple('WrenchStamped', 'header wrench')
Transform = namedtuple('Transform', 'translation rotation')
TransformStamped = namedtuple('TransformStamped', 'header child_frame_id transform')
TFMessage = namedtuple('TFMessage', 'transforms')
Path = namedtuple('Path', 'header poses')

Temperature = namedtuple('Temperature', 'header temperature variance')
JointState = namedtuple('JointState', 'header name position velocity effort', defaults=((),))
TrajectoryPoint = namedtuple(
    'TrajectoryPoint', 'positions velocities accelerations effort time_from_start'
)
JointTrajectory = namedtuple('JointTrajectory', 'header joint_names points')


NUMBERS: Mapping[str, int] = {
    'geometry_msgs/msg/PoseStamped': 7,
    'geometry_msgs/msg/PoseWithCovarianceStamped': 43,
    'geometry_msgs/msg/PointStamped': 3,
    'geometry_msgs/msg/Vector3Stamped': 3,
    'geometry_msgs/msg/WrenchStamped': 6,
    'sensor_msgs/msg/Temperature': 2,
}
"""Types that are a header and so many doubles."""
HEADER = 4
"""Bytes of encapsulation before the first field; alignment counts from behind them."""
_MORE = 12
"""Bytes behind what was read that hold an effort at least: its count, padding, one number."""
_STAMP_END = HEADER + 8
"""Where the frame name begins: behind seconds and nanoseconds."""


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


class _Kept(NamedTuple):
    """How to read joint states like one that came: where numbers begin and end; efforts among them."""

    frame: str
    name: tuple[str, ...]
    body: Struct
    at: int
    end: int
    efforts: bool


class JointStateDecoder:
    """Decodes joint states; one that repeats its frame and names is read without parsing them."""

    _KEPT = 8

    def __init__(self) -> None:
        self._known: dict[bytes, _Kept] = {}

    def __call__(self, data: bytes) -> JointState:
        for head, (frame, name, body, at, end, moving) in self._known.items():
            if data.startswith(head, _STAMP_END) and 0 <= len(data) - end < _MORE:
                sec, nanosec = _STAMP.unpack_from(data, HEADER)
                values = body.unpack_from(data, at)
                n = len(name)
                velocity = values[n + 2 : 2 * n + 2] if moving else values[n + 2 :]
                if values[n] == len(velocity) and data[1] == 1 and data[0] == 0:
                    header = Header(Time(sec, nanosec), frame)
                    if not moving:
                        return JointState(header, name, values[:n], velocity)
                    if values[2 * n + 2] == n:
                        return JointState(header, name, values[:n], velocity, values[2 * n + 4 :])
        state: JointState = decoded('sensor_msgs/msg/JointState', self._slow, data)
        return state

    def _slow(self, cursor: _Cursor) -> JointState:
        header, name = cursor.header(), cursor.strings()
        head_end = cursor.at
        position, velocity, effort = cursor.sequence(), cursor.sequence(), cursor.sequence()
        if len(effort) in (0, len(name)) and not (effort and not velocity):
            counts = len(position), len(velocity), len(effort)
            self._remember(cursor.data, head_end, header.frame_id, name, counts)
        return JointState(header, name, position, velocity, effort)

    def _remember(
        self,
        data: bytes,
        end: int,
        frame: str,
        name: tuple[str, ...],
        counts: tuple[int, int, int],
    ) -> None:
        """Keep the bytes of frame, names and count: of one position per name, one velocity or none."""
        n, (q, qd, effort) = len(name), counts
        if q != n or qd not in (0, n) or data[1] != 1:
            return
        counted = end + -(end - HEADER) % 4 + 4
        at = counted + -(counted - HEADER) % 8
        if len(self._known) >= self._KEPT:
            self._known.clear()
        # The velocities' count lies on a multiple of 8; behind it four bytes of padding.
        body = Struct(f'<{n}dII{n}d' + (f'II{n}d' if effort else '') if qd else f'<{n}dI')
        self._known[bytes(data[_STAMP_END:counted])] = _Kept(
            frame, name, body, at, at + body.size, bool(effort)
        )


_STAMP = Struct('<iI')


def first_time_ns(data: bytes | bytearray | memoryview) -> int:
    """Return the stamp [ns] of a serialised message that begins with a header."""
    sec, nanosec = unpack_from('<iI' if data[1] else '>iI', data, HEADER)
    return int(sec) * NANOSECONDS + int(nanosec)


def _stamped(kind: str, make: Callable[[Header, tuple[float, ...]], Any]) -> dict[str, Any]:
    """Return what reads a type that is a header and so many doubles, by its name."""
    return {kind: lambda c: make(c.header(), c.doubles(NUMBERS[kind]))}


def _pose(v: tuple[float, ...]) -> Pose:
    return Pose(Xyz(*v[:3]), Xyzw(*v[3:7]))


def _transform(c: _Cursor) -> TransformStamped:
    header, child, v = c.header(), c.string(), c.doubles(7)
    return TransformStamped(header, child, Transform(Xyz(*v[:3]), Xyzw(*v[3:])))


def _trajectory(c: _Cursor) -> JointTrajectory:
    header, names = c.header(), c.strings()
    points = tuple(
        TrajectoryPoint(c.sequence(), c.sequence(), c.sequence(), c.sequence(), c.time())
        for _ in range(c.count(24))
    )
    return JointTrajectory(header, names, points)


def _path(c: _Cursor) -> Path:
    pose = READERS['geometry_msgs/msg/PoseStamped']
    return Path(c.header(), tuple(pose(c) for _ in range(c.count(64))))


READERS: dict[str, Callable[[_Cursor], Any]] = {
    **_stamped('geometry_msgs/msg/PoseStamped', lambda h, v: PoseStamped(h, _pose(v))),
    **_stamped(
        'geometry_msgs/msg/PoseWithCovarianceStamped',
        lambda h, v: PoseWithCovarianceStamped(h, PoseWithCovariance(_pose(v), v[7:])),
    ),
    **_stamped('geometry_msgs/msg/PointStamped', lambda h, v: PointStamped(h, Xyz(*v))),
    **_stamped('geometry_msgs/msg/Vector3Stamped', lambda h, v: Vector3Stamped(h, Xyz(*v))),
    **_stamped(
        'geometry_msgs/msg/WrenchStamped',
        lambda h, v: WrenchStamped(h, Wrench(Xyz(*v[:3]), Xyz(*v[3:]))),
    ),
    **_stamped('sensor_msgs/msg/Temperature', lambda h, v: Temperature(h, *v)),
    'geometry_msgs/msg/TransformStamped': _transform,
    'trajectory_msgs/msg/JointTrajectory': _trajectory,
    'nav_msgs/msg/Path': _path,
    'tf2_msgs/msg/TFMessage': lambda c: TFMessage(
        tuple(_transform(c) for _ in range(c.count(64)))
    ),
    'std_msgs/msg/String': lambda c: String(c.string()),
}


def decoded(kind: str, read: Callable[[_Cursor], Any], data: bytes) -> Any:
    """Return what a reader makes of a serialised message."""
    try:
        return read(_Cursor(data))
    except (error, UnicodeDecodeError, DataError) as reason:
        raise DataError(
            f'{len(data)} bytes that are no {kind} ({reason}); something else publishes there'
        ) from None


def decoder(kind: str) -> Callable[[bytes], Any]:
    """Return what turns serialised messages of a type into objects for `from_messages`."""
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


JOINT_STATE = 'sensor_msgs/msg/JointState'
_LITTLE_ENDIAN = b'\x00\x01'
"""How plain CDR with the low byte first begins; all senders in use write it."""
_STAMP_AT = slice(HEADER, HEADER + 8)
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
        stamp = np.ascontiguousarray(block[:, _STAMP_AT])
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
        out[:, _STAMP_AT] = np.column_stack([seconds, rest]).astype('<u4').view(np.uint8)
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
