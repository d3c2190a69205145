# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Measurements that could be made next: pieces of motion to choose from, and what is changed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...arm.rotation import transform
from ...arrays import Array
from ...recording import JointMotion, Recording, Signal
from ..algebra.problem import Model, Problem
from ..evidence import NAMED
from .postures import STEP, USUAL_MINUTES, Limits, Room, joined

NAME = 'next measurement'
STATIONS = 80
"""Stations to choose from; more only take time."""
PATHS = 9
"""Paths of all joints to choose from: three, each at three speeds."""
STAY = 15.0
"""Time [s] that a station takes with the way to it."""
_SOAK = 60.0
"""Time [s] from station to station while the arm warms up."""
RISE = 15.0
"""Warming [K] in an hour: arms do that at work."""
MASS = 5.0
"""Load [kg] hung from the tool: a judgement; springs show, and most arms can carry it."""
LONGER = 0.2
"""Length [m] added to the tool: a turn of 0.1 mrad then moves its tip by 0.02 mm more."""
PRESS = 50.0
"""Force [N] on the tool: a judgement; a hand can press so hard."""
_HALVED = tuple(2.0 ** -np.arange(4))
"""Speeds of paths, as shares of the fastest, and shares of a range."""
_LONGEST = 40.0
"""Time [s] of a recorded seam that is run again, backward or slower: half the least experiment."""
_EVERY = 0.1
"""Time [s] between the points that a recorded seam is run again through: encoders' noise stays out."""
_SLOWER = 2.0
"""How much slower a recorded seam is run again."""
_ANOTHER = 20.0
"""Time [min] to change the cell: another load, tool, instrument or place of it."""
_ASIDE = 1.5
"""Distance [m] by which an instrument is moved."""


class Piece(NamedTuple):
    """Part of a measurement: which recording, its rows (None: all), and its time [s]."""

    recording: int
    rows: tuple[int, ...] | None
    seconds: float


@dataclass(frozen=True, eq=False)
class Candidate:
    kind: str
    sentence: str  # the sentence has ``{count}`` where the number of stations goes
    set_up: float  # what has to be changed in the cell first [min]
    recordings: tuple[Recording, ...]  # motions, with side signals, without measurements
    pieces: tuple[Piece, ...]  # what is chosen from
    model: Model  # as the cell will be, without found effects; one base
    room: Room  # where the arm may go
    whole: bool = False  # whether none of the pieces may be left out
    new_base: bool = False
    new_tool: bool = False
    """Whether the instrument or the tool is set up anew, so that its frame is not known."""
    alone: int = 0  # how many of the pieces, at the end, move one joint alone
    changed: str = ''
    """What is changed in the cell, in the words that a diagnosis takes; empty for nothing."""

    @property
    def static(self) -> bool:
        return self.recordings[0].joints.static


def candidates(
    problem: Problem, model: Model, limits: Limits, joints: Sequence[str] = ()
) -> Iterator[Candidate]:
    """Yield what could be measured next beside the recordings; what is in doubt sits on joints."""
    here = _Here(problem, replace(model, bases=model.bases[:1], found=()), limits)
    if limits.set_up or not problem.at_rest:
        yield here.path(joints)
    yield from here.at_rest()
    if limits.set_up:
        if all(r.wrench is not None for r in problem.recordings):
            yield here.pressed()
        yield here.warm_up()
        yield from here.changed()


class _Here:
    """The cell as it is: the recordings at hand, the model, and postures to choose from."""

    def __init__(self, problem: Problem, model: Model, limits: Limits) -> None:
        self.problem, self.model = problem, model
        self.room = Room(problem, model.robot, limits)
        # Elsewhere than the experiments before.
        skip = STATIONS * (len(problem.recordings) - 1)
        self.spread = self.room.spread(STATIONS, skip)

    def path(self, joints: Sequence[str]) -> Candidate:
        """Return ways from home and back: all joints at once, seams, those in question alone."""
        room, motions, at = self.room, [], 0
        for k in range(PATHS):
            stops = [room.home]
            while len(stops) < 4 and at < len(self.spread):
                if room.way([stops[-1], self.spread[at]]):
                    stops.append(self.spread[at])
                at += 1
            if len(stops) > 1:
                # Back the same way: every place is passed in both directions.
                motions.append(room.travel([*stops, *stops[-2::-1]], _HALVED[k % 3]))
        motions += _retraced(self.problem, room)
        together = len(motions)
        for name in list(dict.fromkeys(joints))[:NAMED]:
            i = self.model.robot.index(name)
            motions += [room.travel(_alone(room, i), speed) for speed in _HALVED[::2]]
        return Candidate(
            'path',
            'Run the proposed path, and record joints and tool all the way.',
            _ANOTHER if self.problem.at_rest else 0.0,
            tuple(_with_sides(self.problem, motion) for motion in motions),
            tuple(Piece(k, None, float(m.t[-1])) for k, m in enumerate(motions)),
            self.model,
            room,
            alone=len(motions) - together,
        )

    def at_rest(self) -> Iterator[Candidate]:
        yield self._stations(
            'stations',
            'Measure {count} stations at rest, spread over a wider part of the workspace.',
            self.spread,
        )
        few = self.spread[: len(self.spread) // 4]
        approach = np.array([[-STEP], [0.0], [STEP], [0.0]])
        both = np.repeat(few, 4, axis=0) + np.tile(approach, (len(few), 1))
        yield self._stations(
            'bidirectional',
            'Measure {count} stations at rest, each approached from both sides of every joint.',
            both,
            group=4,
        )

    def pressed(self) -> Candidate:
        whole = self.spread[: len(self.spread) // 3 * 3]
        made = self._stations(
            'press',
            f'Measure {{count}} stations while the tool is pressed with {PRESS:g} N along x, y and '
            'z in turn.',
            whole,
            group=3,
            set_up=5.0,
        )
        (recording,) = made.recordings
        force = np.tile(PRESS * np.eye(3, 6), (len(whole) // 3, 1))
        push = Signal(recording.joints.t, force)
        return replace(made, recordings=(replace(recording, wrench=push, wrench_frame='base'),))

    def warm_up(self) -> Candidate:
        few = self.spread[:5]
        again = np.tile(few, (int(USUAL_MINUTES) // len(few), 1))
        sentence = 'Measure five stations again and again for an hour while the arm warms up.'
        made = self._stations('warm_up', sentence, again, len(again), seconds=_SOAK)
        (recording,) = made.recordings
        if recording.temperature is not None:
            t, first = recording.joints.t, recording.temperature.value[0]
            ramp = Signal(t, first + np.linspace(0.0, RISE, t.size))
            made = replace(made, recordings=(replace(recording, temperature=ramp),))
        return replace(made, whole=True)

    def changed(self) -> Iterator[Candidate]:
        robot, words = self.model.robot, 'Measure {count} stations'
        more = f'{words} with {MASS:g} kg more hung from the tool point.'
        heavy = replace(robot, payload_mass=robot.payload_mass + MASS)
        made = self._stations('payload_swap', more, self.spread, set_up=_ANOTHER)
        model = replace(self.model, robot=heavy)
        yield replace(made, model=model, changed=f'load={MASS:g}')
        longer = robot.T_flange_tool @ transform(np.eye(3), np.array([0.0, 0.0, LONGER]))
        yield replace(
            made,
            kind='longer_tool',
            sentence=f'{words} with a tool {LONGER * 1e3:g} mm longer.',
            model=replace(self.model, robot=robot.with_frames(tool=longer)),
            new_tool=True,
            changed='tool',
        )
        base = transform(np.eye(3), np.array([_ASIDE, 0.0, 0.0])) @ self.model.bases[0]
        yield replace(
            made,
            kind='moved_instrument',
            sentence=f'Move the instrument by {_ASIDE:g} m. {words}.',
            model=replace(self.model, bases=(base,)),
            new_base=True,
            changed='instrument',
        )

    def _stations(
        self,
        kind: str,
        sentence: str,
        q: Array,
        group: int = 1,
        set_up: float = 0.0,
        seconds: float = STAY,
    ) -> Candidate:
        """Return stations (N, n) every so many seconds, in groups."""
        t = seconds * np.arange(len(q), dtype=np.float64)
        made = _with_sides(self.problem, JointMotion(t, q, static=True))
        first = range(0, len(q), group)
        pieces = tuple(Piece(0, tuple(range(k, k + group)), seconds * group) for k in first)
        return Candidate(kind, sentence, set_up, (made,), pieces, self.model, self.room)


def _retraced(problem: Problem, room: Room) -> list[JointMotion]:
    """Return the first seam that was recorded from its end to its begin, and slower."""
    joints = problem.recordings[0].joints
    if joints.static:
        return []
    t: Array = np.arange(0.0, min(float(np.ptp(joints.t)), _LONGEST), _EVERY)
    seam = joints.at(joints.t[0] + t)[0]
    there, back = [room.home, seam[0]], [seam[-1], room.home]
    if len(t) < 2 or not (room.way(there) and room.way(back) and room.passed(seam)):
        return []
    slow = _SLOWER * t
    return [
        joined(
            room.travel(back[::-1], 1.0), JointMotion(t, seam[::-1]), room.travel(there[::-1], 1.0)
        ),
        joined(room.travel(there, 1.0), JointMotion(slow, seam), room.travel(back, 1.0)),
    ]


def _alone(room: Room, i: int) -> list[Array]:
    """Return the stops of one joint that moves through its range, as far as it is free."""
    for share in _HALVED:
        ends = np.tile(room.home, (2, 1))
        ends[:, i] += share * (np.array([room.high[i], room.low[i]]) - room.home[i])
        stops = [room.home, *ends, room.home]
        if room.way(stops):
            break
    return stops


def _with_sides(problem: Problem, joints: JointMotion) -> Recording:
    """Return a recording of a motion, as warm and as loaded as those at hand were on average."""
    ends = joints.t[[0, -1]]
    warm = [r.temperature.value.mean() for r in problem.recordings if r.temperature is not None]
    load = [
        (r.wrench.value.mean(axis=0), r.wrench_frame)
        for r in problem.recordings
        if r.wrench is not None
    ]
    heat = Signal(ends, np.full(2, np.mean(warm))) if warm else None
    if len(load) < len(problem.recordings):
        # A weight was hung for one experiment; nobody leaves it there for the next.
        return Recording(NAME, joints, temperature=heat)
    wrench = Signal(ends, np.stack([load[0][0]] * 2))
    return Recording(NAME, joints, wrench=wrench, wrench_frame=load[0][1], temperature=heat)
