# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a robot program says of motion, and the joint motion it makes, as a controller would make it.

Joint moves are straight in joint positions, linear moves straight in position and turned about
one axis, circular moves go through the place on the way. Corners are not rounded: where the arm
goes on without a stop it passes through the point. A controller's own way near such a corner is
not known, and does not matter for where the point itself has to be.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from ...arm.chain import forward
from ...arm.robot import Robot
from ...arm.rotation import angle_between, rotation_matrix, transform
from ...arrays import Array
from ...errors import DataError, PathError, ReachError
from ...recording import JointMotion
from ..inverse import CarriedArm
from ..paths import Arc

Kind = Literal['joint', 'linear', 'circular', 'unknown']


class Use(NamedTuple):
    """
    One use of a point by a move.

    A point that is a pose is used as ``before @ point @ after``: the base frame stands before
    it, a shift in the tool's own frame after it. Joint positions are used as they are.
    """

    point: int
    """Which of the program's points."""
    before: Array
    after: Array
    """Shape (4, 4) [m]."""
    leads: bool = True
    """False for a place derived from the point, such as an approach above it: it goes along when
    the point is moved and has no say in where to."""


class Move(NamedTuple):
    """One move."""

    kind: Kind
    """'joint', 'linear', 'circular'; or 'unknown', after which nobody knows where the arm is."""
    end: Use | None
    """
    None where nobody knows the point. Joint positions of a linear move stand for the pose they make, and
    say how an arm of more than six joints stands there.
    """
    tool: Array
    """``T_flange_tool``, the flange that of the robot's model, shape (4, 4) [m]."""
    via: Use | None = None
    """A place on the arc of a circular move."""
    speed: float = 0.1
    """Of the tool [m/s]; of a joint move the share of the joints' speeds."""
    stop: bool = True
    """The arm comes to rest at the end; else it goes on with the next move."""
    dwell: float = 0.0
    """How long it stays there [s]."""
    duration: float = 0.0
    """How long it takes, where the program says so [s]; else 0."""
    suits: Callable[[Array], Array] | None = None
    """Takes joint positions (K, n), says which of them are the posture the program asks for."""
    astray: Callable[[Array, Array], tuple[int, ...]] | None = None
    """Takes joint positions (n,) before and after a correction, returns the numbers of the axes, counted
    from 1, that the second has where the flags written with the point do not have them."""
    where: str = ''
    """File and line, for messages."""
    seam: int = 0
    """Moves of one number are corrected together or not at all."""
    why: str = ''
    """Of an unknown move, why it is not understood."""
    along: bool = True
    """The frame that a linear or circular move is given in goes along with a positioner. Where it
    stands still, the positioner must, too."""

    @property
    def uses(self) -> list[Use]:
        """Return the uses of points, the place on the way first."""
        return [use for use in (self.via, self.end) if use is not None]


@dataclass(frozen=True, eq=False)
class MoveProgram:
    """Points, and moves between them."""

    points: tuple[Array, ...]
    """A pose, shape (4, 4) [m], or joint positions, shape (n,) [rad or m]."""
    pieces: tuple[tuple[Move, ...], ...]
    """Moves that follow each other; where a piece begins, nobody knows where the arm is."""
    axes: tuple[Array, ...] = ()
    """Of every point the positions of the external axes, shape (m,) [rad or m]: the first joints
    of the robot, those of a positioner among them. Left out, there are none."""

    def with_points(self, points: Sequence[Array]) -> MoveProgram:
        """Return the same moves between other points."""
        return replace(self, points=tuple(points))

    @property
    def external(self) -> int:
        """Return how many of the robot's first joints are external axes."""
        return self.axes[0].size if self.axes else 0

    def external_at(self, use: Use) -> Array:
        """Return where the external axes are to be at a use, shape (m,) [rad or m]."""
        return self.axes[use.point] if self.axes else np.zeros(0)

    def place(self, use: Use) -> Array:
        """Return where a use leads: ``T_base_tool``, shape (4, 4), or joints, shape (n,)."""
        point = self.points[use.point]
        if point.ndim == 1:
            return point
        return np.asarray(use.before @ point @ use.after)


_STEP = 0.01
"""Way of the tool [m] between two samples of a linear or circular move."""
_SAMPLES = (5, 120)
"""Fewest and most samples of a move: enough to follow a posture, and to keep long programs quick."""
_TURN = 0.02
"""Way of a joint [rad or m] between two samples of a joint move."""
_SHORT = 32
"""Samples below which a move is followed from its begin alone."""
_REST = 0.3
"""Stay [s] after which the arm is where its controller wants it; servo lag is some 50 ms."""
_NEAR = 0.15
"""A linear move that would begin farther [rad or m] from the posture so far has to change it."""
_CLOSED = 1e-7
"""Gap [m, rad] up to which a pose counts as reached; programs write micrometres."""
_STANDS = (
    'the positioner moves while the tool goes straight in a frame that stands still; what way it '
    'takes on the workpiece is up to the controller'
)
_LEAST_TIME = 0.02
"""Shortest time [s] of a move."""
_RISE = 0.2
"""Time from a stop to full speed [s], during which speed rises evenly: a judgement, torches reach some
centimetres a second within a few tenths."""


class Piece(NamedTuple):
    """The motion of one piece of a program."""

    moves: tuple[Move, ...]
    motion: JointMotion
    move: np.ndarray
    """Which move each sample belongs to, shape (N,)."""
    ends: np.ndarray
    vias: np.ndarray
    """Sample at which each move ends, and passes its place on the way, shape (M,); -1 for none."""


class Travel(NamedTuple):
    """The motion of a program."""

    pieces: tuple[Piece, ...]
    lost: dict[int, str]
    """Seams that could not be followed, with the reason."""
    assumed: tuple[str, ...] = ()
    """Where the program names no posture and the only known one was taken: file and line."""


_Known = Callable[[Array], Array]
"""Tells which joint positions (K, n) are postures that the arm is known to work in."""


class _Course(NamedTuple):
    """What moves are followed with."""

    robot: Robot
    program: MoveProgram
    known: _Known | None
    lost: dict[int, str]
    assumed: list[str]


class _Reached(NamedTuple):
    """One move followed: its samples, shares of the way and times."""

    q: Array
    t: Array
    via: int


def travel(
    robot: Robot, program: MoveProgram, start: Array | None = None, known: _Known | None = None
) -> Travel:
    """
    Return the motion of a program; seams that cannot be followed are left out, with the reason.

    Every piece starts at joint positions (n,), whatever the base frame. ``known`` tells the
    postures (K, n) that the arm is known to work in: where a program names none and one of them
    alone is, it is taken.
    """
    course = _Course(robot, program, known, {}, [])
    pieces: list[Piece] = []
    for moves in program.pieces:
        pieces += _pieces(course, moves, start)
    return Travel(tuple(pieces), course.lost, tuple(course.assumed))


def _pieces(course: _Course, moves: Sequence[Move], start: Array | None) -> list[Piece]:
    """Return the motion of moves that follow each other, in parts where one cannot be followed."""
    out: list[Piece] = []
    done: list[tuple[Move, _Reached]] = []
    q = start
    for move in moves:
        try:
            reached = _followed(course, move, q)
        except (PathError, DataError) as error:
            course.lost.setdefault(move.seam, f'{move.where}: {error}')
            if done:
                out.append(_joined(done))
            done, q = [], None
            continue
        done.append((move, reached))
        q = reached.q[-1]
    if done:
        out.append(_joined(done))
    return out


def _followed(course: _Course, move: Move, q: Array | None) -> _Reached:
    """Return the samples of a move that begins at joint positions, None for an unknown place."""
    if move.end is None or move.kind == 'unknown':
        raise PathError(move.why or 'this move is not understood')
    arm = course.robot.with_frames(base=np.eye(4), tool=move.tool)
    chain = CarriedArm(arm, course.program.external)
    if move.kind == 'joint' or (q is None and move.via is None):
        return _joint_move(chain, course, move, q)
    if q is None:
        raise PathError(
            'where the arm comes from is not known; let a joint move lead there, or say the '
            'joints with --start'
        )
    external = course.program.external_at(move.end)
    turned = np.abs(external - q[: external.size])[: arm.behind].max(initial=0.0)
    if turned > _CLOSED and not move.along:
        raise PathError(_STANDS)
    poses, via = _tool_way(arm, course.program, move, forward(arm, q))
    share = np.linspace(0.0, 1.0, len(poses))[:, None]
    place = course.program.place(move.end)
    way = _on_the_way(
        chain,
        poses,
        q,
        q[: external.size] + share * (external - q[: external.size]),
        q + share * (place - q) if place.ndim == 1 else None,
    )
    arm.check_positions(way)
    length = float(np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1).sum())
    turn = float(np.linalg.norm(angle_between(poses[-1, :3, :3], poses[0, :3, :3])))
    # A move that only turns the tool takes as long as one on which its end 0.2 m away travels.
    duration = max(max(length, 0.2 * turn) / max(move.speed, 1e-3), _LEAST_TIME)
    return _Reached(way, np.linspace(0.0, move.duration or duration, len(way)), via)


def _on_the_way(
    chain: CarriedArm, poses: Array, q: Array, external: Array, even: Array | None
) -> Array:
    """
    Return joint positions along poses that begin where the arm stands, shape (K, n).

    even: on an even way to the joint positions at which the program has it arrive, if it says them:
    poses leave open how an arm of more than six joints stands.
    """
    starts = [] if even is None else [even]
    if len(poses) < _SHORT:
        starts.append(chain.whole(external, np.tile(q[external.shape[1] :], (len(poses), 1))))
    for start in starts:
        near, error = chain.polish(start, poses)
        steps = np.abs(np.diff(near, axis=0, prepend=q[None])).max()
        if np.abs(error).max() < _CLOSED and steps < _NEAR:
            return near
    result = chain.whole(external, chain.solve_path(poses, external, q).q)
    if np.abs(result[0] - q).max() > _NEAR:
        raise ReachError('the arm would have to change its posture on the way')
    return result


def _joint_move(chain: CarriedArm, course: _Course, move: Move, q: Array | None) -> _Reached:
    """Return the samples of a joint move; where it comes from may not be known."""
    assert move.end is not None
    arm, place = chain.robot, course.program.place(move.end)
    end = place if place.ndim == 1 else _posture(chain, place, course, move, q)
    arm.check_positions(end[None])
    if q is None:
        return _Reached(end[None], np.zeros(1), -1)
    count = int(np.clip(np.ceil(np.abs(end - q).max() / _TURN) + 1, 3, _SHORT))
    share = np.linspace(0.0, 1.0, count)[:, None]
    duration = float((np.abs(end - q) / arm.planned_velocity).max()) / max(move.speed, 1e-3)
    times = share[:, 0] * max(move.duration or duration, _LEAST_TIME)
    return _Reached(q + share * (end - q), times, -1)


def _posture(
    chain: CarriedArm, pose: Array, course: _Course, move: Move, q: Array | None
) -> Array:
    assert move.end is not None
    arm, external = chain.robot, course.program.external_at(move.end)
    result = chain.solve(pose, external, q)
    if move.suits is not None:
        result = _turned(chain, result)
        result = result[move.suits(result)]
        if not len(result):
            raise ReachError('no posture of this robot there is the one that the program names')
    elif q is not None:
        result = _turned(chain, result)
    elif len(result) > 1:
        result = _known(result, course, move)
    near = np.zeros(arm.n) if q is None else q
    return np.asarray(result[np.abs(result - near).sum(axis=1).argmin()])


def _known(result: Array, course: _Course, move: Move) -> Array:
    """Return the one posture that is known, where the program names none."""
    known = result if course.known is None else result[course.known(result)]
    if len(known) != 1:
        raise ReachError(
            f'{len(result)} postures reach this point and the program names none; '
            'let a move to joint positions come first, or say the joints with --start'
        )
    course.assumed.append(move.where)
    return known


def _turned(chain: CarriedArm, result: Array) -> Array:
    """Return every solution on every full turn that the limits allow for the arm's joints."""
    last, arm = [result], chain.robot
    for turn in (-2.0 * np.pi, 2.0 * np.pi):
        for joint in np.flatnonzero(~arm.prismatic & (np.arange(arm.n) >= chain.count)):
            moved = result.copy()
            moved[:, joint] += turn
            inside = (moved >= arm.lower) & (moved <= arm.upper)
            last.append(moved[inside.all(axis=1)])
    return np.concatenate(last)


def _tool_way(
    arm: Robot, program: MoveProgram, move: Move, begin: Array, count: int = 0, at: int = 0
) -> tuple[Array, int]:
    """
    Return the poses of a linear or circular move, shape (K, 4, 4), and the sample on its way.

    Samples, and which passes the place on the way, are chosen where 0. Raises PathError: three
    places of an arc lie on a line.
    """
    assert move.end is not None
    end = _pose(arm, program.place(move.end))
    if move.via is None:
        count = count or _count(float(np.linalg.norm(end[:3, 3] - begin[:3, 3])))
        share = np.linspace(0.0, 1.0, count)
        position = begin[:3, 3] + share[:, None] * (end[:3, 3] - begin[:3, 3])
        return transform(_turning(begin, end, share), position), -1
    middle = _pose(arm, program.place(move.via))[:3, 3]
    arc = Arc(begin[:3, 3], middle, end[:3, 3])
    count = count or _count(arc.length)
    part = arc.middle_share
    at = at or int(np.clip(round(part * (count - 1)), 1, count - 2))
    share = np.interp(np.arange(count), [0, at, count - 1], [0.0, part, 1.0])
    position = arc.sample(share * arc.length).position
    return transform(_turning(begin, end, share), position), at


def _pose(arm: Robot, place: Array) -> Array:
    return place if place.ndim == 2 else np.asarray(forward(arm, place))


def _count(length: float) -> int:
    return int(np.clip(np.ceil(length / _STEP) + 1, *_SAMPLES))


def _turning(begin: Array, end: Array, share: Array) -> Array:
    """Return rotations on the shortest way from one to the other, shape (K, 3, 3)."""
    turn = angle_between(end[:3, :3], begin[:3, :3])
    return rotation_matrix(share[:, None] * turn) @ begin[:3, :3]


def _joined(done: Sequence[tuple[Move, _Reached]]) -> Piece:
    """Put the samples of moves together; the arm eases out of every stop, and into the next."""
    t, q, which, ends, vias = [], [], [], [], []
    run: list[Array] = []
    stopped, count = 0.0, 0
    for k, (move, reached) in enumerate(done):
        first = 0 if k == 0 else 1
        vias.append(count + reached.via - first if reached.via >= 0 else -1)
        run.append(reached.t[first:] + (run[-1][-1] if run else 0.0))
        q.append(reached.q[first:])
        size = reached.t.size - first
        if move.stop or k == len(done) - 1:
            moving = stopped + _eased(np.concatenate(run))
            stay = moving[-1] + max(move.dwell, _REST) * np.array([0.25, 0.5, 1.0])
            t += [moving, stay]
            q.append(np.repeat(reached.q[-1:], stay.size, axis=0))
            run, stopped = [], float(stay[-1])
            size += stay.size
        which.append(np.full(size, k))
        count += size
        ends.append(count - 1)
    motion = JointMotion(np.concatenate(t), np.concatenate(q))
    moves = tuple(move for move, _ in done)
    return Piece(moves, motion, np.concatenate(which), np.array(ends), np.array(vias))


def _eased(t: Array) -> Array:
    """Return the times of samples from stop to stop that full speed would pass at times (K,)."""
    whole = t[-1]
    # Between stops that are close an arm speeds up for half of the way, and is never as fast.
    rising = 0.5 * min(_RISE, float(whole))
    return np.asarray(t + _late(t, rising) + _late(whole, rising) - _late(whole - t, rising))


def _late(t: Array, rising: float) -> Array:
    """
    Return how much later a place is reached from a stop than at full speed, which takes t [s].

    rising: what full speed takes for the part of the way on which the arm speeds up [s].
    """
    near = np.minimum(t, rising)
    return np.asarray(np.sqrt(2.0 * _RISE * near) - near)


def repeated(robot: Robot, program: MoveProgram, piece: Piece) -> JointMotion:
    """Return the motion of a piece between points that moved a little; ReachError where it cannot."""
    q = np.array(piece.motion.q)
    for k, move in enumerate(piece.moves):
        first = 0 if k == 0 else int(piece.ends[k - 1])
        last = int(piece.ends[k])
        way = _way_length(piece, k)
        assert move.end is not None
        arm = robot.with_frames(base=np.eye(4), tool=move.tool)
        chain = CarriedArm(arm, program.external)
        if move.kind == 'joint' or way == 1:
            part = _joint_part(chain, program, move, q, first, way)
        else:
            at = max(int(piece.vias[k]) - first, 0)
            poses, _ = _tool_way(arm, program, move, forward(arm, q[first]), way, at)
            part = _closed(chain, piece.motion.q[first : first + way], poses, move)
        q[first : first + way] = part
        q[first + way : last + 1] = part[-1]
    return JointMotion(piece.motion.t, q)


def refined(piece: Piece, parts: int) -> Piece:
    """Return a piece with every step between its samples cut into so many."""
    return piece._replace(
        motion=finer(piece.motion, parts),
        move=np.repeat(piece.move, parts)[parts - 1 :],
        ends=piece.ends * parts,
        vias=np.where(piece.vias < 0, -1, piece.vias * parts),
    )


def finer(motion: JointMotion, parts: int) -> JointMotion:
    """
    Return a motion with every step between its samples cut into so many.

    Joints go as smoothly as they may without turning around between two samples [1]_: straight pieces
    would have all of their acceleration at the samples.

    References
    ----------
    .. [1] F. N. Fritsch, J. Butland, "A method for constructing local monotone piecewise cubic
       interpolants", SIAM Journal on Scientific and Statistical Computing 5, 1984.

    """
    count = motion.t.size
    if count < 2:
        return motion
    t = np.interp(np.arange((count - 1) * parts + 1) / parts, np.arange(count), motion.t)
    return JointMotion(t, PchipInterpolator(motion.t, motion.q)(t))


def unrelenting(piece: Piece, motion: JointMotion) -> JointMotion:
    """Return a motion of a piece at full speed from the first to the last place of every move."""
    steps = np.diff(motion.t)
    for k in range(len(piece.moves)):
        first = 0 if k == 0 else int(piece.ends[k - 1])
        way = slice(first, first + _way_length(piece, k) - 1)
        if steps[way].size:
            steps[way] = steps[way].min()
    return JointMotion(motion.t[0] + np.concatenate([[0.0], np.cumsum(steps)]), motion.q)


def _way_length(piece: Piece, k: int) -> int:
    """Return the number of samples of a move from where it begins to where it arrives."""
    first = 0 if k == 0 else int(piece.ends[k - 1])
    q = piece.motion.q[first : int(piece.ends[k]) + 1]
    stays = piece.moves[k].stop or k == len(piece.moves) - 1
    return len(q) - 3 if stays else len(q)


def _joint_part(
    chain: CarriedArm, program: MoveProgram, move: Move, q: Array, first: int, way: int
) -> Array:
    assert move.end is not None
    place = program.place(move.end)
    end = place
    if place.ndim == 2:
        end = _closed(chain, q[first + way - 1][None], place[None], move)[0]
    if way == 1:
        return np.asarray(end[None])
    share = np.linspace(0.0, 1.0, way)[:, None]
    return np.asarray(q[first] + share * (end - q[first]))


def _closed(chain: CarriedArm, q: Array, poses: Array, move: Move) -> Array:
    result, error = chain.polish(q, poses)
    if np.abs(error).max() > _CLOSED:
        raise ReachError(f'{move.where}: out of reach, or at a singularity')
    return result
