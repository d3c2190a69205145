# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Points of a program moved so that the real tool goes where the program meant.

Each round runs the program on the twin as a controller would, in its postures and directions,
and moves every point by what is missing where it is used. A point that several moves use gets the
mean of what they miss. Seams are corrected whole or not at all: a step in a weld is worse than an
error that is the same along it.

Play that turns around between two points can make the worst place of a seam worse than it was, for
points can only be moved where there are some. A seam whose worst place gains too little is corrected
without what has a memory, and left where that gains too little as well.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arm.chain import chain_jacobian, forward, frames
from ..arm.robot import Robot
from ..arm.rotation import missing
from ..arm.rotation import moved as displaced
from ..arrays import Array
from ..errors import DataError, PathError
from ..motion.programs import Move, MoveProgram, Piece, Travel, Use, travel
from ..motion.programs.travel import finer, refined, repeated, unrelenting
from ..recording import JointMotion
from .compensation import beyond_limits, least_command
from .posterior import Drawn, largest_sigma
from .program_model import ProgramModel

_ROUNDS = 5
"""Rounds of moving points; effects are small, each takes away all but some thousandths."""
_APART = (2e-4, 2e-3)
"""Two uses of one point may want corrections this far apart [m, rad]; the mean serves both."""
BETTER = 0.8
"""Share of its worst error that a seam may keep: of arms with sealed causes that were to keep more, five
came out farther off than before, up to twice as far."""
NOTHING = 1e-9
"""Error [m] that is rounding."""
_PARTS, _LOOKS = 10, 20_000
"""Parts of a step between two samples that is looked at for what is expected: of a centimetre of a
seam each millimetre, for play turns around in a few of them. Fewer of programs that would take more
looks than that, a matrix of them and all models drawn being 64 MB."""
_WORTH = 0.5
"""Share of a correction that must be trusted: below it the doubt is larger than the correction."""


_Written = Callable[[Sequence[Array]], Sequence[Array]]
"""From points to what they read like once they are written."""


class Caps(NamedTuple):
    """How far a point may be moved at most: ``length`` [m] and ``turn`` [rad]."""

    length: float = 2e-3
    turn: float = np.pi / 180.0


def too_large(length: float, turn: float, most: tuple[float, float]) -> str:
    """Return that a point would move by more than is allowed [m, rad]."""
    return (
        f'a point would move by {length * 1e3:.3f} mm and {np.degrees(turn):.3f} degrees, at most '
        f'{most[0] * 1e3:g} mm and {np.degrees(most[1]):g} degrees are allowed'
    )


class _MoveResult(NamedTuple):
    """What a correction does to one move."""

    length: float
    turn: float
    """How far the place it leads to was moved [m, rad]."""
    before: float | None = None
    after: float | None = None
    """Expected distance of the real tool from there [m]; None where it is not followed."""
    outside: str = ''
    """Why the move leaves what was recorded; empty where it does not."""
    sigma: float | None = None
    """Standard deviation of where the real tool will be, in its worst direction [m]; None where
    the model says nothing of how sure it is."""


@dataclass(frozen=True, eq=False)
class ProgramCorrection:
    """A corrected program and what is expected of it."""

    program: MoveProgram
    """With the points moved."""
    travel: Travel
    """The motion of the program as it was."""
    left: dict[int, str]
    """Seams that were left as they were, with the reason."""
    calm: dict[int, str]
    """Seams that were corrected without play, friction and lag, with the reason."""
    held: frozenset[int]
    """Points that were not moved."""
    looks: tuple[Piece, ...]
    """The same motion at finer steps: what is expected is of these samples."""
    before: tuple[Array, ...]
    after: tuple[Array, ...]
    """What is missing to the whole real tool at looks of every piece, (N, 6) [m, rad]."""
    ways: tuple[Array, ...]
    """How far the tool goes to every look, shape (N,) [m]."""
    drawn: tuple[Drawn | None, ...]
    results: tuple[_MoveResult, ...]
    """One for every move, in the order of the program."""


def correct_program(
    model: ProgramModel,
    program: MoveProgram,
    *,
    held: dict[int, str] | None = None,
    caps: Caps | None = None,
    start: Array | None = None,
    written: _Written | None = None,
) -> ProgramCorrection:
    """
    Return a program whose points are moved so that the real tool goes where it was to go.

    Points that are held must not be moved, with the reason; their seams are left as they were. The
    arm is at ``start`` (n,) before the first move. ``written`` returns points as they read once
    they are written; a language has only so many digits.
    """
    way = travel(model.robot, program, start, model.recorded if model.posterior else None)
    work = _Work(model, program, way, caps or Caps(), model.without_memory(), written)
    remaining = dict(work.travel.lost)
    for seam, why in _held_seams(program, held or {}).items():
        remaining.setdefault(seam, why)
    calm: dict[int, str] = {}
    moved = work.solved(_spread(program, remaining), calm)
    for _ in range(2 * len(work.seams) + 1):
        result = work.refused(moved, remaining, calm)
        result = result or work.unsettled(moved, remaining, calm)
        if not result:
            break
        for seam, why in result.items():
            (remaining if work.still is None or seam in calm else calm).setdefault(seam, why)
        moved = work.solved(_spread(program, remaining), calm)
    calm = {seam: why for seam, why in calm.items() if seam not in remaining}
    return work.result(moved, remaining, calm)


class _Work(NamedTuple):
    """What a correction works on."""

    model: ProgramModel
    program: MoveProgram
    travel: Travel
    caps: Caps
    still: ProgramModel | None
    written: _Written | None

    @property
    def seams(self) -> list[int]:
        return sorted({move.seam for piece in self.program.pieces for move in piece})

    def gap(self, piece: Piece, motion: JointMotion, calm: Collection[int] = ()) -> Array:
        """Return what is missing to the tool, (N, 6) [m, rad], in calm seams without memory."""
        wanted = self.model.wanted(piece)
        gap = missing(wanted, self.model.real(piece, motion))
        if calm and self.still is not None:
            chosen = np.array([move.seam in calm for move in piece.moves])[piece.move]
            gap[chosen] = missing(wanted, self.still.real(piece, motion))[chosen]
        return gap

    def solved(self, still: set[int], calm: Collection[int]) -> MoveProgram:
        """Return the program with every point moved but those that stay."""
        moved = self.program
        for _ in range(_ROUNDS):
            steps: dict[int, list[Array]] = {}
            for piece in self.travel.pieces:
                try:
                    motion = repeated(self.model.robot, moved, piece)
                except PathError:
                    continue  # its seams are refused for it
                for point, step in self._steps(moved, piece, motion, calm):
                    steps.setdefault(point, []).append(step)
            points = list(moved.points)
            for point, result in steps.items():
                if point not in still:
                    points[point] = _stepped(points[point], np.mean(result, axis=0))
            moved = moved.with_points(points)
        return moved if self.written is None else moved.with_points(self.written(moved.points))

    def _steps(
        self, moved: MoveProgram, piece: Piece, motion: JointMotion, calm: Collection[int]
    ) -> Iterator[tuple[int, Array]]:
        """Yield each point that is used and what that use misses, in the point's own coordinates."""
        gap = self.gap(piece, motion, calm)
        for k, move in enumerate(piece.moves):
            for use, at in ((move.via, piece.vias[k]), (move.end, piece.ends[k])):
                if use is None or not use.leads:
                    continue
                point = moved.points[use.point]
                if point.ndim == 1:
                    arm = self.model.arm(move.tool)
                    jacobian = chain_jacobian(arm, frames(arm, motion.q[at]))
                    step = np.zeros(arm.n)  # external axes go where they went
                    own = slice(moved.external, None)
                    step[own] = least_command(jacobian[:, own], gap[at])
                else:
                    step = _own(moved.place(use), use, point, gap[at])
                yield use.point, step

    def refused(
        self, moved: MoveProgram, remaining: dict[int, str], calm: Collection[int]
    ) -> dict[int, str]:
        """Return the seams that must not be corrected this way, with the reason."""
        out: dict[int, str] = {}
        for piece in self.travel.pieces:
            try:
                motion = repeated(self.model.robot, moved, piece)
                self.model.robot.check_positions(motion.q)
            except (PathError, DataError) as error:
                for move in piece.moves:
                    out.setdefault(move.seam, f'{move.where}: {error}')
                continue
            hard = _too_hard(self.model.robot, piece, motion)
            shares = self._trust(piece)
            for k, move in enumerate(piece.moves):
                ends = (each.q[piece.ends[k]] for each in (piece.motion, motion))
                why = hard.get(k) or self._why_not(moved, piece, k, shares) or _wound(move, *ends)
                if why:
                    out.setdefault(move.seam, f'{move.where}: {why}')
        return {seam: why for seam, why in out.items() if seam not in remaining}

    def _why_not(self, moved: MoveProgram, piece: Piece, k: int, shares: Array | None) -> str:
        move = piece.moves[k]
        for use in move.uses:
            length, turn = self.moved_by(moved, use, move.tool)
            if length > self.caps.length or turn > self.caps.turn:
                return too_large(length, turn, self.caps)
        if shares is not None and shares[piece.ends[k]] < _WORTH:
            return 'the model is less sure of this place than the correction is large'
        return ''

    def unsettled(
        self, moved: MoveProgram, remaining: dict[int, str], calm: Collection[int]
    ) -> dict[int, str]:
        """Return the seams that points cannot be moved for, with the reason."""
        out: dict[int, str] = {}
        worst: dict[int, tuple[float, float, str]] = {}
        seen: dict[int, list[Array]] = {}
        for piece in self.travel.pieces:
            motion = repeated(self.model.robot, moved, piece)
            meant = self.gap(piece, motion, calm)
            sizes = np.array([self._sizes(piece, one) for one in (piece.motion, motion)])
            for k, move in enumerate(piece.moves):
                off = meant[piece.ends[k]]
                apart = np.linalg.norm(off[:3]) > _APART[0] or np.linalg.norm(off[3:]) > _APART[1]
                if apart and move.end is not None and move.end.leads:
                    size = f'{np.linalg.norm(off[:3]) * 1e3:.3f} mm would be left here'
                    out.setdefault(move.seam, f'{move.where}: {size}, {self._left(move.end)}')
                # How the arm comes to where a seam begins does not matter, only that it gets there.
                chosen = piece.move == k if move.seam in worst else piece.ends[[k]]
                before, after = sizes[:, chosen].max(axis=1).tolist()
                seen.setdefault(move.seam, []).append(sizes[:, chosen])
                old = worst.get(move.seam, (0.0, -1.0, ''))
                where = move.where if after > old[1] else old[2]
                worst[move.seam] = max(before, old[0]), max(after, old[1]), where
        for seam, (before, after, where) in worst.items():
            usual = np.sqrt((np.concatenate(seen[seam], axis=1) ** 2).mean(axis=1)).tolist()
            if after > BETTER * before + NOTHING:
                out.setdefault(seam, f'{where}: {_worse(before, after)}')
            elif usual[1] > usual[0] + NOTHING:
                way = f'{usual[1] * 1e3:.3f} mm off, RMS, instead of {usual[0] * 1e3:.3f} mm'
                out.setdefault(seam, f'{where}: over all of its way it would be {way}')
        return {seam: why for seam, why in out.items() if seam not in remaining}

    def _sizes(self, piece: Piece, motion: JointMotion) -> Array:
        """Return how far off the tool is, shape (N,) [m], however the controller eases in and out."""
        gaps = [self.gap(piece, m)[:, :3] for m in (motion, unrelenting(piece, motion))]
        return np.asarray(np.linalg.norm(gaps, axis=2).max(axis=0))

    def _left(self, use: Use) -> str:
        """Return why the correction of a point leaves something."""
        moves = [move for piece in self.program.pieces for move in piece]
        shared = sum(u.leads and u.point == use.point for move in moves for u in move.uses) > 1
        if shared:
            return 'for the point is used by other moves that need another correction'
        return 'for the correction itself would turn a joint around, and lost motion the other way'

    def moved_by(self, moved: MoveProgram, use: Use, tool: Array) -> tuple[float, float]:
        """Return how far the place of a use, with a tool (4, 4), moved in a program [m, rad]."""
        old, new = self.program.place(use), moved.place(use)
        if old.ndim == 1:
            old, new = forward(self.model.arm(tool), np.stack([old, new]))
        shift, turn = np.split(missing(new, old), 2)
        return float(np.linalg.norm(shift)), float(np.linalg.norm(turn))

    def _trust(self, piece: Piece) -> Array | None:
        posterior = self.model.posterior
        covariance = self.model.covariances(piece, piece.motion)
        if posterior is None or covariance is None:
            return None
        gap = missing(self.model.wanted(piece), self.model.real(piece, piece.motion))
        return posterior.domain.trust(piece.motion.q, gap[:, :3], covariance[:, :3, :3])

    def result(
        self, moved: MoveProgram, remaining: dict[int, str], calm: dict[int, str]
    ) -> ProgramCorrection:
        before, after, ways, drawn = [], [], [], []
        samples = sum(piece.motion.t.size for piece in self.travel.pieces)
        parts = int(np.clip(_LOOKS // max(samples, 1), 1, _PARTS))
        looks = tuple(refined(piece, parts) for piece in self.travel.pieces)
        for piece, look in zip(self.travel.pieces, looks, strict=True):
            aim = self.model.wanted(look)
            motion = _looked_at(piece, repeated(self.model.robot, moved, piece), look, parts)
            before.append(missing(aim, self.model.real(look, look.motion, whole=True)))
            after.append(missing(aim, self.model.real(look, motion, whole=True)))
            steps = np.diff(aim[:, :3, 3], axis=0, prepend=aim[:1, :3, 3])
            ways.append(np.linalg.norm(steps, axis=1))
            drawn.append(self.model.drawn(look, look.motion))
        return ProgramCorrection(
            moved,
            self.travel,
            remaining,
            calm,
            frozenset(_spread(self.program, remaining)),
            looks,
            tuple(before),
            tuple(after),
            tuple(ways),
            tuple(drawn),
            self._results(moved, looks, before, after),
        )

    def _results(
        self,
        moved: MoveProgram,
        looks: Sequence[Piece],
        before: Sequence[Array],
        after: Sequence[Array],
    ) -> tuple[_MoveResult, ...]:
        seen: dict[int, tuple[float, float, str, float | None]] = {}
        for k, piece in enumerate(self.travel.pieces):
            outside = _outside(self.model, piece)
            spread = self.model.covariances(piece, piece.motion)
            sigma = None if spread is None else largest_sigma(spread[piece.ends])
            for m, move in enumerate(piece.moves):
                ends = (gaps[k][looks[k].ends[m], :3] for gaps in (before, after))
                first, then = (float(np.linalg.norm(end)) for end in ends)
                doubt = None if sigma is None else float(sigma[m])
                seen[id(move)] = first, then, outside.get(m, ''), doubt
        out = []
        for move in (move for piece in self.program.pieces for move in piece):
            by = (0.0, 0.0) if move.end is None else self.moved_by(moved, move.end, move.tool)
            out.append(_MoveResult(*by, *seen.get(id(move), (None, None, '', None))))
        return tuple(out)


def _looked_at(piece: Piece, motion: JointMotion, look: Piece, parts: int) -> JointMotion:
    """
    Return a corrected motion at looks.

    What it differs by is made finer by itself: how fast a joint goes between two samples hangs on
    the samples beside them, and a move that a correction alone gives a length would shift all of
    the way to the next sample.
    """
    apart = finer(JointMotion(motion.t, motion.q - piece.motion.q), parts)
    return JointMotion(look.motion.t, look.motion.q + apart.q)


def _too_hard(robot: Robot, piece: Piece, motion: JointMotion) -> dict[int, str]:
    """Return the moves between timed points where a correction is beyond limits, and how."""
    dt = np.array([move.duration for move in piece.moves[1:]])
    if not dt.size or dt.min() <= 0.0:
        return {}
    leaps = beyond_limits(robot, (motion.q - piece.motion.q)[piece.ends], dt)
    return {k + 1: why for k, why in leaps.items()}


def _wound(move: Move, before: Array, after: Array) -> str:
    """Return that the flags of a point, which stay as written, would turn an axis or flip the wrist."""
    axes = () if move.astray is None else move.astray(before, after)
    if not axes:
        return ''
    named = ', '.join(map(str, axes))
    return (
        f'axis {named} would pass an angle at which the flags of the point change, and these stay as '
        'written: the controller would turn it by 360 degrees, or flip the wrist; give this point in '
        'joints'
    )


def _worse(before: float, after: float) -> str:
    return (
        f'its worst place would be {after * 1e3:.3f} mm off instead of {before * 1e3:.3f} mm; too '
        'little is gained there, as where play turns around or lag sets in between two points'
    )


def _own(place: Array, use: Use, point: Array, gap: Array) -> Array:
    """Return the step of a point, shape (6,), that moves a place made of it by a gap."""
    wanted = np.linalg.inv(use.before) @ displaced(place, gap) @ np.linalg.inv(use.after)
    return missing(wanted, point)


def _stepped(point: Array, step: Array) -> Array:
    return np.asarray(point + step) if point.ndim == 1 else displaced(point, step)


def _held_seams(program: MoveProgram, held: dict[int, str]) -> dict[int, str]:
    """Return the seams that use a point which must not be moved."""
    out: dict[int, str] = {}
    for move in (move for piece in program.pieces for move in piece):
        for use in move.uses:
            if use.point in held:
                out.setdefault(move.seam, f'{move.where}: {held[use.point]}')
    return out


def _spread(program: MoveProgram, remaining: dict[int, str]) -> set[int]:
    """Return the points of seams that are left, and leave the seams that share one with them."""
    moves = [move for piece in program.pieces for move in piece]
    still: set[int] = set()
    while True:
        more = {u.point for move in moves if move.seam in remaining for u in move.uses} - still
        if not more:
            return still
        still |= more
        for move in moves:
            if move.seam not in remaining and any(u.point in still for u in move.uses):
                remaining[move.seam] = (
                    f'{move.where}: a point of this seam belongs to one that is left as it was'
                )


def _outside(model: ProgramModel, piece: Piece) -> dict[int, str]:
    """Return the moves of a piece that leave what was recorded, and why."""
    out: dict[int, str] = {}
    for first, last, why in model.outside(piece.motion):
        for k in np.unique(piece.move[first : last + 1]):
            out.setdefault(int(k), why)
    return out


_SPAN = (5.0, 95.0)
"""Percentiles between which nine of ten draws lie."""
SURE = 0.95
"""Probability from which on a tolerance counts as kept, or as not kept: what a guard band of ISO 14253-1
leaves to chance, five in a hundred."""


class Accuracy(NamedTuple):
    """Distance of the real tool from where it is wanted [m]."""

    rms: float
    """Expected; what the model is not sure of adds to it."""
    worst: float
    """By the model's own prediction."""
    low: float | None = None
    high: float | None = None
    """Nine of ten models that the recordings allow, and the one found, have their RMS between
    these, in the set-up recorded and in the robot's own base; None where the model says nothing of
    how sure it is."""
    same: tuple[float, float] | None = None
    """The same in the set-up that was recorded."""
    worsts: Array | None = None
    """Largest distance under every model, by set-up and by the robot's own base, (2, D) [m]."""

    def within(self, tolerance: float, *, same_setup: bool = False) -> float | None:
        """Return the probability that the tool stays within a tolerance [m] all the way."""
        if self.worsts is None:
            return None
        worsts = self.worsts[:1] if same_setup else self.worsts
        return float((worsts <= tolerance).mean(axis=1).min())

    def likely_within(self, probability: float, *, same_setup: bool = False) -> float | None:
        """Return the least tolerance [m] that is kept all the way with a probability."""
        if self.worsts is None:
            return None
        worsts = self.worsts[:1] if same_setup else self.worsts
        return float(np.quantile(worsts, probability, axis=1).max())

    @property
    def sure_within(self) -> float | None:
        """Return the least tolerance [m] that is kept all the way with `SURE` probability."""
        return self.likely_within(SURE)


def conforms(probability: float) -> str:
    """Return 'kept', 'not kept' or, within the guard band of ISO 14253-1, 'open' by a probability."""
    if probability >= SURE:
        return 'kept'
    return 'not kept' if probability <= 1.0 - SURE else 'open'


def accuracy(
    gaps: Sequence[Array], drawn: Sequence[Drawn | None], ways: Sequence[Array] | None = None
) -> Accuracy | None:
    """
    Return the accuracy over samples, or None without any.

    By the gaps (N, 6) [m, rad] of the model and what is drawn of the same samples, each of which
    stands for so much of the way (N,) [m]; all alike without.
    """
    gap = np.concatenate([np.zeros((0, 3)), *(g[:, :3] for g in gaps)])
    if not len(gap):
        return None
    share = np.ones(len(gap)) if ways is None else np.concatenate(ways)
    share = share / share.sum()
    square = (gap**2).sum(axis=1)
    rms, worst = float(np.sqrt(share @ square)), float(np.sqrt(square.max()))
    known = [d for d in drawn if d is not None]
    if len(known) < len(drawn):
        return Accuracy(rms, worst)
    pairs = [(g[:, :3], d) for g, d in zip(gaps, known, strict=True)]
    same, own = (
        _drawn([(g, d.near, d.off[:, where]) for g, d in pairs], share) for where in (0, 1)
    )
    # Drawn models are off by something everywhere. The one that was found, which may be off by
    # nothing, is allowed as well.
    low, high = np.percentile([same[0], own[0]], _SPAN, axis=1)
    low, high = np.minimum(low, rms), np.maximum(high, rms)
    return Accuracy(
        float(np.sqrt((same[0] ** 2).mean())),
        worst,
        float(low.min()),
        float(high.max()),
        (float(low[0]), float(high[0])),
        np.stack([same[1], own[1]]),
    )


def _drawn(
    parts: Sequence[tuple[Array, NDArray[np.int_], Array]], share: Array
) -> tuple[Array, Array]:
    """Return RMS and largest distance under every model drawn, shape (D,) each [m]."""
    squares = np.concatenate(
        [
            [((gap - off[near, k]) ** 2).sum(axis=1) for k in range(off.shape[1])]
            for gap, near, off in parts
        ],
        axis=1,
    )
    return np.sqrt(squares @ share), np.sqrt(squares.max(axis=1))


def on_seams(result: ProgramCorrection) -> list[NDArray[np.bool_]]:
    """
    Return which moves of every piece go along a corrected seam, each (K,).

    How the arm comes to where a seam begins does not matter: a joint move that is the first of its seam.
    A joint trajectory is a seam of joint moves.
    """
    begun, out = set[int](), []
    for piece in result.travel.pieces:
        along = []
        for move in piece.moves:
            led = move.kind != 'joint' or move.seam in begun
            along.append(led and move.seam not in result.left)
            begun.add(move.seam)
        out.append(np.array(along, dtype=bool))
    return out


def along_seams(result: ProgramCorrection) -> tuple[Accuracy | None, Accuracy | None]:
    """Return the accuracy along corrected seams, before and after; of all moves without any."""
    pieces = result.looks
    ways = [_along(result, k, seams) for k, seams in enumerate(on_seams(result))]
    if not any(way.any() for way in ways):
        ways = [_ends(piece.motion.t.size, piece.ends) for piece in pieces]
    chosen = [way > 0.0 for way in ways]
    drawn = [
        None if d is None else d.where(keep) for d, keep in zip(result.drawn, chosen, strict=True)
    ]
    shares = [way[keep] for way, keep in zip(ways, chosen, strict=True)]
    before, after = (
        accuracy([g[keep] for g, keep in zip(gaps, chosen, strict=True)], drawn, shares)
        for gaps in (result.before, result.after)
    )
    return before, after


def _along(result: ProgramCorrection, k: int, seams: NDArray[np.bool_]) -> Array:
    """Return how much of the way along corrected seams the samples of a piece stand for, (N,) [m]."""
    steps = np.where(seams[result.looks[k].move], result.ways[k], 0.0)
    # A seam begins where the move before it ends.
    return np.asarray(0.5 * (steps + np.append(steps[1:], 0.0)))


def _ends(count: int, ends: np.ndarray) -> Array:
    out = np.zeros(count)
    out[ends] = 1.0
    return out
