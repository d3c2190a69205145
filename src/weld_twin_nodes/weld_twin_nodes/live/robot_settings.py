# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How a node knows its robot and frames, by parameters and `/tf`, and what its inputs call things."""

import time
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import (
    angle_between,
    matrix_from_quaternion,
    rotation_matrix,
    transform,
)
from weld_twin_core.arrays import Array
from weld_twin_core.effects import Effect
from weld_twin_core.errors import DataError, ModelError, TwinError
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.assembly import Role
from weld_twin_msgs_py.assembly.foreign_types import stamped_pose
from weld_twin_msgs_py.assembly.frames import BASE, WORLD, NoTransform, NotYet, TransformTree
from weld_twin_msgs_py.assembly.joint_states import names_called
from weld_twin_msgs_py.files.yaml_file import parse_yaml
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.cdr import Header, PointStamped, Xyz, decoder
from weld_twin_msgs_py.messages.topics import (
    MEASURED_POINT,
    MEASURED_POSE,
    ROBOT_DESCRIPTION,
    TF,
    TF_STATIC,
)
from weld_twin_msgs_py.robots import load_robot, parse_urdf

from ..offline.given_twin import changed_robot, diagnosis_of, doubts, since_recorded
from .cell_node import CellNode
from .settings import NO_NUMBERS, Setting

PATIENCE = 1.0
"""Seconds a measurement waits for the transforms of its time: ten steps of a slow tracker of frames."""
LOOK_EVERY = 0.2
"""Seconds between two looks at what waits."""
MOST = 2000
"""Measurements that wait at most: two seconds at 1 kHz."""


class Frames:
    """The tree of frames that `/tf` and `/tf_static` tell, as long as the node runs."""

    def __init__(self, node: CellNode) -> None:
        self.tree = TransformTree()
        self.changed: list[Callable[[], None]] = []
        self.lack = ''
        """Why `/tf` is not listened to; empty where it is."""
        try:
            TF.message_class()
        except ImportError as error:
            self.lack = f'/tf is not listened to: {error}'
            node.remark(self.lack)
            return
        node.listen(TF, partial(self._take, static=False), at_once=True)
        node.listen(TF_STATIC, partial(self._take, static=True), at_once=True)

    def _take(self, message: Any, *, static: bool) -> None:
        try:
            self.tree.take(message, static=static)
        finally:
            for action in self.changed:
                action()


def frames_of(node: CellNode) -> Frames:
    """Return the frames a node listens to; one set for all that asks for them."""
    if node.frames is None:
        node.frames = Frames(node)
    frames: Frames = node.frames
    return frames


class MeasuredInputs:
    """The measurements of a node, carried into its ``measuring_frame``, if any, by `/tf`."""

    def __init__(self, node: CellNode, use: Callable[[Role, Any], None]) -> None:
        self._node = node
        self._wanted = node.setting('measuring_frame').strip('/')
        self._waiting: deque[tuple[float, str, Any, Callable[[Any], None]]] = deque()
        self._tree: TransformTree | None = None
        if self._wanted:
            frames = frames_of(node)
            self._tree = frames.tree
            frames.changed.append(self._retry)
            node.every(LOOK_EVERY, self._retry)
        for topic, role in ((MEASURED_POSE, Role.POSE), (MEASURED_POINT, Role.POINT)):
            name = node.resolve_topic_name(topic.relative)
            node.listen(topic, partial(self._take, name, partial(use, role)))

    def clear(self) -> None:
        """Forget what waits, as after a jump of the clock."""
        self._waiting.clear()

    def _take(self, source: str, use: Callable[[Any], None], message: Any) -> None:
        frame = message.header.frame_id.strip('/')
        if self._tree is None or frame in ('', self._wanted):
            use(message)
            return
        self._retry()
        if len(self._waiting) < MOST:
            self._waiting.append((time.monotonic(), source, message, use))
            self._retry()
        else:
            self._node.refuse(
                source, f'{MOST:,} measurements wait already for the transforms of their time'
            )

    def _retry(self) -> None:
        """Use the measurements whose way is known by now, in the order they came."""
        while self._waiting:
            since, source, message, use = self._waiting[0]
            try:
                transformed = self._in_measuring_frame(message)
            except NotYet as error:
                if time.monotonic() - since < PATIENCE:
                    return
                self._node.refuse(source, str(error))
            except DataError as error:
                self._node.refuse(source, str(error))
            else:
                try:
                    use(transformed)
                except DataError as error:
                    self._node.refuse(source, str(error))
            if self._waiting:  # what used it may have begun anew
                self._waiting.popleft()

    def _in_measuring_frame(self, message: Any) -> Any:
        assert self._tree is not None
        frame, stamp = message.header.frame_id.strip('/'), from_messages.stamp_ns(message)
        try:
            T = self._tree.between(self._wanted, frame, stamp)
        except NotYet:
            raise
        except NoTransform as error:
            raise NoTransform(
                f'the measurement is given in {frame!r}, but measuring_frame is '
                f'{self._wanted!r}, and {error}; publish it in that frame, or the way on /tf'
            ) from None
        moves = ', which moves' if self._tree.moves(self._wanted, frame) else ''
        self._node.remark(
            f'measurements in {frame!r} are carried into {self._wanted!r} by /tf{moves}'
        )
        return transformed(message, T, self._wanted)


def transformed(message: Any, T: Array, frame_id: str) -> Any:
    """Return a pose or a point in another frame, in which its own is at ``T``."""
    header = Header(message.header.stamp, frame_id)
    if hasattr(message, 'point'):
        at = T[:3, :3] @ from_messages.point(message) + T[:3, 3]
        return PointStamped(header, Xyz(*at.tolist()))
    position, rotation = from_messages.pose(message)
    out = stamped_pose(header, T @ transform(rotation, position), frame_id)
    if not hasattr(message.pose, 'pose'):
        return out
    turn = np.kron(np.eye(2), T[:3, :3])
    covariance = turn @ np.reshape(message.pose.covariance, (6, 6)) @ turn.T
    inner = message.pose._replace(pose=out.pose, covariance=tuple(covariance.ravel().tolist()))
    return message._replace(header=header, pose=inner)


BASE_EVERY = 0.5
"""Seconds between two looks at whether the base is still there."""
MOVED = 1e-4
"""Way [m] or turn [rad] of a base that has moved: a tenth of a millimetre, what good trackers see."""


def base_on_tf(node: CellNode) -> Array:
    """Return T_measuring_base, shape (4, 4), once `/tf` tells it."""
    measuring, base = node.setting('measuring_frame'), node.setting('base_frame')
    if not measuring or not base:
        raise ModelError('base_from_tf needs the names measuring_frame and base_frame')
    frames = frames_of(node)
    if frames.lack:
        raise ModelError(f'base_from_tf cannot be done: {frames.lack}')

    def known() -> bool:
        try:
            frames.tree.latest(measuring, base)
        except NoTransform as error:
            node.keep('frames', f'waiting for /tf: {error}', logged=False)
            return False
        return True

    if not known():
        node.serve_until(known, f'/tf to tell where {base!r} is in {measuring!r}')
    node.keep('frames', '')
    T = frames.tree.latest(measuring, base)
    node.remark(f'the base is where /tf has {base!r} in {measuring!r}')
    node.every(BASE_EVERY, lambda: _watch(node, frames, T))
    return T


def _watch(node: CellNode, frames: Frames, taken: Array) -> None:
    """Tell, as long as it is so, that the base is not where it was when the node started."""
    measuring, base = node.setting('measuring_frame'), node.setting('base_frame')
    try:
        now = frames.tree.latest(measuring, base)
    except NoTransform as error:
        node.keep('frames', str(error))
        return
    way = float(np.linalg.norm(now[:3, 3] - taken[:3, 3]))
    turn = float(np.linalg.norm(angle_between(now[:3, :3], taken[:3, :3])))
    sentence = (
        f'{base!r} has moved in {measuring!r} by {way * 1e3:.3g} mm and {np.degrees(turn):.3g} '
        'degrees since this node started; it goes on with the base where it was then: start it '
        'anew, or say T_measuring_base'
    )
    node.keep('frames', sentence if way >= MOVED or turn >= MOVED else '')


FRAME_SETTINGS = (
    Setting(
        'measuring_frame',
        '',
        'frame that measurements must be given in, and that poses are given in; empty: the first '
        'that comes, and world',
    ),
    Setting('base_frame', '', "name of the robot's base in what is published; empty: base"),
    Setting(
        'base_from_tf',
        False,
        'take from /tf where the base is: base_frame in measuring_frame, when the node starts',
    ),
    Setting(
        'T_measuring_base',
        NO_NUMBERS,
        'where the base is in the measuring frame [m, rad]: x y z and a rotation vector, or x y z '
        'and a quaternion x y z w; not set: as the robot or its model has it',
        numbers=True,
    ),
)


def measuring_frame(node: CellNode) -> str:
    """Return the name of the frame in which poses are published."""
    return node.setting('measuring_frame') or WORLD


def base_frame(node: CellNode) -> str:
    """Return the name of the robot's base in what is published."""
    return node.setting('base_frame') or BASE


def place_robot(node: CellNode, robot: Robot) -> Robot:
    """Return the robot with its base where the node's parameters put it."""
    values = node.setting('T_measuring_base')
    if values != NO_NUMBERS:
        return robot.with_origin(frame_from(values))
    if not node.setting('base_from_tf'):
        return robot
    if node.arm is not None:  # it was asked for when the node took its robot
        return robot.with_frames(base=node.arm.T_world_base)
    return robot.with_origin(base_on_tf(node))


def place_twin(node: CellNode, twin: Twin) -> Twin:
    """Return the twin of a model, placed likewise; a parameter counts more than a fitted base."""
    say_doubts(node, twin.robot, twin.effects)
    robot = place_robot(node, twin.robot)
    moved = abs(robot.T_world_base - twin.robot.T_world_base).max()
    if moved > 0.0:
        node.remark('the base that was given is used; the base of the model differs from it')
    return twin if moved == 0.0 else Twin(robot, twin.effects)


def say_doubts(node: CellNode, robot: Robot, effects: Sequence[Effect]) -> None:
    """Warn of all in the node's model that may be a slip, and of joints that it was told otherwise."""
    path = node.setting('model')
    content = diagnosis_of(path)
    said = changed_robot(content, node.setting('robot')) + since_recorded(content, effects)
    for doubt in said + doubts(robot, effects):
        node.warn(doubt, doubt)
    if (content.get('model') or {}).get('counted') is not None:
        sentence = (
            f"the recordings of '{path}' have joints as the controller shows them, which are not "
            'those of the robot file; this node takes joints as the robot file has them'
        )
        node.warn(sentence, sentence)


def frame_from(values: Sequence[float] | str) -> Array:
    """Return the 4 x 4 matrix of x y z and a rotation vector or a quaternion."""
    try:
        numbers = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.size not in (6, 7) or not np.isfinite(numbers).all():
        raise ModelError(
            'T_measuring_base takes 6 numbers, x y z and a rotation vector, or 7, x y z and a '
            f'quaternion x y z w, got {values if isinstance(values, str) else list(values)}'
        )
    if numbers.size == 6:
        return transform(rotation_matrix(numbers[3:]), numbers[:3])
    try:
        return transform(matrix_from_quaternion(numbers[3:], 'T_measuring_base'), numbers[:3])
    except DataError as error:
        raise ModelError(str(error)) from None


JOINT_SETTINGS = (
    Setting(
        'joint_prefix',
        '',
        "what the joint states put before the robot's joint names; empty: any one prefix is taken "
        'off and reported',
    ),
    Setting(
        'joint_map',
        '',
        "what the joint states call joints, as a YAML mapping from the robot's own names, such as "
        "'{joint_1: A1, joint_2: A2}'; names left out stay",
    ),
    Setting(
        'joints_beside',
        '',
        'joints on the same topic that do not carry the arm, such as those of a gripper, separated '
        'by commas: that they move is no cause for a warning',
    ),
    Setting(
        'joint_part',
        '',
        "part of a controller's state that is taken; empty: reference for commanded joints, "
        'feedback where it stands for a measurement',
    ),
)
MEASURED_SETTINGS = (
    Setting(
        'measured_frame',
        '',
        'frame that was measured, where measurements come as transforms',
    ),
)


def joint_names(node: CellNode, robot: Robot) -> tuple[str, ...] | None:
    """Return what the joint states call the joints of a robot; None where nothing is said."""
    prefix, text = node.setting('joint_prefix'), node.setting('joint_map')
    if not prefix and not text:
        return None
    given = parse_yaml(text, 'joint_map') if text else {}
    if not isinstance(given, dict) or not all(isinstance(v, str) for v in given.values()):
        raise ModelError(
            f'joint_map must be a mapping of names such as {{joint_1: A1}}, got {text!r}'
        )
    return names_called(robot, prefix, given)


ROBOT_SETTINGS = (
    Setting(
        'robot',
        'ur5',
        "bundled robot, path of a robot file or URDF, or 'topic' "
        '(or /robot_description) to wait for the URDF that robot_state_publisher tells',
    ),
    Setting('base_link', '', 'first link of the chain in a URDF; empty: its root'),
    Setting('tip_link', '', 'last link of the chain in a URDF; empty: its only leaf'),
    *FRAME_SETTINGS,
)


CHANGED = 'robot changed'
"""Under which a node keeps what it says of a robot that changes while it runs."""


def robot_of(node: CellNode) -> Robot:
    """Return the robot a node's parameters name."""
    name = node.setting('robot')
    base, tip = node.setting('base_link') or None, node.setting('tip_link') or None
    if names_topic(name):
        topic = node.resolve_topic_name(ROBOT_DESCRIPTION.relative if name == 'topic' else name)
        robot = _described(node, topic, lambda text: parse_urdf(text, topic, base, tip))
    else:
        robot = load_robot(name, base, tip)
    robot = place_robot(node, robot)
    given = node.has_parameter('joint_map')
    node.take_robot(robot, joint_names(node, robot) if given else None)
    return robot


def names_topic(name: str) -> bool:
    """Return whether a robot's name means a topic with its URDF: 'topic', or a topic's name."""
    absolute = name.startswith('/') and not Path(name).suffix and not Path(name).is_file()
    return name == 'topic' or absolute


def _described(node: CellNode, topic: str, read: Callable[[str], Robot]) -> Robot:
    """Return the robot that a topic tells; what it tells from then on is compared with that."""
    first: list[Robot] = []
    decode = decoder(ROBOT_DESCRIPTION.type)

    def take(data: Any) -> None:  # bytes, as the subscription is raw
        if not first:
            first.append(read(decode(data).data))
            return
        try:
            same = read(decode(data).data).to_mapping() == first[0].to_mapping()
        except TwinError as error:
            node.refuse(topic, str(error))
            return
        sentence = (
            f'another robot is told on {topic} now; this node goes on with the one that it '
            'started with: start it anew'
        )
        node.keep(CHANGED, '' if same else sentence)

    node.create_subscription(
        ROBOT_DESCRIPTION.message_class(),
        topic,
        take,
        ROBOT_DESCRIPTION.requested.to_rclpy(),
        raw=True,
    )
    node.serve_until(lambda: bool(first), f'the robot on {topic}')
    return first[0]
