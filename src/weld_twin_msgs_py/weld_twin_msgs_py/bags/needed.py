# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a bag lacks for a diagnosis and how to mend it, and whether it is whole, in the same words."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from weld_twin_core.arm.robot import Robot

from ..assembly import Role
from ..assembly.foreign_types import ACCEPTED, SURE_POSE, split_topic
from ..messages import topics

_PLAIN_POSES = (topics.MEASURED_POSE.type, SURE_POSE)
TYPES: Mapping[Role, tuple[str, ...]] = {
    Role.POSE: ACCEPTED[topics.MEASURED_POSE.name],
    Role.POINT: (topics.MEASURED_POINT.type,),
    Role.SIGMA: (topics.MEASURED_SIGMA.type,),
    Role.WRENCH: (topics.TOOL_WRENCH.type,),
    Role.TEMPERATURE: (topics.TEMPERATURE.type,),
    Role.JOINTS: ACCEPTED[topics.JOINT_STATES.name],
}
"""Message types from which each role is read."""
Present = Mapping[str, tuple[str, int]]
"""Type and number of messages of every topic of a bag."""
_LISTED = 12
"""Names of joints that fit into a message."""
_INPUTS = frozenset(topics.TopicNames.topics())
_RESULTS = tuple(name for name in topics.BY_NAME if name not in _INPUTS)
"""What the nodes make themselves: never to be diagnosed as if it were measured."""


def no_joints(names: topics.TopicNames, present: Present) -> str:
    """Return that there are no joint states, and which topic may be meant."""
    return f"no joint states on '{names.joints}'" + _meant(
        present, ((topics.JOINT_STATES.type, 'joint'),), (names.joints,)
    )


def no_measurements(names: topics.TopicNames, present: Present) -> str:
    """Return that nothing was measured, and which topic may be meant."""
    kinds = (*((kind, 'pose') for kind in _PLAIN_POSES), (topics.MEASURED_POINT.type, 'point'))
    return f"no measurements on '{names.pose}' or '{names.point}'" + _meant(
        present, kinds, (names.pose, names.point)
    )


def other_names(robot: Robot, there: Sequence[str]) -> str:
    """Return which joints are there in place of the robot's, and the option that joins them."""
    if not there:
        return ''
    others = f'; it holds {", ".join(there[:_LISTED])}' + (' and more' * (len(there) > _LISTED))
    # Drivers that number their joints do so along the arm.
    ordered = there if len(there) == robot.n else ('NAME',) * robot.n
    pairs = ' '.join(f'{own}={name}' for own, name in zip(robot.joint_names, ordered, strict=True))
    return f'{others}. If these are the same joints, say so with --joint-map {pairs}'


def _meant(present: Present, kinds: tuple[tuple[str, str], ...], asked: tuple[str, ...]) -> str:
    asked = tuple(split_topic(name)[0] for name in asked)
    full = {name: kind for name, (kind, count) in sorted(present.items()) if count}
    for kind, option in kinds:
        for name, own in full.items():
            if own == kind and name not in asked and not name.endswith(_RESULTS):
                return f"; '{name}' has that type, try --{option}-topic {name}"
    wrong = [f"'{name}' is a {full[name]}" for name in asked if name in full]
    if wrong:
        return f'; {" and ".join(wrong)}, this needs {" or ".join(kind for kind, _ in kinds)}'
    return f'; its topics are {", ".join(map(repr, full)) or "all empty"}'


COMPLETENESS = 'completeness'
"""Key of the provenance under which a recorder notes what was sent and what it lacks of it."""
GAP = 4.0
"""A step longer than so many median steps is a gap; so is a silence at either end."""


class Ends(NamedTuple):
    """First and last stamp of a stream and its median step [ns]."""

    first: int
    last: int
    step: int


def uneven_ends(streams: Mapping[str, Ends]) -> tuple[str, ...]:
    """
    Return a sentence for each stream that begins late or ends early against the others.

    streams: of one clock, by name. Silence counts in the steps of the slower one of two streams: a
    temperature published every ten seconds begins when it pleases.
    """
    if len(streams) < 2:
        return ()
    out = []
    for name, own in streams.items():
        begun = min((s for s in streams.values() if s is not own), key=lambda s: s.first)
        ended = max((s for s in streams.values() if s is not own), key=lambda s: s.last)
        late, early = own.first - begun.first, ended.last - own.last
        if late > GAP * max(own.step, begun.step):
            out.append(f"'{name}' begins {late * 1e-9:.3f} s later than {_name(streams, begun)}")
        if early > GAP * max(own.step, ended.step):
            out.append(f"'{name}' ends {early * 1e-9:.3f} s earlier than {_name(streams, ended)}")
    return tuple(out)


def _name(streams: Mapping[str, Ends], wanted: Ends) -> str:
    return next(f"'{name}'" for name, ends in streams.items() if ends is wanted)


def never_recorded(provenance: Mapping[str, Any]) -> tuple[str, ...]:
    """Return a sentence for each topic of which its recorder noted that messages are missing."""
    noted = provenance.get(COMPLETENESS)
    rows = noted.items() if isinstance(noted, dict) else ()
    return tuple(
        f"'{name}' lacks {row['missing']:,} of the {row['sent']:,} messages sent, {row['where']}"
        for name, row in rows
        if isinstance(row, dict) and row.get('missing') and {'sent', 'where'} <= row.keys()
    )
