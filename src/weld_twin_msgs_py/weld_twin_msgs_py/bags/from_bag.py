# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A bag to a `Recording`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import matrix_from_quaternion
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Measurements, Recording, Signal

from ..messages import from_messages
from ..messages.topics import (
    JOINT_STATES,
    MEASURED_POINT,
    MEASURED_POSE,
    MEASURED_SIGMA,
    TEMPERATURE,
    TOOL_WRENCH,
    TopicNames,
)
from .columns import Samples, Stream
from .reader import BagReader
from .station_stamps import looks_static

POSE_TYPES = (MEASURED_POSE.type, 'geometry_msgs/msg/PoseWithCovarianceStamped')
_BASE_FRAMES = ('base', 'base_link', 'base_link_inertia', 'robot_base')
_WORLD_FRAMES = ('world', 'map', 'measuring', 'tracker')


@dataclass(frozen=True)
class _Role:
    """How messages of one topic become numbers."""

    types: tuple[str, ...]
    width: int
    row: Callable[[Any], Any]


def read_recording(path: Path | str, robot: Robot, topics: TopicNames | None = None) -> Recording:
    """
    Read a bag in one pass.

    Stamps are those of the headers. Messages without a stamp are dropped, late ones put in
    order, repeated ones dropped, each with a note in the recording; joint states that hold none
    of the robot's joints (a gripper on the same topic) are passed over with a note.

    Parameters
    ----------
    path : Path or str
        A rosbag2 directory, a .mcap or a .db3 file.
    robot : Robot
        Its joint names pick the columns.
    topics : TopicNames, optional
        What the topics are called in this bag.

    Raises
    ------
    DataError
        No such bag, damaged, a topic missing or of the wrong type, or samples that cannot be
        used; the message names the topic.

    """
    names = TopicNames() if topics is None else topics
    with BagReader(path) as bag:
        roles = _roles(robot, names, bag.topics)
        streams = {topic: Stream(topic, role.width) for topic, role in roles.items()}
        passed = _fill(bag, roles, streams, names.joints, robot)
        made, points = bag.provenance, bag.topics.get(names.point, ('', 0))[1]
    if not len(streams[names.joints]) and not streams[names.joints].unstamped:
        raise DataError(
            f"no message of '{names.joints}' in bag '{path}' holds a joint of robot "
            f'{robot.name!r}: {", ".join(robot.joint_names)}'
        )
    samples = {topic: stream.samples() for topic, stream in streams.items()}
    notes = [note for item in samples.values() for note in item.notes]
    if names.pose in samples and points:
        notes.append(f"'{names.pose}' is used, '{names.point}' beside it is not")
    if passed:
        notes.append(f"{passed} messages of '{names.joints}' hold no joint of the robot")
    frames = streams[names.wrench].frames if names.wrench in streams else set()
    return _assemble(_name(Path(path)), robot, names, samples, made, notes, frames)


def _name(path: Path) -> str:
    return path.stem if path.is_file() else path.resolve().name


def _roles(
    robot: Robot, names: TopicNames, present: Mapping[str, tuple[str, int]]
) -> dict[str, _Role]:
    """Return the topics to read; the joint states are a must, the others as they are there."""
    n = robot.n
    joints = robot.joint_names
    roles = {
        names.joints: _Role((JOINT_STATES.type,), 2 * n, lambda m: _joint_row(m, joints)),
        names.pose: _Role(POSE_TYPES, 8, _pose_row),
        names.point: _Role((MEASURED_POINT.type,), 3, from_messages.point),
        names.sigma: _Role((MEASURED_SIGMA.type,), 3, from_messages.vector3),
        names.wrench: _Role((TOOL_WRENCH.type,), 6, from_messages.wrench),
        names.temperature: _Role(
            (TEMPERATURE.type,), 1, lambda m: (from_messages.temperature(m),)
        ),
    }
    defaults = set(vars(TopicNames()).values())
    for topic in list(roles):
        kind, count = present.get(topic, ('', 0))
        if count == 0:
            if topic == names.joints or topic not in defaults:
                listed = ', '.join(f"'{t}'" for t, (_, c) in sorted(present.items()) if c)
                raise DataError(
                    f"the bag has no message on '{topic}'; its topics are {listed or 'all empty'}"
                )
            del roles[topic]
        elif kind not in roles[topic].types:
            raise DataError(
                f"topic '{topic}' has the type {kind}, but this use needs "
                + ' or '.join(roles[topic].types)
            )
    if names.pose in roles:
        roles.pop(names.point, None)
    return roles


def _joint_row(message: Any, joints: tuple[str, ...]) -> Array:
    q = from_messages.joint_positions(message, joints)
    qd = from_messages.joint_velocities(message, joints)
    return np.concatenate([q, np.full(q.size, np.nan) if qd is None else qd])


def _pose_row(message: Any) -> list[float]:
    """Return position, quaternion and sigma (NaN when the message has none)."""
    inner = getattr(message.pose, 'pose', message.pose)
    p, q = inner.position, inner.orientation
    sigma = None if inner is message.pose else from_messages.position_sigma(message)
    return [p.x, p.y, p.z, q.x, q.y, q.z, q.w, np.nan if sigma is None else sigma]


def _fill(
    bag: BagReader,
    roles: Mapping[str, _Role],
    streams: Mapping[str, Stream],
    joint_topic: str,
    robot: Robot,
) -> int:
    """Stream the bag into the columns; return how many joint states were somebody else's."""
    passed = 0
    wanted = set(robot.joint_names)
    for topic, _, _, message in bag.messages(roles):
        stream = streams[topic]
        if topic == joint_topic and wanted.isdisjoint(message.name):
            passed += 1
            continue
        stamp = message.header.stamp
        if stamp.sec == 0 and stamp.nanosec == 0:
            stream.unstamped += 1
            continue
        stream.frames.add(message.header.frame_id)
        try:
            stream.append(from_messages.stamp_ns(message), roles[topic].row(message))
        except DataError as error:
            raise DataError(f"message {len(stream)} of '{topic}': {error}") from None
    return passed


def _assemble(
    name: str,
    robot: Robot,
    names: TopicNames,
    samples: Mapping[str, Samples],
    made: Mapping[str, Any],
    notes: list[str],
    wrench_frames: set[str],
) -> Recording:
    joints = samples[names.joints]
    epoch = int(joints.ns[0])

    def seconds(ns: np.ndarray) -> Array:
        return np.asarray((ns - epoch) * 1e-9)

    def signal(topic: str, width: int) -> Signal | None:
        if topic not in samples:
            return None
        values = samples[topic].values
        return Signal(seconds(samples[topic].ns), values[:, 0] if width == 1 else values)

    measured = _measurements(names, samples, seconds)
    q, qd = joints.values[:, : robot.n], joints.values[:, robot.n :]
    motion = JointMotion(seconds(joints.ns), q, None if np.isnan(qd).any() else qd)
    static = bool(made['static']) if 'static' in made else looks_static(robot, motion, measured)
    if static:
        motion = JointMotion(motion.t, motion.q, static=True)
        notes.append(f'{motion.t.size} static stations: the motion between them is not known')
    elif measured is not None:
        _refuse_apart(names, motion, measured)
    frame = 'tool'
    if wrench_frames:
        frame = _wrench_frame(wrench_frames, robot)
    return Recording(
        name,
        motion,
        measured,
        signal(names.wrench, 6),
        frame,
        signal(names.temperature, 1),
        epoch,
        tuple(notes),
    )


def _measurements(
    names: TopicNames, samples: Mapping[str, Samples], seconds: Callable[[np.ndarray], Array]
) -> Measurements | None:
    if names.pose in samples:
        ns, values, _ = samples[names.pose]
        rotation = matrix_from_quaternion(values[:, 3:7], f"orientation of '{names.pose}'")
        sigma = values[:, 7]
    elif names.point in samples:
        ns, values, _ = samples[names.point]
        rotation, sigma = None, np.full(ns.size, np.nan)
    else:
        return None
    if names.sigma in samples:
        sigma = _matched_sigma(ns, samples[names.sigma], sigma)
    known = None if np.isnan(sigma).any() else sigma
    return Measurements(seconds(ns), values[:, :3], rotation, known)


def _matched_sigma(ns: np.ndarray, given: Samples, sigma: Array) -> Array:
    """Return the sigma of the same stamp, its axes joined by their mean square."""
    at = np.clip(np.searchsorted(given.ns, ns), 0, given.ns.size - 1)
    same = given.ns[at] == ns
    return np.where(same, np.sqrt((given.values[at] ** 2).mean(axis=1)), sigma)


def _refuse_apart(names: TopicNames, motion: JointMotion, measured: Measurements) -> None:
    """Two clocks with nothing in common would silently pair everything with one joint state."""
    gap = max(measured.t[0] - motion.t[-1], motion.t[0] - measured.t[-1])
    if gap > 0.0:
        raise DataError(
            f"measurements and '{names.joints}' do not overlap in time, they are {gap:.3f} s "
            'apart: their stamps come from different clocks'
        )


def _wrench_frame(frames: set[str], robot: Robot) -> str:
    """Return the frame of the wrench from header.frame_id: 'tool' unless it names the base."""
    known = {frame.strip('/').lower() for frame in frames if frame}
    if known & set(_BASE_FRAMES):
        return 'base'
    if known & set(_WORLD_FRAMES):
        if not np.allclose(robot.T_world_base[:3, :3], np.eye(3), atol=1e-9):
            raise DataError(
                'the wrench is given in the measuring frame, which is turned against the base; '
                'publish it in the tool or base frame'
            )
        return 'base'
    return 'tool'
