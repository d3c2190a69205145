# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is in a bag and what of it a diagnosis can use."""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.bursts import ONE_CLOCK, Bursts, apart, bursts
from weld_twin_core.errors import DataError, TwinError

from ..assembly.foreign_types import plain_messages, split_topic
from ..messages.topics import BY_NAME, CONTACT, TopicNames
from .from_bag import refuse_unreadable
from .images import READ
from .needed import GAP, TYPES, Ends, never_recorded, no_joints, no_measurements, uneven_ends
from .reader import BagReader

NAMED = 100
"""Joint states in which the joints of an unknown robot are looked for: of every publisher some."""


@dataclass(frozen=True)
class TopicInfo:
    name: str
    type: str
    count: int
    use: str = ''  # what a diagnosis takes it for; empty for a topic it does not know
    start_ns: int | None = None
    end_ns: int | None = None  # earliest and latest stamp [ns]
    rate_hz: float | None = None
    """From the median step; where they come in bursts the rate underneath; None with fewer than
    two messages."""
    gaps: int = 0  # steps longer than `GAP` median steps
    longest_gap_s: float = 0.0  # [s]
    unordered: int = 0
    repeated: int = 0
    unstamped: int = 0
    """Messages that go back in time, repeat the stamp before, or have none."""
    header: bool = False  # the stamps are those of headers, not of the recorder's clock
    sent: Bursts | None = None  # how they come, where that is in bursts


@dataclass(frozen=True)
class BagInfo:
    """A bag at a glance."""

    path: Path
    topics: tuple[TopicInfo, ...]
    start_ns: int
    duration_s: float
    """From the first to the last stamp of the topics in use, else of all [s]."""
    missing: tuple[str, ...]  # what keeps it from being usable, a sentence each
    notes: tuple[str, ...]  # what a diagnosis will do without or work around
    provenance: dict[str, Any]
    incomplete: tuple[str, ...] = ()
    """What of the messages sent is not in it, and which streams begin late or end early."""
    refused: str = ''  # why a diagnosis cannot take what is there

    @property
    def usable(self) -> bool:
        """Return whether a diagnosis can start from it."""
        return not (self.missing or self.refused)


def bag_info(path: Path | str, topics: TopicNames | None = None) -> BagInfo:
    """
    Look through a bag, and read it as a diagnosis does.

    Its robot is the one it says it was made with, else any of the joints that it tells.

    Raises
    ------
    DataError
        No such bag, or damaged.

    """
    names = TopicNames() if topics is None else topics
    result, made = _topics_of(path, names)
    used = [t for t in result if t.use and t.start_ns is not None]
    timed = used or [t for t in result if t.start_ns is not None]
    start = min((t.start_ns for t in timed if t.start_ns is not None), default=0)
    end = max((t.end_ns for t in timed if t.end_ns is not None), default=0)
    missing, notes = _judge(names, {t.use: t for t in used}, result)
    lacking = (*never_recorded(made), *(uneven_ends(_ends(result)) if not missing else ()))
    return BagInfo(
        Path(path),
        tuple(result),
        start,
        (end - start) * 1e-9,
        missing,
        (*lacking, *notes),
        made,
        lacking,
        '' if missing else _refusal(path, names, made),
    )


def _refusal(path: Path | str, names: TopicNames, made: Mapping[str, Any]) -> str:
    """Return why a diagnosis refuses what is in a bag; empty where it takes it."""
    try:
        try:
            robot = Robot.from_mapping(made['robot'])
        except (KeyError, TwinError):
            robot = _robot_of(path, split_topic(names.joints))
            names = replace(names, joint_prefix='', joint_map=())
        refuse_unreadable(path, robot, names)
    except TwinError as error:
        return str(error)
    return ''


def _robot_of(path: Path | str, source: tuple[str, str]) -> Robot:
    """Return a robot of the joints that the widest joint state tells, but those it has no number of."""
    topic, part = source
    widest: Any = None
    with BagReader(path) as bag:
        for _, kind, _, message in islice(bag.messages([topic]), NAMED):
            for each in plain_messages(kind, message, part):
                if widest is None or len(each.name) > len(widest.name):
                    widest = each
    if widest is None or not widest.name:
        raise DataError(f"the joint states of '{topic}' name no joint")
    told = [n for n, at in zip(widest.name, widest.position, strict=False) if np.isfinite(at)]
    joints = [{'name': name} for name in told or widest.name]
    return Robot.from_mapping({'name': 'of the bag', 'joints': joints})


def _topics_of(path: Path | str, names: TopicNames) -> tuple[list[TopicInfo], dict[str, Any]]:
    stamps: dict[str, array[int]] = {}
    unstamped: dict[str, int] = {}
    headers: set[str] = set()
    with BagReader(path) as bag:
        for topic, ns, header in bag.stamps():
            if header:
                headers.add(topic)
            if header and ns == 0:
                unstamped[topic] = unstamped.get(topic, 0) + 1
            else:
                stamps.setdefault(topic, array('q')).append(ns)
        result = [
            replace(
                _describe(name, kind, stamps.get(name, array('q')), unstamped.get(name, 0), names),
                header=name in headers,
            )
            for name, (kind, _) in sorted(bag.topics.items())
        ]
        made = bag.provenance
    return result, made


def _ends(result: list[TopicInfo]) -> dict[str, Ends]:
    """Return the ends of the streams that beat, on the clock of the headers."""
    rare = {row.name for row in BY_NAME.values() if not row.steady}
    return {
        t.name: Ends(t.start_ns, t.end_ns, round(1e9 / t.rate_hz))
        for t in result
        if t.name not in rare
        and t.header
        and t.rate_hz
        and t.start_ns is not None
        and t.end_ns is not None
    }


def _describe(
    name: str, kind: str, stamps: array[int], unstamped: int, names: TopicNames
) -> TopicInfo:
    use, types = {  # joints last, for one topic may tell both
        names.contact: ('contact', (CONTACT.type,)),
        names.images: ('images', tuple(READ)),
        **{split_topic(getattr(names, r.value))[0]: (r.value, t) for r, t in TYPES.items()},
    }.get(name, ('', ()))
    ns = np.frombuffer(stamps, dtype=np.int64)
    steps = np.diff(ns)
    forward = steps[steps > 0]
    count = ns.size + unstamped
    use = use if kind in types else ''
    if ns.size == 0:
        return TopicInfo(name, kind, count, use, unstamped=unstamped)
    sent = bursts((np.sort(ns) - ns.min()) * 1e-9)
    median = float(np.median(forward)) if forward.size else 0.0
    beat = median if sent is None else sent.every * 1e9
    gaps = forward[forward > GAP * beat]
    return TopicInfo(
        name,
        kind,
        count,
        use,
        int(ns.min()),
        int(ns.max()),
        sent.rate if sent is not None else 1e9 / median if median else None,
        int(gaps.size),
        float(gaps.max(initial=0)) * 1e-9,
        int((steps < 0).sum()),
        int((steps == 0).sum()),
        unstamped,
        sent=sent,
    )


def _judge(
    names: TopicNames, used: dict[str, TopicInfo], result: list[TopicInfo]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return what is missing for a diagnosis and what it will do without."""
    missing, notes = [], []
    present = {t.name: (t.type, t.count) for t in result}
    joints = used.get('joints')
    if joints is None:
        missing.append(no_joints(names, present))
    told = ('contact', 'images', 'pose', 'point')
    measured = next((used[use] for use in told if use in used), None)
    if measured is None and joints and joints.name == split_topic(names.pose)[0]:
        measured = joints  # a controller tells of both: what it commands and what comes back
    if measured is None:
        missing.append(no_measurements(names, present))
    if joints and measured:
        sentence = apart(_span(joints), _span(measured))
        missing += [] if sentence is None else [f'{sentence}. {ONE_CLOCK}']
    notes += [f"'{t.name}' is {t.sent.words}" for t in result if t.sent is not None]
    if measured is not None and measured.use == 'point':
        notes.append('positions only: errors that turn the tool in place stay invisible')
    for use, effects in (('wrench', 'tool loads'), ('temperature', 'thermal growth')):
        if use not in used:
            notes.append(f'no {use}: {effects} cannot be distinguished from other causes')
    for topic in used.values():
        for number, what in (
            (topic.unstamped, 'without a stamp'),
            (topic.unordered, 'out of order'),
            (topic.repeated, 'with a repeated stamp'),
            (topic.gaps, 'after a gap'),
        ):
            if number:
                notes.append(f"{number} messages of '{topic.name}' {what}")
    return tuple(missing), tuple(notes)


def _span(topic: TopicInfo) -> tuple[float, float]:
    """Return first and last stamp [s]."""
    assert topic.start_ns is not None and topic.end_ns is not None
    return topic.start_ns * 1e-9, topic.end_ns * 1e-9
