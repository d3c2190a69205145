# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The one table of topics: name, type, quality of service, meaning.

Every publisher offers *reliable*, which every subscriber can take. A stream that may come from
somebody else's node is requested *best effort*: that matches both joint_state_broadcaster
(reliable) and sensor drivers (best effort), where a reliable request would silently receive
nothing from the latter. Queues are deep because samples are paired by stamp, so an old sample is
worth as much as a new one.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from weld_twin_core.cameras import Camera, Target

RELIABLE = 'reliable'
BEST_EFFORT = 'best_effort'
VOLATILE = 'volatile'
LATCHED = 'transient_local'


DEEP = 5000
"""
Samples of a stream that are kept for a reader that lacks some: five seconds at 1 kHz. Fast DDS
tells every 3 s what was sent, and a reader asks then for what was lost on the way or came before
it knew the writer; of a thousand kept, the first of a quick run were gone by then.
"""


@dataclass(frozen=True)
class Qos:
    """Quality of service: keep the last ``depth`` samples; for latecomers too where latched."""

    reliability: str
    depth: int
    durability: str = VOLATILE

    def to_rclpy(self) -> Any:
        """Return the rclpy profile; needs a ROS installation."""
        from rclpy.qos import (  # only nodes have rclpy
            DurabilityPolicy,
            HistoryPolicy,
            LivelinessPolicy,
            QoSProfile,
            ReliabilityPolicy,
        )

        return QoSProfile(
            history=HistoryPolicy.KEEP_LAST,
            depth=self.depth,
            reliability=ReliabilityPolicy[self.reliability.upper()],
            durability=DurabilityPolicy[self.durability.upper()],
            liveliness=LivelinessPolicy.AUTOMATIC,
        )


_UNSTAMPED = (
    'std_msgs/msg/String',
    'visualization_msgs/msg/MarkerArray',
    'tf2_msgs/msg/TFMessage',
)
"""Types of the table that begin with something else than a header."""


@dataclass(frozen=True)
class Topic:
    """One row of the table."""

    name: str
    type: str
    offered: Qos
    requested: Qos
    meaning: str
    steady: bool = True  # messages come on a beat, so that silence means something

    @property
    def stamped(self) -> bool:
        """Return whether its messages begin with a header."""
        return self.type not in _UNSTAMPED

    @property
    def relative(self) -> str:
        """Return the name that a node's namespace goes before, unless it is one for all."""
        return self.name if self.name in ONE_FOR_ALL else self.name.lstrip('/')

    def message_class(self) -> Any:
        """Return the rclpy message class; needs a ROS installation."""
        return message_class(self.type)


def message_class(kind: str) -> Any:
    """Return the rclpy class of a message type."""
    package, space, name = kind.split('/')
    try:
        return getattr(import_module(f'{package}.{space}'), name)
    except (ImportError, AttributeError):
        raise ImportError(
            f'the message type {kind} is not installed here; install the package {package}'
        ) from None


def _stream(name: str, kind: str, meaning: str, depth: int = DEEP) -> Topic:
    """Return a topic that anybody's node may publish."""
    return Topic(name, kind, Qos(RELIABLE, depth), Qos(BEST_EFFORT, depth), meaning)


def _result(
    name: str, kind: str, meaning: str, depth: int = DEEP, *, steady: bool = True
) -> Topic:
    """Return a topic that only this project's nodes publish."""
    return Topic(name, kind, Qos(RELIABLE, depth), Qos(RELIABLE, depth), meaning, steady)


def _latched(name: str, kind: str, meaning: str) -> Topic:
    """Return a topic whose last message waits for whoever comes later."""
    return Topic(name, kind, Qos(RELIABLE, 1, LATCHED), Qos(RELIABLE, 1, LATCHED), meaning, False)


JOINT_STATES = _stream(
    '/joint_states',
    'sensor_msgs/msg/JointState',
    'commanded joint motion: position [rad or m], velocity where known',
)
ACTUAL_JOINT_STATES = _result(
    '/actual/joint_states',
    'sensor_msgs/msg/JointState',
    'joint motion with the joint-space effects in it',
)
MEASURED_POSE = _stream(
    '/measured/tool_pose',
    'geometry_msgs/msg/PoseStamped',
    'where the tool really is, in the measuring frame [m]',
)
MEASURED_POINT = _stream(
    '/measured/tool_point',
    'geometry_msgs/msg/PointStamped',
    'the same from an instrument that gives no orientation [m]',
)
MEASURED_SIGMA = _stream(
    '/measured/sigma',
    'geometry_msgs/msg/Vector3Stamped',
    'standard deviation of the measured position of the same stamp, per axis [m]',
)
CONTACT = _stream(
    '/contact',
    'sensor_msgs/msg/Range',
    'the tool point touches what header.frame_id names; range is the measured length where that is '
    'what a contact gives, else 0 [m], variance its variance where known [m^2]',
)
IMAGE_POINTS = _stream(
    '/measured/image_points',
    'sensor_msgs/msg/PointCloud2',
    'points of targets that the camera named in header.frame_id saw: target, point, u, v [px]',
)
TWIN_POSE = _result(
    '/twin/tool_pose', 'geometry_msgs/msg/PoseStamped', 'where the twin says the tool is [m]'
)
TWIN_COVARIANCE = _result(
    '/twin/tool_pose_with_covariance',
    'geometry_msgs/msg/PoseWithCovarianceStamped',
    'the same pose and how sure it is: of the true pose, turns about the world axes [m^2, rad^2]',
)
DEVIATION = _result(
    '/deviation',
    'geometry_msgs/msg/Vector3Stamped',
    'measured minus twin in the base frame, at the stamp of the measurement [m]',
)
DEVIATION_METRICS = _result(
    '/deviation/metrics',
    'diagnostic_msgs/msg/DiagnosticArray',
    'D(t), D_norm, D_cum, RMS, max, samples, dropped',
    steady=False,
)
DIAGNOSIS = _result(
    '/diagnosis',
    'diagnostic_msgs/msg/DiagnosticArray',
    'verdict over the last minute: status, effects found, gap before and after',
    steady=False,
)
TOOL_WRENCH = _stream(
    '/tool_wrench',
    'geometry_msgs/msg/WrenchStamped',
    'load on the tool, in the tool frame unless the header names another [N, N m]',
    depth=100,
)
TEMPERATURE = _stream(
    '/temperature',
    'sensor_msgs/msg/Temperature',
    'temperature of the arm or around it [degC]',
    depth=10,
)

TOPICS = (
    JOINT_STATES,
    ACTUAL_JOINT_STATES,
    MEASURED_POSE,
    MEASURED_POINT,
    MEASURED_SIGMA,
    CONTACT,
    IMAGE_POINTS,
    TWIN_POSE,
    TWIN_COVARIANCE,
    DEVIATION,
    DEVIATION_METRICS,
    DIAGNOSIS,
    TOOL_WRENCH,
    TEMPERATURE,
)
"""What a recording of the cell holds."""

ROBOT_DESCRIPTION = _latched(
    '/robot_description',
    'std_msgs/msg/String',
    'URDF of the cell, as robot_state_publisher tells it',
)
TWIN_BASE = _latched(
    '/twin/base_pose',
    'geometry_msgs/msg/PoseStamped',
    "where the twin has the robot's base, in the measuring frame [m]",
)
JOINT_TRAJECTORY = _result(
    '/joint_trajectory',
    'trajectory_msgs/msg/JointTrajectory',
    'motion the trajectory generator is to run, planned by somebody else',
    depth=10,
    steady=False,
)
PATH = _result(
    '/path',
    'nav_msgs/msg/Path',
    'seam the trajectory generator is to plan and run, in the measuring frame',
    depth=10,
    steady=False,
)
PLANNED_TRAJECTORY = _latched(
    '/planned/joint_trajectory',
    'trajectory_msgs/msg/JointTrajectory',
    'the motion the trajectory generator runs',
)
PLANNED_PATH = _latched('/planned/path', 'nav_msgs/msg/Path', 'the tool path of that motion')
MARKERS = _result(
    '/deviation/markers',
    'visualization_msgs/msg/MarkerArray',
    'the seam coloured by deviation, and the deviations magnified',
    depth=10,
)
DIAGNOSTICS = _result(
    '/diagnostics',
    'diagnostic_msgs/msg/DiagnosticArray',
    'health of every node: each input with its rate, age, refusals and the last reason',
    depth=10,
)

POSE_IN = _stream(
    '~/pose_in',
    'geometry_msgs/msg/PoseStamped',
    "where the controller is to have the tool, in the robot's base [m]",
)
POSE_OUT = _result(
    '~/pose_out',
    'geometry_msgs/msg/PoseStamped',
    'the same, corrected so that the real tool goes there [m]',
)
CORRECTION = _result(
    '~/correction',
    'geometry_msgs/msg/TwistStamped',
    "what was or would be added to a pose or to a point of a goal: way and turn in the robot's base "
    '[m, rad]',
    steady=False,
)
AUDIT = Topic(
    '~/audit',
    'std_msgs/msg/String',
    Qos(RELIABLE, 100, LATCHED),
    Qos(RELIABLE, 100, LATCHED),
    'a line of JSON for every goal: time, model, largest correction, verdict',
    steady=False,
)
COMPENSATED = (POSE_IN, POSE_OUT, CORRECTION, AUDIT)
"""What the compensator takes and gives, under its own name."""

TF = _stream(
    '/tf',
    'tf2_msgs/msg/TFMessage',
    'where frames are that move: those of measurements and of the base',
    depth=100,
)
TF_STATIC = Topic(
    '/tf_static',
    'tf2_msgs/msg/TFMessage',
    Qos(RELIABLE, 1, LATCHED),
    Qos(RELIABLE, 100, LATCHED),
    'where frames are that do not move',
    steady=False,
)
FRAMES = (TF, TF_STATIC)
"""Listened to where a node is given the name of the measuring frame."""
ONE_FOR_ALL = (DIAGNOSTICS.name, TF.name, TF_STATIC.name)
"""Topics that all robots share, whatever their namespaces."""

AROUND = (
    ROBOT_DESCRIPTION,
    TWIN_BASE,
    JOINT_TRAJECTORY,
    PATH,
    PLANNED_TRAJECTORY,
    PLANNED_PATH,
    MARKERS,
    DIAGNOSTICS,
)
"""What surrounds it; recorded on request."""
BY_NAME = {topic.name: topic for topic in (*TOPICS, *AROUND)}


NO_TOPIC = {'topic': False}
"""Mark of the attributes of `TopicNames` that are none."""


@dataclass(frozen=True)
class TopicNames:
    """What the inputs are called; a recording made elsewhere has its own names."""

    joints: str = JOINT_STATES.name
    pose: str = MEASURED_POSE.name
    point: str = MEASURED_POINT.name
    sigma: str = MEASURED_SIGMA.name
    wrench: str = TOOL_WRENCH.name
    temperature: str = TEMPERATURE.name
    contact: str = CONTACT.name
    images: str = IMAGE_POINTS.name  # topics; a leading slash may be left out
    joint_prefix: str = field(default='', metadata=NO_TOPIC)
    """What the joint states put before the names of the robot's joints."""
    joint_map: tuple[tuple[str, str], ...] = field(default=(), metadata=NO_TOPIC)
    """Joints of the robot and what the joint states call them, before the prefix."""
    measured_inverse: bool = field(default=False, metadata=NO_TOPIC)
    """Whether measured poses are those of something fixed seen from the arm, to be inverted."""
    use_effort: bool = field(default=False, metadata=NO_TOPIC)
    """Whether the measured efforts of the joints are read, and have to be there."""
    cameras: tuple[Camera, ...] = field(default=(), metadata=NO_TOPIC)
    targets: tuple[Target, ...] = field(default=(), metadata=NO_TOPIC)
    """What is known of them, where points in images were measured."""

    @classmethod
    def topics(cls) -> tuple[str, ...]:
        """Return the usual names."""
        return tuple(str(item.default) for item in fields(cls) if not item.metadata)

    def __post_init__(self) -> None:
        for item in fields(self):
            if item.metadata:
                continue
            name = getattr(self, item.name)
            object.__setattr__(self, item.name, name if name.startswith('/') else f'/{name}')

    @classmethod
    def within(cls, namespace: str) -> TopicNames:
        """Return the names of one robot's topics where each robot has a namespace."""
        space = '/' + namespace.strip('/') if namespace.strip('/') else ''
        names = {i.name: f'{space}{i.default}' for i in fields(cls) if not i.metadata}
        return cls(**names)  # type: ignore[arg-type]
