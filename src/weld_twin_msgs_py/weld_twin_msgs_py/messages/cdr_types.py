# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages as `cdr_read` reads them: the fields of the standard types, immutable."""

from __future__ import annotations

from typing import NamedTuple


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


class PoseWithCovariance(NamedTuple):
    """geometry_msgs/PoseWithCovariance."""

    pose: Pose
    covariance: tuple[float, ...]


class PoseWithCovarianceStamped(NamedTuple):
    """geometry_msgs/PoseWithCovarianceStamped."""

    header: Header
    pose: PoseWithCovariance


class Transform(NamedTuple):
    """geometry_msgs/Transform."""

    translation: Xyz
    rotation: Xyzw


class TransformStamped(NamedTuple):
    """geometry_msgs/TransformStamped."""

    header: Header
    child_frame_id: str
    transform: Transform


class TFMessage(NamedTuple):
    """tf2_msgs/TFMessage."""

    transforms: tuple[TransformStamped, ...]


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
    """sensor_msgs/JointState."""

    header: Header
    name: tuple[str, ...]
    position: tuple[float, ...]
    velocity: tuple[float, ...]
    effort: tuple[float, ...] = ()


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
