# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A bag to a `Recording`: every message through the assembly that the running nodes use."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.contacts import Artefact, Contact, Contacts
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Counted, JointMotion, Recording

from ..assembly import Intake, Role, Samples, assembled
from ..assembly.foreign_types import FedBack, plain_messages, plain_poses, split_topic
from ..assembly.joint_states import names_called
from ..messages.from_messages import stamp_ns
from ..messages.topics import CONTACT, TopicNames
from .images import images, looking
from .needed import (
    TYPES,
    Ends,
    never_recorded,
    no_joints,
    no_measurements,
    other_names,
    uneven_ends,
)
from .reader import BagReader
from .regular import LEFT_OUT, Stream, fill_regular


class Mark(NamedTuple):
    """That something was touched: stamp [ns], label, length and its deviation [m]."""

    ns: int
    label: str
    value: float
    sigma: float


def marks(bag: BagReader, names: TopicNames) -> list[Mark]:
    """Return the contacts of a bag, in the order of their stamps; none where it holds none."""
    kind, count = bag.topics.get(names.contact, ('', 0))
    if not count:
        return []
    if kind != CONTACT.type:
        raise DataError(
            f"topic '{names.contact}' has the type {kind}, but contacts are of {CONTACT.type}"
        )
    out: list[Mark] = []
    for topic, _, _, message in bag.messages([names.contact]):
        label = message.header.frame_id
        if not label:
            raise DataError(
                f"message {len(out)} of '{topic}' has no label; put what was touched in "
                'header.frame_id'
            )
        value, variance = float(message.range), float(message.variance)
        if not (np.isfinite(value) and np.isfinite(variance) and variance >= 0.0):
            raise DataError(f"message {len(out)} of '{topic}' holds numbers that are not finite")
        out.append(Mark(stamp_ns(message), label, value, float(np.sqrt(variance))))
    out.sort(key=lambda mark: mark.ns)
    for before, after in pairwise(out):
        if before.ns == after.ns:
            raise DataError(f"two contacts of '{names.contact}' have the stamp {after.ns} ns")
    return out


def touching(recording: Recording, each: list[Mark], made: Mapping[str, Any]) -> Recording:
    """
    Return the recording as stations, one for every contact.

    What says how the bag was made may hold the artefact. Without one every label is a point, or a
    length where the messages hold one.
    """
    ns = np.array([mark.ns for mark in each])
    t = (ns - recording.epoch_ns) * 1e-9
    motion = recording.joints
    if t[0] < motion.t[0] - 1e-9 or t[-1] > motion.t[-1] + 1e-9:
        raise DataError(
            f'contacts of {recording.name} lie from {t[0]:.3f} to {t[-1]:.3f} s, its joint states '
            f'from {motion.t[0]:.3f} to {motion.t[-1]:.3f} s; record both together'
        )
    value = np.array([mark.value for mark in each])
    sigma = np.array([mark.sigma for mark in each])
    labels = tuple(mark.label for mark in each)
    entry = made.get('artefact')
    artefact = Artefact.from_mapping(entry) if entry else _plain(labels, value)
    contacts = Contacts(
        artefact, labels, value if value.any() else None, sigma if sigma.all() else None
    )
    stations = JointMotion(t, motion.at(t)[0], static=True)
    return replace(recording, joints=stations, measured=None, contacts=contacts)


def _plain(labels: tuple[str, ...], value: np.ndarray) -> Artefact:
    """Return the artefact of which nothing was said: points, or lengths where they have one."""
    long = {label for label, length in zip(labels, value, strict=True) if length > 0.0}
    names = dict.fromkeys(labels)
    return Artefact(tuple(Contact(n, 'length' if n in long else 'point') for n in names))


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
        if needs_measurements and not (touched or seen or {Role.POSE, Role.POINT} & set(roles)):
            raise DataError(f"bag '{path}': {no_measurements(names, bag.topics)}")
    if streams[Role.JOINTS].messages == intake.joints.others:
        raise DataError(
            f"no message of '{names.joints}' in bag '{path}' holds a joint of robot "
            f'{robot.name!r}: {", ".join(robot.joint_names)}'
            f'{other_names(robot, tuple(intake.joints.strangers))}'
        )
    samples = {role: stream.samples() for role, stream in streams.items()}
    whole = assembled(
        Path(path).stem if Path(path).is_file() else Path(path).resolve().name,
        robot,
        samples,
        wrench_frame=intake.wrench_frame.meaning,
        static=made.get('static'),
        one_clock=one_clock,
        notes=_of_another(made, robot) + _notes(names, streams, intake, bool(points)),
    )
    whole = _counted(whole, made)
    if touched:
        return touching(whole, touched, made)
    if seen:
        whole = looking(whole, seen, names, made)
    return _with_what_is_missing(_inverted(whole, names), made, _ends(names, samples))


def _counted(recording: Recording, made: Mapping[str, Any]) -> Recording:
    """Return the recording with how the controller counts the joints, where its bag says it."""
    entry = made.get('counted')
    if entry is None:
        return recording
    return replace(recording, counted=Counted.from_mapping(entry, recording.joints.q.shape[1]))


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
                f"topic '{topic}' has the type {kind}, but this use needs one type alone: "
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
                if role is Role.POSE:
                    plain = plain_poses(kind, message, parts[role], fed_back)
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


def _of_another(made: Mapping[str, Any], robot: Robot) -> tuple[str, ...]:
    """Return that a bag was made with a robot of another name, where it says so."""
    told = made.get('robot')
    name = told.get('name', robot.name) if isinstance(told, dict) else robot.name
    if name == robot.name:
        return ()
    return (
        f'the bag says that it is of robot {name!r}, and {robot.name!r} was given: check which',
    )


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
