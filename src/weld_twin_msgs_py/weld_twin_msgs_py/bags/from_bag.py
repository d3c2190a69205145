# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A bag to a `Recording`: every message through the assembly that the running nodes use.

In most bags every message of a topic has the layout of the first, stamps increase, and numbers are
finite. Such a topic is read as columns; whatever is not as usual in any message is left to the
reader that takes them one by one, so that both give the same samples and the same refusals.
"""

from array import array
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.contacts import Artefact, Contact, Contacts
from weld_twin_core.errors import DataError
from weld_twin_core.recording import COLDEST, HOTTEST, Counted, JointMotion, Recording

from ..assembly import Intake, Role, Samples, assembled
from ..assembly.foreign_types import FedBack, plain_messages, plain_poses, split_topic
from ..assembly.frames import OtherFrame
from ..assembly.intake import UNIT, Late
from ..assembly.joint_states import Incomplete, Missing, names_called
from ..messages.cdr import Layout, layout_of
from ..messages.from_messages import NANOSECONDS, VARIANCES, Unstamped, stamp_ns
from ..messages.topics import CONTACT, TopicNames
from .images import Image, images, looking
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

MOST = 300
"""Messages of a topic that are read at once: some 70 kB of joint states, and little of the largest."""


class Unusual(Exception):
    """The messages are not as usual: they are to be read one by one."""


CLOCK_JUMP = NANOSECONDS
"""A step back by more than this [ns] is a clock that was set, not a late packet."""

LEFT_OUT = (Unstamped, Late, Incomplete, OtherFrame)
"""What costs a sample and not the recording: the running nodes leave it out as well."""


class Stream:
    """
    Samples of one topic; memory is 8 bytes per number, whatever the message weighs.

    kept: whether all are; left out, the last ones alone, of a bag that is only looked through.
    """

    def __init__(self, topic: str, width: int, *, kept: bool = True) -> None:
        self.topic = topic
        self.width = width
        self._kept = kept
        self.messages = 0
        self.frames: set[str] = set()
        self._unstamped = self._late = self._repeated = 0
        self._other: dict[type[DataError], tuple[int, str]] = {}
        self._ns = array('q')
        self._values = array('d')

    def __len__(self) -> int:
        """Return the number of samples so far."""
        return len(self._ns)

    def append(self, ns: int, values: Iterable[float]) -> None:
        """Add one sample, later than the one before."""
        self._make_room()
        self._ns.append(ns)
        self._values.extend(values)

    def extend(self, ns: np.ndarray, rows: Array) -> None:
        """Add samples, shape (N,) and (N, width), later than those before."""
        self._make_room()
        self._ns.frombytes(np.ascontiguousarray(ns, dtype=np.int64).tobytes())
        self._values.frombytes(np.ascontiguousarray(rows, dtype=np.float64).tobytes())

    def _make_room(self) -> None:
        if not self._kept:
            del self._ns[:], self._values[:]

    def leave_out(self, error: DataError) -> None:
        """Count a message that gives no sample, by what is wrong with it."""
        if isinstance(error, Unstamped):
            self._unstamped += 1
        elif isinstance(error, Late):
            if error.behind > CLOCK_JUMP:
                raise self.jumped(error.behind)
            self._repeated += error.behind == 0
            self._late += error.behind > 0
        else:
            sentence = f"message {self.messages - 1} of '{self.topic}': {error}"
            count, first = self._other.get(type(error), (0, sentence))
            self._other[type(error)] = count + 1, first

    def jumped(self, back: int) -> DataError:
        """Return the error of a clock that was set back by so much [ns] at the last message."""
        return DataError(
            f"the stamps of '{self.topic}' jump back by {back * 1e-9:.3f} s at message "
            f'{self.messages - 1}: the clock was set or the bag holds two runs; cut it there'
        )

    def samples(self) -> Samples:
        if not len(self):
            for _, sentence in self._other.values():
                raise DataError(sentence)
            if not self._unstamped:
                raise DataError(f"no message of '{self.topic}' gives a sample")
            raise DataError(
                f"header.stamp is unset in all {self._unstamped} messages of '{self.topic}'; set "
                'it where the sample is taken, the time of recording cannot stand in for it'
            )
        ns = np.frombuffer(self._ns, dtype=np.int64)
        return Samples(ns, np.frombuffer(self._values, dtype=np.float64).reshape(-1, self.width))

    def notes(self) -> tuple[str, ...]:
        """Return what was left out, and whether the frame changes."""
        counted = (
            (self._unstamped, 'without a stamp dropped'),
            (self._late, 'with a stamp before the last one dropped'),
            (self._repeated, 'with a repeated stamp dropped'),
            *(
                (count, f'left out, as {sentence}')
                for kind, (count, sentence) in self._other.items()
                if kind is not Missing  # the other publishers came a moment later
            ),
        )
        out = [f"{count} messages of '{self.topic}' {what}" for count, what in counted if count]
        if len(self.frames) > 1:
            out.append(f"'{self.topic}' changes its frame_id: {', '.join(sorted(self.frames))}")
        return tuple(out)


class _Topic:
    """One topic while it is read: the layout of its first message, and where the joints are."""

    def __init__(self, stream: Stream, role: Role, kind: str) -> None:
        self.stream, self._role, self._kind = stream, role, kind
        self._layout: Layout | None = None
        self._index: list[int] = []
        self._last = 0
        self._waiting: list[bytes] = []

    def take(self, kind: str, data: bytes, bag: BagReader, intake: Intake) -> None:
        """Take a message; raise Unusual where one has to be looked at by itself."""
        if kind != self._kind:
            raise Unusual
        self._waiting.append(data)
        if len(self._waiting) == MOST:
            self.read_waiting(bag, intake)

    def read_waiting(self, bag: BagReader, intake: Intake) -> None:
        """Read the messages that wait; raise Unusual where one has to be looked at by itself."""
        data, self._waiting = self._waiting, []
        if not data:
            return
        first = self._first(data[0], bag, intake) if self._layout is None else None
        if self._layout is None or {*map(len, data)} != {self._layout.size}:
            raise Unusual
        block = np.frombuffer(b''.join(data), np.uint8).reshape(len(data), -1)
        read = self._layout.columns(block)
        if read is None:
            raise Unusual
        ns, runs = read
        if ns[0] <= self._last or (np.diff(ns) <= 0).any():
            raise Unusual
        rows = (
            _joint_rows(runs, self._index, self.stream.width)
            if self._index
            else _ROWS[self._role](runs[0])
        )
        if first is not None and not np.array_equal(rows[0], first, equal_nan=True):
            raise Unusual
        self._last = int(ns[-1])
        self.stream.messages += ns.size
        self.stream.extend(ns, rows)

    def _first(self, data: bytes, bag: BagReader, intake: Intake) -> Array:
        """Return the row of the first message, as the intake takes it."""
        message = bag.decoded(data, self._kind)
        try:
            taken = intake.take(self._role, message)
        except LEFT_OUT:
            raise Unusual from None
        if taken is None:
            raise Unusual
        self._layout = layout_of(self._kind, data)
        self.stream.frames.add(message.header.frame_id)
        if self._role is Role.JOINTS:
            names = list(message.name)
            self._index = [names.index(name) for name in intake.joints.names]
        return taken.row


def fill_regular(
    bag: BagReader, roles: Mapping[str, Role], streams: Mapping[Role, Stream], intake: Intake
) -> bool:
    """
    Fill the empty columns of topics if all are as usual; return whether that is so.

    Where they do not, the columns and the intake are to be thrown away.
    """
    topics = {
        topic: _Topic(streams[role], role, bag.topics[topic][0]) for topic, role in roles.items()
    }
    try:
        for topic, kind, _, data in bag.raw(topics):
            topics[topic].take(kind, data, bag, intake)
        for each in topics.values():
            each.read_waiting(bag, intake)
    except Exception:  # whatever is wrong with the bag, the other reader has the sentence for it
        return False
    return all(streams[role].messages == bag.topics[topic][1] for topic, role in roles.items())


def _joint_rows(runs: list[Array], index: list[int], width: int) -> Array:
    """Return positions, velocities (none where one lacks) and, in rows so wide, efforts."""
    position, velocity = runs[0][:, index], runs[1]
    if velocity.shape[1] == runs[0].shape[1]:
        velocity = velocity[:, index]
        velocity[np.isnan(velocity).any(axis=1)] = np.nan
        if np.isinf(velocity).any():
            raise Unusual
    else:
        velocity = np.full_like(position, np.nan)
    rows = [_finite(position), velocity]
    if width > 2 * len(index):
        if runs[2].shape[1] != runs[0].shape[1]:
            raise Unusual
        rows.append(_finite(runs[2][:, index]))
    return np.hstack(rows)


def _pose_rows(values: Array) -> Array:
    pose = _finite(values[:, :7])
    if (np.abs(np.linalg.norm(pose[:, 3:], axis=1) - 1.0) >= UNIT).any():
        raise Unusual
    return np.column_stack([pose, _sigma(values[:, 7:]), values[:, 7:]])


def _sigma(covariance: Array) -> Array:
    """Return the deviation of positions; NaN without a covariance, or where it is left at zero."""
    if not covariance.size:
        return np.full(covariance.shape[0], np.nan)
    variances = _finite(covariance[:, VARIANCES])
    if (variances < 0.0).any():
        raise Unusual
    return np.where(variances.any(axis=1), np.sqrt(variances.mean(axis=1)), np.nan)


def _temperature_rows(values: Array) -> Array:
    degrees = _finite(values[:, :1])
    if (degrees < COLDEST).any() or (degrees > HOTTEST).any():
        raise Unusual
    return degrees


def _finite(values: Array) -> Array:
    if not np.isfinite(values).all():
        raise Unusual
    return values


_ROWS: Mapping[Role, Callable[[Any], Array]] = {
    Role.POSE: _pose_rows,
    Role.POINT: _finite,
    Role.SIGMA: _finite,
    Role.WRENCH: _finite,
    Role.TEMPERATURE: _temperature_rows,
}
"""From the doubles of a message to the row of its role, as `Intake` makes it of one message."""


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
    streams, intake, points, made, touched, seen = _contents(
        path, robot, names, needs_measurements=needs_measurements
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


class _Contents(NamedTuple):
    """The streams of a bag, what took them, points beside poses, its making, touches, images."""

    streams: dict[Role, Stream]
    intake: Intake
    points: int
    made: dict[str, Any]
    touched: list[Mark]
    seen: list[Image]


def _contents(
    path: Path | str,
    robot: Robot,
    names: TopicNames,
    *,
    needs_measurements: bool,
    kept: bool = True,  # whether all samples are, see `Stream`
) -> _Contents:
    """Return what is read of a bag, every message looked at; raise DataError as `read_recording`."""
    with BagReader(path) as bag:
        roles = _roles(names, bag.topics)
        streams, intake = _read(bag, names, roles, robot, kept=kept)
        points = bag.topics.get(_topic(names, Role.POINT), ('', 0))[1]
        touched = marks(bag, names)
        seen = [] if touched else images(bag, names)
        if needs_measurements and not (touched or seen or {Role.POSE, Role.POINT} & set(roles)):
            raise DataError(f"bag '{path}': {no_measurements(names, bag.topics)}")
        made = bag.provenance
    if streams[Role.JOINTS].messages == intake.joints.others:
        raise DataError(
            f"no message of '{names.joints}' in bag '{path}' holds a joint of robot "
            f'{robot.name!r}: {", ".join(robot.joint_names)}'
            f'{other_names(robot, tuple(intake.joints.strangers))}'
        )
    return _Contents(streams, intake, points, made, touched, seen)


def refuse_unreadable(path: Path | str, robot: Robot, names: TopicNames) -> None:
    """Raise DataError where a diagnosis would refuse a stream of a bag; keep nothing of it."""
    what = _contents(path, robot, names, needs_measurements=True, kept=False)
    for stream in what.streams.values():
        stream.samples()


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
    bag: BagReader, names: TopicNames, roles: Mapping[Role, str], robot: Robot, *, kept: bool
) -> tuple[dict[Role, Stream], Intake]:
    """Return the columns of a bag: read by the thousand where all is as usual, else one by one."""
    kinds = {role: bag.topics[topic][0] for role, topic in roles.items()}
    streams, intake = _empty(names, roles, kinds, robot, kept)
    one_each = {topic: role for role, topic in roles.items()}
    whole = not any(split_topic(getattr(names, role.value))[1] for role in roles)
    usual = whole and len(one_each) == len(roles)
    if not (usual and fill_regular(bag, one_each, streams, intake)):
        streams, intake = _empty(names, roles, kinds, robot, kept)
        _fill(bag, names, streams, intake, robot)
    return streams, intake


def _empty(
    names: TopicNames,
    roles: Mapping[Role, str],
    kinds: Mapping[Role, str],
    robot: Robot,
    kept: bool,
) -> tuple[dict[Role, Stream], Intake]:
    joint_names = names_called(robot, names.joint_prefix, dict(names.joint_map))
    intake = Intake(robot, limits=False, joint_names=joint_names, efforts=names.use_effort)
    width = partial(Intake.width, robot=robot, efforts=names.use_effort)
    each = {r: Stream(topic, width(r, kind=kinds[r]), kept=kept) for r, topic in roles.items()}
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
