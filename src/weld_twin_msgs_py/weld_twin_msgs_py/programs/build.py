# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is understood of a program: points with the places of their numbers, and new ones put there."""

import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import rotation_vector
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.motion.inverse import CarriedArm
from weld_twin_core.motion.programs import Move, MoveProgram, Use
from weld_twin_core.motion.programs.travel import Kind

from .controllers import Controller, Frame
from .source import Notation, Number, Source

Suits = Callable[[Controller, Array], Array]
"""Tells, for a controller, the postures that a program asks for, of some (m, n)."""
Astray = Callable[[Controller, Array, Array], tuple[int, ...]]
"""Tells, for a controller, the axes that leave where a point's flags have them, before and after."""


class InFull(NamedTuple):
    """How a place that a program counts from the point before is written once one of both moves."""

    before: int
    edits: tuple[tuple[int, int, str], ...]
    """Pieces of the program's own text, and what stands there then: {0} is the first number."""


class Point(NamedTuple):
    name: str  # as the program calls it; 'line 12' for one that stands in the move
    where: str  # file and line
    numbers: tuple[Number, ...]
    notation: Notation
    value: Array
    """A pose (4, 4) in its own base frame, or joint positions of the model (n,)."""
    external: Array | None = None
    """External axes at a pose, as the first joints of the model, shape (m,); None where it does
    not say."""
    in_full: InFull | None = None


class Ref(NamedTuple):
    """A place that a move leads to, or is derived from: ``before @ point @ after``."""

    point: int
    before: Array | None = None
    after: Array | None = None
    leads: bool = True

    def beside(self, before: Array | None = None, after: Array | None = None) -> 'Ref':
        """Return a place that goes along with this one, shifted in its base or in itself, (4, 4)."""
        return Ref(self.point, _then(before, self.before), _then(self.after, after), False)


def _then(first: Array | None, second: Array | None) -> Array | None:
    if first is None or second is None:
        return second if first is None else first
    return np.asarray(first @ second)


@dataclass(frozen=True, eq=False)
class Step:
    """
    One move as a program says it; without an end it is not understood, ``why`` says why.

    ``along`` is False where the program says that a straight way is not one on the workpiece. What
    ``shift`` says why is that it goes elsewhere than its point says.
    """

    kind: Kind
    where: str
    end: Ref | None = None
    via: Ref | None = None
    tool: Frame = field(default_factory=lambda: Frame(''))
    base: Frame = field(default_factory=lambda: Frame(''))
    speed: float = 0.1
    stop: bool = True
    dwell: float = 0.0
    duration: float = 0.0
    suits: Suits | None = None
    astray: Astray | None = None
    why: str = ''
    along: bool = True
    shift: Frame = field(default_factory=lambda: Frame(''))


@dataclass(eq=False)
class Program:
    language: str
    sources: list[Source]  # the first is the program, the others belong to it
    points: list[Point] = field(default_factory=list)
    pieces: list[list[Step]] = field(default_factory=lambda: [[]])
    """Routines; where one begins, nobody knows where the arm is."""
    fixed: dict[int, str] = field(default_factory=dict)
    """Points that must not be moved, with the reason."""
    notes: list[str] = field(default_factory=list)
    """What a reader should know, in sentences."""
    one_seam: bool = False  # the whole program is corrected together or not at all
    beside: str = ''  # where external axes move that the robot file does not have
    silent: list[int] = field(default_factory=list)
    """Points that do not say where such axes stand."""

    def add_point(
        self,
        name: str,
        numbers: Sequence[Number],
        notation: Notation,
        file: int = 0,
        external: Array | None = None,
        in_full: InFull | None = None,
    ) -> int:
        """Add a point of one of the sources, with external axes at a pose; return its index."""
        where = self.sources[file].where(numbers[0].start)
        try:
            value = notation.value([number.value for number in numbers])
        except DataError as error:
            raise DataError(f'{where}: {error}') from None
        self.points.append(Point(name, where, tuple(numbers), notation, value, external, in_full))
        return len(self.points) - 1

    def add(self, step: Step) -> None:
        """Add a move to the routine at hand."""
        self.pieces[-1].append(step)

    def unknown(self, kind: Kind, where: str, why: str) -> None:
        """Add a move that is not understood; ``kind`` says whether it is part of a seam."""
        self.add(Step(kind, where, why=why))

    def dwell(self, seconds: float) -> None:
        """Let the move before last longer."""
        if self.pieces[-1]:
            last = self.pieces[-1][-1]
            self.pieces[-1][-1] = replace(last, dwell=last.dwell + seconds, stop=True)

    def new_piece(self) -> None:
        """Begin another routine."""
        if self.pieces[-1]:
            self.pieces.append([])

    def hold(self, point: int, why: str) -> None:
        """Keep a point from being moved."""
        self.fixed.setdefault(point, why)

    def stands_beside(self, point: int, axes: Sequence[float]) -> None:
        """Take in where a point has external axes that the robot file does not have."""
        if any(axes):
            self.hold(point, f'{self.points[point].name} moves external axes')
            self.beside = self.beside or self.points[point].where
        elif not axes:
            self.silent.append(point)

    def hold_silent(self) -> None:
        """Keep points that do not say where external axes stand, if such axes move."""
        for point in self.silent if self.beside else ():
            self.hold(
                point,
                f'the program moves external axes at {self.beside}, and {self.points[point].name} does '
                'not say where they stand; write it there, or give a robot file that has them',
            )

    @property
    def steps(self) -> list[Step]:
        return [step for piece in self.pieces for step in piece]


def exchange(moves: list[Step], name: str, held: Frame, other: Frame, first: int = 0) -> None:
    """Give moves from one on, that hold a frame in a field of a name, another one there."""
    new: dict[str, Any] = {name: other}
    for k, step in enumerate(moves[first:], first):
        if getattr(step, name) is held:
            moves[k] = replace(step, **new)


def hold_if_used_elsewhere(
    program: Program, names: dict[str, int], texts: Sequence[str], used: Sequence[set[int]]
) -> None:
    """
    Hold the points whose names stand where they are not understood.

    A point that is assigned, computed with or handed on may come to mean something else. Places of
    names that are understood are given for every file; comments and strings are blanked out.
    """
    for file, text in enumerate(texts):
        for result in re.finditer(r'[A-Za-z_$][\w$]*', text):
            point = names.get(result[0], names.get(result[0].lower()))
            if point is not None and result.start() not in used[file]:
                where = program.sources[file].where(result.start())
                program.hold(point, f'{result[0]} is used at {where} in a way not understood')


def to_moves(program: Program, robot: Robot, controller: Controller) -> MoveProgram:
    """
    Return the points and moves of a program on a robot.

    Moves from one joint move to the next make a seam, together with the point it begins at.
    """
    count = len(controller.external)
    controller.name_tools(step.tool for step in program.steps)
    arm = CarriedArm(robot.with_frames(base=np.eye(4)), count)
    points = [
        point if point.value.ndim == 2 else point._replace(external=point.value[:count])
        for point in program.points
    ]
    seam, pieces = -1, []
    for steps in program.pieces:
        seam += 1
        moves: list[Move] = []
        for step in steps:
            if step.kind == 'joint' and moves and not program.one_seam:
                seam += 1
            moves.append(_move(step, seam, arm, controller, points))
        if moves:
            pieces.append(tuple(moves))
    still = np.zeros(count)
    external = tuple(still if point.external is None else point.external for point in points)
    values = tuple(point.value for point in points)
    return MoveProgram(values, tuple(pieces), external if count else ())


def _move(
    step: Step, seam: int, arm: CarriedArm, controller: Controller, points: Sequence[Point]
) -> Move:
    try:
        if step.end is None or step.shift.why:
            raise DataError(step.why or step.shift.why)
        tool = controller.tool(step.tool)
        base, along = _base(step, points[step.end.point], arm, controller)
    except DataError as error:
        # Its points stay as they are, wherever else they are used: else it would not be left.
        end, via = (
            None if ref is None else Use(ref.point, np.eye(4), np.eye(4), False)
            for ref in (step.end, step.via)
        )
        return Move('unknown', end, np.eye(4), via, where=step.where, seam=seam, why=str(error))
    return Move(
        step.kind,
        _use(step.end, base),
        tool,
        None if step.via is None else _use(step.via, base),
        step.speed,
        step.stop,
        step.dwell,
        step.duration,
        None if step.suits is None else partial(step.suits, controller),
        None if step.astray is None else partial(step.astray, controller),
        step.where,
        seam,
        along=along,
    )


def _base(step: Step, end: Point, arm: CarriedArm, controller: Controller) -> tuple[Array, bool]:
    """Return the base frame of a move where the chain begins, and whether it goes along."""
    if not arm.count:
        return controller.base(step.base), True
    if end.external is None:
        raise DataError(f'{end.name} does not say where the external axes stand')
    if end.value.ndim == 1:
        return np.eye(4), step.along
    base, along = controller.base(step.base), controller.goes_along(step.base)
    return base if along else np.asarray(arm.roots(end.external) @ base), along and step.along


def _use(ref: Ref, base: Array) -> Use:
    before = base if ref.before is None else base @ ref.before
    return Use(ref.point, before, np.eye(4) if ref.after is None else ref.after, ref.leads)


SIGN_DOUBT = np.radians(0.5)
"""An axis this near zero may have either sign in T, which was worked out from other digits."""
QUADRANT_DOUBT = np.radians(0.5)
"""An axis this near the edge of its quadrant may count to either."""


def turn_bits(turn: int) -> Suits:
    """Return what takes postures whose axes have the signs of T: bit k is axis k + 1 below 0."""

    def suits(controller: Controller, q: Array) -> Array:
        return np.asarray((_against(turn, _shown(controller, q)) < SIGN_DOUBT).all(axis=1))

    return suits


def _against(turn: int, axes: Array) -> Array:
    """Return how far axes (..., n) are on the other side of zero than the signs of T say [rad]."""
    below = np.array([bool(turn >> k & 1) for k in range(axes.shape[-1])])
    return np.where(below, axes, -axes)


FLAG_DOUBT = np.radians(1e-3)
"""An axis this near where a flag changes may count to either side: points have no more digits."""


Flag = tuple[int, float, float]
"""An axis, one of the angles at which a flag of it changes, and after how much the next is [180 deg]."""
TURNS: tuple[Flag, ...] = ((1, 1.0, 2.0), (4, 1.0, 2.0), (6, 1.0, 2.0))
"""The counted turns of axes 1, 4 and 6."""
WRIST: Flag = (5, 0.0, 2.0)
"""The side to which the wrist is bent."""


def signs_kept(turn: int) -> Astray:
    """Return what tells the axes that have not the signs of T, as `turn_bits` takes it."""

    def astray(controller: Controller, _: Array, after: Array) -> tuple[int, ...]:
        away = _against(turn, _shown(controller, after))
        return tuple((np.flatnonzero(away > FLAG_DOUBT) + 1).tolist())

    return astray


def flags_kept(kind: Kind, point: Point, flags: Sequence[Flag]) -> Astray | None:
    """
    Return what tells the axes that pass where flags change; of joint moves to poses alone.

    One flag too many leaves a point as it was, one too few turns an arm round.
    """
    if kind != 'joint' or point.notation.joints:
        return None

    def astray(controller: Controller, before: Array, after: Array) -> tuple[int, ...]:
        both = np.stack([_shown(controller, q) for q in (before, after)])
        moved = np.abs(both[1] - both[0]) > FLAG_DOUBT
        out = set[int]()
        for axis, angle, period in flags:
            at = both[:, axis - 1 : axis]
            sides = np.floor((at - angle * np.pi) / (period * np.pi))
            if (sides[0] != sides[1]).any() and moved[axis - 1]:
                out.add(axis)
        return tuple(sorted(out))

    return astray


def _shown(controller: Controller, q: Array) -> Array:
    """Return the arm's own axes as the controller shows them, of joint positions (..., n)."""
    back = np.linalg.inv(controller.mix)
    return np.asarray(q @ back.T[:, : q.shape[-1] - len(controller.external)])


def quadrants(conf: Sequence[int]) -> Suits:
    """
    Return what takes the postures whose axes 1, 4 and 6 are in the quadrants of a confdata.

    Its cfx is left out: what that means depends on the arm.
    """

    def suits(controller: Controller, q: Array) -> Array:
        own = q[:, len(controller.external) :]
        if own.shape[1] < 6:
            return np.ones(len(q), dtype=bool)
        low, axes = np.array(conf[:3]) * 0.5 * np.pi, own[:, [0, 3, 5]]
        inside = (axes > low - QUADRANT_DOUBT) & (axes < low + 0.5 * np.pi + QUADRANT_DOUBT)
        return np.asarray(inside.all(axis=1))

    return suits


def nearest(near: Array) -> Suits:
    """Return what takes the posture nearest given joint positions, as qnear does."""

    def suits(_: Controller, q: Array) -> Array:
        away = np.abs(q - near).sum(axis=1)
        return np.asarray(away == away.min())

    return suits


SAME = (5.1e-6, 5.1e-5)
"""Rounding of a written length [m] and angle [rad] at most: the coarsest of the languages has a
thousandth of a millimetre and of a degree, and three coordinates add up."""
UNMOVED = 1e-9
"""Change of a point [m, rad] that is rounding: its digits stay as they are."""


def rewritten(program: Program, points: Sequence[Array], moved: Collection[int]) -> list[str]:
    """Return the texts of the files with some points moved to the values of all points."""
    edits: list[tuple[int, int, int, str]] = []
    other = {k for k in moved if np.abs(points[k] - program.points[k].value).max() >= UNMOVED}
    for k in sorted(moved):
        point = program.points[k]
        if k not in other and (point.in_full is None or point.in_full.before not in other):
            continue
        old = [number.value for number in point.numbers]
        new = point.notation.numbers(points[k], old)
        length, angle = point.notation.decimals
        least = [angle if point.notation.joints or n > 2 else length for n in range(len(new))]
        if point.in_full is not None:
            full = [numeral(value, '', digits) for value, digits in zip(new, least, strict=True)]
            edits += [(0, at, end, form.format(*full)) for at, end, form in point.in_full.edits]
            continue
        for number, value, digits in zip(point.numbers, new, least, strict=True):
            written = program.sources[number.file].text[number.start : number.end]
            text = numeral(value, written, digits)
            if abs(value - number.value) > 0.5 * 10.0 ** -max(digits, _decimals(written)):
                edits.append((number.file, number.start, number.end, text))
    out = [source.text for source in program.sources]
    for file, start, end, text in sorted(edits, reverse=True):
        out[file] = out[file][:start] + text + out[file][end:]
    return out


def numeral(value: float, old: str, least: int) -> str:
    """Return a number as text, with the digits and the written sign of the old one."""
    text = f'{value:.{max(least, _decimals(old)) if least else 0}f}'
    if re.fullmatch(r'-0(\.0*)?', text):
        text = text[1:]
    return f'+{text}' if old.startswith('+') and not text.startswith('-') else text


def _decimals(text: str) -> int:
    result = re.search(r'\.(\d+)', text)
    return min(len(result[1]), 12) if result and 'e' not in text.lower() else 0


def check_written(before: Program, after: Program, points: Sequence[Array]) -> None:
    """Refuse a program that does not say what it was to say when it is read again."""
    same = len(before.points) == len(after.points) and len(before.steps) == len(after.steps)
    if same:
        for one, other in zip(before.steps, after.steps, strict=True):
            same &= (one.kind, one.stop, one.where) == (other.kind, other.stop, other.where)
        for value, was, point in zip(points, before.points, after.points, strict=True):
            same &= _close(value, point) and _same_external(was, point)
    if not same:
        raise DataError(
            f'{before.sources[0].name}: the corrected program reads differently from what was '
            'meant, so it is not written'
        )


def _same_external(was: Point, point: Point) -> bool:
    if was.external is None or point.external is None:
        return was.external is point.external
    return bool(np.abs(was.external - point.external).max(initial=0.0) < UNMOVED)


def _close(value: Array, point: Point) -> bool:
    if value.shape != point.value.shape:
        return False
    if np.abs(value - point.value).max() < UNMOVED:
        return True
    if value.ndim == 1:
        # A pulse is some ten thousandths of a degree; the digits written bound the rest.
        unit = 10.0 ** -point.notation.decimals[1] if point.notation.decimals[1] else 1.0
        off = np.array(point.notation.numbers(value, [n.value for n in point.numbers]))
        return bool(np.abs(off - [n.value for n in point.numbers]).max() <= 0.51 * unit)
    turn = rotation_vector(value[:3, :3] @ point.value[:3, :3].T)
    away = np.abs(value[:3, 3] - point.value[:3, 3]).max()
    return bool(away <= SAME[0] and np.abs(turn).max() <= SAME[1])
