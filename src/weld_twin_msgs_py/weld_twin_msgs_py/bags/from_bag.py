# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A bag to a `Recording`: every message through the assembly that the running nodes use."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Recording

from ..assembly import Intake, Role, Samples, assembled
from ..assembly.foreign_types import CONTROLLER, JOINTS, FedBack, plain_messages, split_topic
from ..assembly.joint_states import names_called
from ..messages.topics import (
    JOINT_STATES,
    MEASURED_POINT,
    MEASURED_SIGMA,
    TEMPERATURE,
    TOOL_WRENCH,
    TopicNames,
)
from .columns import LEFT_OUT, Stream
from .contacts import marks, touching
from .ends import Ends, never_recorded, uneven_ends
from .images import images, looking
from .needed import POSE_TYPES, no_joints, no_measurements, other_names
from .reader import BagReader
from .regular import fill_regular

TYPES = {
    Role.JOINTS: (JOINT_STATES.type, *JOINTS),
    Role.POSE: (*POSE_TYPES, CONTROLLER),
    Role.POINT: (MEASURED_POINT.type,),
    Role.SIGMA: (MEASURED_SIGMA.type,),
    Role.WRENCH: (TOOL_WRENCH.type,),
    Role.TEMPERATURE: (TEMPERATURE.type,),
}
"""Message types from which each role is read."""
INJECTED = 'effects'
"""Key of the provenance under which the simulator and the injector tell what they put in."""


def read_recording(
    path: Path | str,
    robot: Robot,
    topics: TopicNames | None = None,
    *,
    one_clock: bool = True,
    needs_measurements: bool = False,
) -> Recording:
    """
    Read a bag in one pass.

    Stamps are those of the headers. Messages without a stamp, with a repeated one or with one
    before the last of their topic are left out, each kind with a note in the recording, as the
    running nodes leave them out; joint states that hold none of the robot's joints (a gripper on
    the same topic) are passed over with a note. Joints spread over several messages are put
    together where their stamps are equal.

    Parameters
    ----------
    path : Path or str
        A rosbag2 directory, a .mcap or a .db3 file.
    robot : Robot
        Its joint names pick the columns.
    topics : TopicNames, optional
        What the topics are called in this bag.
    one_clock : bool
        Refuse measurements that have no time in common with the joint states.
    needs_measurements : bool
        Refuse a bag in which nothing was measured.

    Raises
    ------
    DataError
        No such bag, damaged, a topic missing or of the wrong type, or samples that cannot be
        used; the message names the topic.

    """
    names = TopicNames() if topics is None else topics
    with BagReader(path) as bag:
        roles = _roles(names, bag.topics)
        streams, intake = _read(bag, names, roles, robot)
        points = bag.topics.get(_topic(names, Role.POINT), ('', 0))[1]
        made = bag.provenance
        touched = marks(bag, names)
        seen = [] if touched else images(bag, names)
        measured = touched or seen or {Role.POSE, Role.POINT} & set(roles)
        if needs_measurements and not measured:
            raise DataError(f"bag '{path}': {no_measurements(names, bag.topics)}")
    if streams[Role.JOINTS].messages == intake.joints.others:
        raise DataError(
            f"no message of '{names.joints}' in bag '{path}' holds a joint of robot "
            f'{robot.name!r}: {", ".join(robot.joint_names)}'
            f'{other_names(robot, tuple(intake.joints.strangers))}'
        )
    samples = {role: stream.samples() for role, stream in streams.items()}
    whole = assembled(
        _name(Path(path)),
        robot,
        samples,
        wrench_frame=intake.wrench_frame.meaning,
        static=bool(made['static']) if 'static' in made else None,
        one_clock=one_clock,
        notes=_notes(names, streams, intake, bool(points)),
    )
    if touched:
        return touching(whole, touched, made)
    if seen:
        whole = looking(whole, seen, names, made)
    return _with_what_is_missing(_inverted(whole, names), made, _ends(names, samples))


def _inverted(recording: Recording, names: TopicNames) -> Recording:
    """Return the recording with poses of the tool, where those that came are of a fixed thing."""
    if not names.measured_inverse or recording.measured is None or recording.images is not None:
        return recording
    return recording.with_measured(recording.measured.inverted())


def _with_what_is_missing(
    recording: Recording, made: Mapping[str, Any], ends: Mapping[str, Ends]
) -> Recording:
    lacking = never_recorded(made)
    uneven = () if recording.joints.static else uneven_ends(ends)
    return replace(
        recording,
        incomplete=(*lacking, *uneven),
        notes=(*recording.notes, *lacking),
        simulated=INJECTED in made,
    )


def _ends(names: TopicNames, samples: Mapping[Role, Samples]) -> dict[str, Ends]:
    """Return the ends of what a comparison cannot do without: joint states and measurements."""
    return {
        getattr(names, role.value): Ends(
            int(item.ns[0]), int(item.ns[-1]), int(np.median(np.diff(item.ns)))
        )
        for role, item in samples.items()
        if role in (Role.JOINTS, Role.POSE, Role.POINT) and item.ns.size > 1
    }


def _name(path: Path) -> str:
    return path.stem if path.is_file() else path.resolve().name


def _roles(names: TopicNames, present: Mapping[str, tuple[str, int]]) -> dict[Role, str]:
    """Return the topics to read; the joint states are a must, the others as they are there."""
    roles = {role: _topic(names, role) for role in Role}
    space = _topic(names, Role.JOINTS).removesuffix(TopicNames().joints)
    defaults = {topic for usual in TopicNames.topics() for topic in (usual, f'{space}{usual}')}
    for role, topic in list(roles.items()):
        kind, count = present.get(topic, ('', 0))
        if role is Role.JOINTS and (count == 0 or kind not in TYPES[role]):
            raise DataError(f'the bag has {no_joints(names, present)}')
        if count == 0:
            if topic not in defaults:
                listed = ', '.join(f"'{t}'" for t, (_, c) in sorted(present.items()) if c)
                raise DataError(
                    f"the bag has no message on '{topic}'; its topics are {listed or 'all empty'}"
                )
            del roles[role]
        elif kind not in TYPES[role]:
            raise DataError(
                f"topic '{topic}' has the type {kind}, but this use needs "
                + ' or '.join(TYPES[role])
            )
    if Role.POSE in roles:
        roles.pop(Role.POINT, None)
    return roles


def _topic(names: TopicNames, role: Role) -> str:
    """Return the topic of a role, without the part of its messages that is meant."""
    name: str = getattr(names, role.value)
    return split_topic(name)[0]


def _read(
    bag: BagReader, names: TopicNames, roles: Mapping[Role, str], robot: Robot
) -> tuple[dict[Role, Stream], Intake]:
    """Return the columns of a bag: read by the thousand where all is as usual, else one by one."""
    kinds = {role: bag.topics[topic][0] for role, topic in roles.items()}
    streams, intake = _empty(names, roles, kinds, robot)
    one_each = {topic: role for role, topic in roles.items()}
    whole = not any(split_topic(getattr(names, role.value))[1] for role in roles)
    usual = whole and len(one_each) == len(roles)
    if not (usual and fill_regular(bag, one_each, streams, intake)):
        streams, intake = _empty(names, roles, kinds, robot)
        _fill(bag, names, streams, intake, robot)
    return streams, intake


def _empty(
    names: TopicNames, roles: Mapping[Role, str], kinds: Mapping[Role, str], robot: Robot
) -> tuple[dict[Role, Stream], Intake]:
    joint_names = names_called(robot, names.joint_prefix, dict(names.joint_map))
    intake = Intake(robot, limits=False, joint_names=joint_names, efforts=names.use_effort)
    width = partial(Intake.width, robot=robot, efforts=names.use_effort)
    each = {r: Stream(topic, width(r, kind=kinds[r])) for r, topic in roles.items()}
    return each, intake


def _fill(
    bag: BagReader,
    names: TopicNames,
    streams: Mapping[Role, Stream],
    intake: Intake,
    robot: Robot,
) -> None:
    """Stream the bag into the columns; a topic may tell of joints commanded and fed back."""
    parts = {role: split_topic(getattr(names, role.value))[1] for role in streams}
    roles: dict[str, list[Role]] = {}
    for role, stream in streams.items():
        roles.setdefault(stream.topic, []).append(role)
    joint_names = names_called(robot, names.joint_prefix, dict(names.joint_map))
    fed_back = FedBack(robot, parts.get(Role.POSE, ''), joint_names)
    for topic, kind, _, message in bag.messages(roles):
        for role in roles[topic]:
            stream = streams[role]
            try:
                if role is Role.POSE and kind == CONTROLLER:
                    plain = tuple(fed_back(message))
                else:
                    plain = plain_messages(kind, message, parts[role])
            except DataError as error:
                raise DataError(f"message {stream.messages} of '{topic}': {error}") from None
            for each in plain:
                stream.messages += 1
                _take(each, role, stream, intake)


def _take(message: Any, role: Role, stream: Stream, intake: Intake) -> None:
    last = intake.last(role)
    try:
        taken = intake.take(role, message)
    except LEFT_OUT as error:
        stream.leave_out(error)
        return
    except DataError as error:
        raise DataError(f"message {stream.messages - 1} of '{stream.topic}': {error}") from None
    if taken is None:
        return
    if taken.restarted and last is not None:
        raise stream.jumped(last - taken.stamp)
    stream.frames.add(message.header.frame_id)
    stream.append(taken.stamp, taken.row)


def _notes(
    names: TopicNames, streams: Mapping[Role, Stream], intake: Intake, points: bool
) -> tuple[str, ...]:
    notes = [note for stream in streams.values() for note in stream.notes()]
    if Role.POSE in streams and points:
        notes.append(f"'{names.pose}' is used, '{names.point}' beside it is not")
    if intake.joints.others:
        notes.append(
            f"{intake.joints.others} messages of '{names.joints}' hold no joint of the robot"
        )
    notes += [said for said in (intake.joints.remark, intake.wrench_frame.remark) if said]
    return tuple(notes)
