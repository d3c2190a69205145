# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages of other types than the table of topics has, as the messages that they stand for."""

from collections.abc import Callable, Iterator, Mapping
from types import SimpleNamespace
from typing import Any

from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import quaternion_from_matrix
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from ..messages.cdr import Header, Pose, PoseStamped, Xyz, Xyzw
from ..messages.topics import JOINT_STATES, MEASURED_POSE
from .frames import WORLD
from .joint_states import JointStates

Plain = Callable[[Any, str], Iterator[Any]]
"""A message, and the frame that is looked for where it holds several; to plain messages."""


def _pose_of_transform(message: Any, frame: str) -> Iterator[Any]:
    """Yield the pose of the child frame in the frame of the header."""
    if frame and message.child_frame_id.strip('/') != frame:
        return
    where = message.transform
    yield SimpleNamespace(
        header=message.header,
        pose=SimpleNamespace(position=where.translation, orientation=where.rotation),
    )


def _poses_of_tf(message: Any, frame: str) -> Iterator[Any]:
    """Yield the pose of one child frame out of many."""
    if not frame:
        children = ', '.join(sorted({each.child_frame_id for each in message.transforms}))
        raise DataError(
            f'it holds the frames {children}; say which of them was measured as TOPIC:FRAME'
        )
    for each in message.transforms:
        yield from _pose_of_transform(each, frame)


def _pose_of_rigid_bodies(message: Any, name: str) -> Iterator[Any]:
    """Yield the pose of one body that a motion capture system sees; of the only one if none is named."""
    bodies = message.rigidbodies
    if not name and len(bodies) > 1:
        seen = ', '.join(sorted(body.rigid_body_name for body in bodies))
        raise DataError(
            f'it holds the bodies {seen}; say which of them was measured as TOPIC:BODY, to a node '
            'as measured_frame'
        )
    for body in bodies:
        if not name or body.rigid_body_name == name:
            yield SimpleNamespace(header=message.header, pose=body.pose)


def _joints_of_controller_state(message: Any, part: str) -> Iterator[Any]:
    """Yield the joint state of a `JointTrajectoryControllerState`: what was commanded."""
    name = part or ('reference' if hasattr(message, 'reference') else 'desired')
    point = getattr(message, name, None)
    if point is None or not hasattr(point, 'positions'):
        raise DataError(f'it has no part {name!r}; reference and feedback are two that it has')
    yield SimpleNamespace(
        header=message.header,
        name=message.joint_names,
        position=point.positions,
        velocity=point.velocities,
    )


def _joints_of_dynamic_state(message: Any, _: str) -> Iterator[Any]:
    """Yield the joint state of a `DynamicJointState`; a joint without a position is left out."""
    if len(message.joint_names) != len(message.interface_values) or any(
        len(each.interface_names) != len(each.values) for each in message.interface_values
    ):
        raise DataError('it has not one value for every interface of every joint it names')
    joints = [
        (name, dict(zip(values.interface_names, values.values, strict=True)))
        for name, values in zip(message.joint_names, message.interface_values, strict=True)
    ]
    joints = [(name, values) for name, values in joints if 'position' in values]
    unknown = float('nan')
    yield SimpleNamespace(
        header=message.header,
        name=[name for name, _ in joints],
        position=[values['position'] for _, values in joints],
        velocity=[values.get('velocity', unknown) for _, values in joints],
    )


POSES: Mapping[str, Plain] = {
    'geometry_msgs/msg/TransformStamped': _pose_of_transform,
    'tf2_msgs/msg/TFMessage': _poses_of_tf,
    'mocap4r2_msgs/msg/RigidBodies': _pose_of_rigid_bodies,
    'mocap_msgs/msg/RigidBodies': _pose_of_rigid_bodies,
}
"""Types that hold poses."""
JOINTS: Mapping[str, Plain] = {
    'control_msgs/msg/JointTrajectoryControllerState': _joints_of_controller_state,
    'control_msgs/msg/DynamicJointState': _joints_of_dynamic_state,
}
"""Types that hold joint states."""
FOREIGN: Mapping[str, Plain] = {**POSES, **JOINTS}
CONTROLLER = 'control_msgs/msg/JointTrajectoryControllerState'
"""Type that may also stand for a measured pose: of the joints that the controller feeds back."""
SURE_POSE = 'geometry_msgs/msg/PoseWithCovarianceStamped'
"""Type of poses that tell how sure they are."""
ACCEPTED: Mapping[str, tuple[str, ...]] = {
    JOINT_STATES.name: (JOINT_STATES.type, *JOINTS),
    MEASURED_POSE.name: (MEASURED_POSE.type, SURE_POSE, *POSES, CONTROLLER),
}
"""Types that a topic may have besides that of the table of topics, which comes first."""


def stamped_pose(header: Any, T: Array, frame_id: str) -> PoseStamped:
    """Return a pose, shape (4, 4), as a message with the stamp of a header."""
    turn = quaternion_from_matrix(T[:3, :3])
    pose = Pose(Xyz(*T[:3, 3].tolist()), Xyzw(*turn.tolist()))
    return PoseStamped(Header(header.stamp, frame_id), pose)


class FedBack:
    """
    Turns what a controller says of its joints into the pose that the arm had then.

    Compared with the twin of what was commanded, it shows the servo's own part of a gap.
    """

    def __init__(
        self, robot: Robot, part: str = '', joint_names: tuple[str, ...] | None = None
    ) -> None:
        self._robot = robot
        self._part = part
        self._joints = JointStates(robot, joint_names=joint_names)

    def __call__(self, message: Any) -> Iterator[PoseStamped]:
        """Yield the pose in the measuring frame, if the message has all the joints."""
        part = self._part or ('feedback' if hasattr(message, 'feedback') else 'actual')
        for state in _joints_of_controller_state(message, part):
            sample = self._joints.take(state)
            if sample is not None:
                yield stamped_pose(message.header, forward(self._robot, sample.q), WORLD)


def split_topic(name: str) -> tuple[str, str]:
    """Return topic and part of ``TOPIC:PART``, the part empty where there is none."""
    topic, _, part = name.partition(':')
    return topic, part.strip('/')


def plain_messages(kind: str, message: Any, part: str = '') -> tuple[Any, ...]:
    """Return the plain messages that a message stands for; ``part``: a child frame, or of a state."""
    turn = FOREIGN.get(kind)
    return (message,) if turn is None else tuple(turn(message, part))


def plain_poses(
    kind: str, message: Any, part: str = '', fed_back: FedBack | None = None
) -> tuple[Any, ...]:
    """Return the poses that a message stands for; ``fed_back`` has the robot, where it is known."""
    if kind == CONTROLLER and fed_back is not None:
        return tuple(fed_back(message))
    return plain_messages(kind, message, part)
