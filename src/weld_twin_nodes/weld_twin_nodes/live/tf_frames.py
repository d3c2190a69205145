# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a node knows of the frames on `/tf`: where the base is, and the way of a measurement."""

import time
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from weld_twin_core.arm.rotation import transform
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.assembly import Role
from weld_twin_msgs_py.assembly.foreign_types import stamped_pose
from weld_twin_msgs_py.assembly.transforms import NoTransform, NotYet, TransformTree
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.cdr_read import Header, PointStamped, Xyz
from weld_twin_msgs_py.messages.topics import MEASURED_POINT, MEASURED_POSE, TF, TF_STATIC

from .cell_node import CellNode

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
