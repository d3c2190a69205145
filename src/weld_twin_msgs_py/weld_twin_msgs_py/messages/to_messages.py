# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Arrays to messages of rclpy and rosbags, which both take the fields as keywords."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.recording import JointMotion

from .from_messages import NANOSECONDS
from .image_points import DOUBLE, FIELDS
from .topics import message_class

LEVELS = (b'\x00', b'\x01', b'\x02', b'\x03')
"""Levels of a DiagnosticStatus: ok, warn, error, stale."""


@dataclass(frozen=True)
class Messages:
    """Makes messages of one flavour; use `ros_messages` or `bag_messages`."""

    lookup: Callable[[str], Any]
    numbers: Callable[[Array], Any]
    level: Callable[[int], Any]

    def _make(self, kind: str, **fields: Any) -> Any:
        return self.lookup(kind)(**fields)

    def _stamped(self, kind: str, ns: int, frame_id: str, /, **fields: Any) -> Any:
        return self._make(kind, header=self.header(ns, frame_id), **fields)

    def time(self, ns: int) -> Any:
        """Return a builtin_interfaces/Time."""
        sec, nanosec = divmod(int(ns), NANOSECONDS)
        return self._make('builtin_interfaces/msg/Time', sec=sec, nanosec=nanosec)

    def header(self, ns: int, frame_id: str) -> Any:
        """Return a std_msgs/Header."""
        return self._make('std_msgs/msg/Header', stamp=self.time(ns), frame_id=frame_id)

    def joint_state(
        self,
        ns: int,
        names: Sequence[str],
        q: Array,
        qd: Array | None = None,
        frame_id: str = '',
        effort: Array | None = None,
    ) -> Any:
        """Return a JointState from positions, velocities, efforts, (n,) each [rad, rad/s, N m]."""
        empty = np.zeros(0)
        return self._stamped(
            'sensor_msgs/msg/JointState',
            ns,
            frame_id,
            name=list(names),
            position=self.numbers(np.asarray(q, dtype=np.float64)),
            velocity=self.numbers(empty if qd is None else np.asarray(qd, dtype=np.float64)),
            effort=self.numbers(empty if effort is None else np.asarray(effort, dtype=float)),
        )

    def _xyz(self, kind: str, value: Array) -> Any:
        x, y, z = (float(v) for v in value)
        return self._make(f'geometry_msgs/msg/{kind}', x=x, y=y, z=z)

    def pose(self, ns: int, position: Array, rotation: Array, frame_id: str = 'base') -> Any:
        """Return a PoseStamped from position (3,) [m] and rotation (3, 3)."""
        return self._stamped(
            'geometry_msgs/msg/PoseStamped', ns, frame_id, pose=self._pose(position, rotation)
        )

    def pose_with_covariance(
        self,
        ns: int,
        position: Array,
        rotation: Array,
        covariance: Array,
        frame_id: str = 'base',
    ) -> Any:
        """
        Return a PoseWithCovarianceStamped.

        covariance: position first [m^2], then turns about the fixed axes of the frame [rad^2].
        """
        inner = self._make(
            'geometry_msgs/msg/PoseWithCovariance',
            pose=self._pose(position, rotation),
            covariance=np.array(covariance, dtype=np.float64).reshape(36),
        )
        return self._stamped(
            'geometry_msgs/msg/PoseWithCovarianceStamped', ns, frame_id, pose=inner
        )

    def _pose(self, position: Array, rotation: Array) -> Any:
        x, y, z, w = quaternion(rotation)
        turned = self._make('geometry_msgs/msg/Quaternion', x=x, y=y, z=z, w=w)
        return self._make(
            'geometry_msgs/msg/Pose', position=self._xyz('Point', position), orientation=turned
        )

    def point(self, ns: int, position: Array, frame_id: str = 'base') -> Any:
        """Return a PointStamped, (3,) [m]."""
        return self._stamped(
            'geometry_msgs/msg/PointStamped', ns, frame_id, point=self._xyz('Point', position)
        )

    def vector3(self, ns: int, vector: Array, frame_id: str = 'base') -> Any:
        """Return a Vector3Stamped, (3,)."""
        return self._stamped(
            'geometry_msgs/msg/Vector3Stamped', ns, frame_id, vector=self._xyz('Vector3', vector)
        )

    def wrench(self, ns: int, wrench: Array, frame_id: str = 'tool') -> Any:
        """Return a WrenchStamped from force and torque, (6,) [N, N m]."""
        inner = self._make(
            'geometry_msgs/msg/Wrench',
            force=self._xyz('Vector3', wrench[:3]),
            torque=self._xyz('Vector3', wrench[3:]),
        )
        return self._stamped('geometry_msgs/msg/WrenchStamped', ns, frame_id, wrench=inner)

    def temperature(self, ns: int, celsius: float, frame_id: str = '') -> Any:
        """Return a Temperature [degC]; its variance is left unknown (zero)."""
        return self._stamped(
            'sensor_msgs/msg/Temperature', ns, frame_id, temperature=float(celsius), variance=0.0
        )

    def contact(self, ns: int, label: str, value: float = 0.0, sigma: float = 0.0) -> Any:
        """Return the Range of a contact: what is touched, a length and its deviation [m]."""
        return self._stamped(
            'sensor_msgs/msg/Range',
            ns,
            label,
            radiation_type=0,
            field_of_view=0.0,
            min_range=0.0,
            max_range=0.0,
            range=float(value),
            variance=float(sigma) ** 2,
        )

    def image_points(self, ns: int, camera: str, rows: Array) -> Any:
        """Return the PointCloud2 of an image; rows are (N, 4): target, point, u and v [px]."""
        data = np.ascontiguousarray(rows, dtype='<f8')
        fields = [
            self._make(
                'sensor_msgs/msg/PointField', name=name, offset=8 * k, datatype=DOUBLE, count=1
            )
            for k, name in enumerate(FIELDS)
        ]
        return self._stamped(
            'sensor_msgs/msg/PointCloud2',
            ns,
            camera,
            height=1,
            width=len(data),
            fields=fields,
            is_bigendian=False,
            point_step=8 * len(FIELDS),
            row_step=data.nbytes,
            data=np.frombuffer(data.tobytes(), np.uint8),
            is_dense=True,
        )

    def diagnostics(
        self,
        ns: int,
        name: str,
        values: Mapping[str, Any],
        level: int = 0,
        message: str = '',
        hardware_id: str = '',
    ) -> Any:
        """Return a DiagnosticArray with one status; numbers are written to round trip."""
        status = Status(name, level, message, values, hardware_id)
        return self.statuses(ns, [status])

    def statuses(self, ns: int, statuses: Sequence[Status]) -> Any:
        """Return a DiagnosticArray."""
        return self._stamped(
            'diagnostic_msgs/msg/DiagnosticArray',
            ns,
            '',
            status=[self._status(status) for status in statuses],
        )

    def _status(self, status: Status) -> Any:
        pairs = [
            self._make('diagnostic_msgs/msg/KeyValue', key=str(k), value=_text(v))
            for k, v in status.values.items()
        ]
        return self._make(
            'diagnostic_msgs/msg/DiagnosticStatus',
            level=self.level(status.level),
            name=status.name,
            message=status.message,
            hardware_id=status.hardware_id,
            values=pairs,
        )

    def trajectory_points(
        self, t: Array, q: Array, qd: Array | None = None, qdd: Array | None = None
    ) -> list[Any]:
        """Return JointTrajectoryPoints at times (N,) [s]; rates (N, n) where they are known."""
        out = []
        for k, since in enumerate(t):
            sec, nanosec = divmod(round(float(since) * NANOSECONDS), NANOSECONDS)
            rows = [np.zeros(0) if each is None else each[k] for each in (q, qd, qdd, None)]
            fields = ('positions', 'velocities', 'accelerations', 'effort')
            out.append(
                self._make(
                    'trajectory_msgs/msg/JointTrajectoryPoint',
                    **dict(zip(fields, map(self.numbers, rows), strict=True)),
                    time_from_start=self._make(
                        'builtin_interfaces/msg/Duration', sec=sec, nanosec=nanosec
                    ),
                )
            )
        return out

    def joint_trajectory(self, ns: int, names: Sequence[str], motion: JointMotion) -> Any:
        """Return a JointTrajectory of a motion; its first point is at time zero."""
        points = self.trajectory_points(motion.t - motion.t[0], motion.q, motion.velocity)
        return self._stamped(
            'trajectory_msgs/msg/JointTrajectory', ns, '', joint_names=list(names), points=points
        )

    def path(self, ns: int, poses: Array, frame_id: str = 'world') -> Any:
        """Return a Path through tool poses, shape (N, 4, 4)."""
        stamped = [self.pose(ns, T[:3, 3], T[:3, :3], frame_id) for T in poses]
        return self._stamped('nav_msgs/msg/Path', ns, frame_id, poses=stamped)

    def markers(self, ns: int, markers: Sequence[Lines], frame_id: str = 'world') -> Any:
        """Return a MarkerArray; each marker replaces the one of its name."""
        return self._make(
            'visualization_msgs/msg/MarkerArray',
            markers=[self._lines(ns, frame_id, item) for item in markers],
        )

    def _lines(self, ns: int, frame_id: str, lines: Lines) -> Any:
        kinds = self.lookup('visualization_msgs/msg/Marker')
        colors = [
            self._make('std_msgs/msg/ColorRGBA', r=float(r), g=float(g), b=float(b), a=1.0)
            for r, g, b in lines.colors
        ]
        return self._stamped(
            'visualization_msgs/msg/Marker',
            ns,
            frame_id,
            ns=lines.name,
            id=0,
            type=kinds.LINE_STRIP if lines.strip else kinds.LINE_LIST,
            action=kinds.ADD,
            pose=self._make('geometry_msgs/msg/Pose'),
            scale=self._xyz('Vector3', np.array([lines.width, 0.0, 0.0])),
            points=[self._xyz('Point', point) for point in lines.points],
            colors=colors,
        )


class Status(NamedTuple):
    """One status of a DiagnosticArray."""

    name: str
    level: int
    message: str
    values: Mapping[str, Any]
    hardware_id: str = ''


class Lines(NamedTuple):
    """A marker of lines."""

    name: str
    points: Array  # shape (N, 3) [m]
    colors: Array  # red, green, blue of each point, 0 to 1, shape (N, 3)
    width: float  # [m]
    strip: bool  # one line through all points, or one between each two


def quaternion(rotation: Array) -> list[float]:
    """
    Return the quaternion x y z w, w >= 0, of one rotation (3, 3), as Shepperd does (1978).

    In plain numbers: a live node makes one per sample, and scipy takes a third of a millisecond.
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation.tolist()
    trace = xx + yy + zz
    # Dividing by the largest part of the quaternion loses no digits.
    if trace > max(xx, yy, zz):
        x, y, z, w = zy - yz, xz - zx, yx - xy, 1.0 + trace
    elif xx >= yy and xx >= zz:
        x, y, z, w = 1.0 + 2.0 * xx - trace, xy + yx, xz + zx, zy - yz
    elif yy >= zz:
        x, y, z, w = xy + yx, 1.0 + 2.0 * yy - trace, yz + zy, xz - zx
    else:
        x, y, z, w = xz + zx, yz + zy, 1.0 + 2.0 * zz - trace, yx - xy
    length = sqrt(x * x + y * y + z * z + w * w)
    scale = -length if w < 0.0 else length
    return [x / scale, y / scale, z / scale, w / scale]


def _text(value: Any) -> str:
    return repr(float(value)) if isinstance(value, float | np.floating) else str(value)


def ros_messages() -> Messages:
    """Return the factory of rclpy messages; needs a ROS installation."""
    # rclpy refuses numpy arrays for sequences and wants a byte as bytes.
    lookup = cache(message_class)
    return Messages(lookup, lambda values: array('d', values), lambda level: LEVELS[level])


def bag_messages() -> Messages:
    """Return the factory of rosbags messages, the ones a `BagWriter` serialises."""
    from .typestore import TYPES

    return Messages(lambda kind: TYPES.types[kind], lambda values: values, lambda level: level)
