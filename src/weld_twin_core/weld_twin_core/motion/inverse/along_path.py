# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joint positions along a whole path on one branch: no jumps, within the limits."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...arm.bulk import kernel_of
from ...arm.chain import Frames, chain_jacobian, forward, frames, rising
from ...arm.robot import Robot
from ...arm.rotation import missing, moved, wrapped
from ...arrays import Array, spread_over
from ...errors import DataError, ReachError
from .closed_form import OTHER_POSTURE, branches, family, gap, past_limit, solve, where, why_not
from .following import LEAP, follow
from .newton import CLOSED, TURN, centring, null_space, polish, search, turns_to_middle

_Mask = NDArray[np.bool_]

_KNOTS = 64
"""Samples a numerical solution is followed over; between them a spline is the start."""
_TRACKED = 6
"""Postures at the first sample that are followed along the path."""
ILL_CONDITIONED = 200.0
"""Condition number of the Jacobian from which a place is near a singularity."""
_SINGULAR = 1e-8
"""Determinant of the Jacobian below which a closed form loses digits."""
_NUDGE = 1e-3
"""Share of the way to a neighbour by which a singular pose is moved to see its postures."""
_COMFORTABLE = 0.5
"""Distance from a joint limit [rad] beyond which more of it is worth nothing."""
_SAME = 9
"""Decimals in which the room of mirrored postures agrees; rounding shows in the fifteenth."""


@dataclass(frozen=True, eq=False)
class PathSolution:
    """
    Joint positions along a path; how well the arm stands there is worked out when asked for.

    References
    ----------
    .. [1] T. Yoshikawa, "Manipulability of robotic mechanisms", IJRR 4(2), 1985.


    """

    robot: Robot
    poses: Array
    """What was asked for, shape (N, 4, 4)."""
    q: Array
    """Shape (N, n) [rad or m]."""
    method: str
    """'followed' from a seed, the family of the closed form, or 'search'."""

    @cached_property
    def residual(self) -> Array:
        """Return what is missing to each pose, shape (N, 2) [m, rad]."""
        return np.stack(_distances(forward(self.robot, self.q), self.poses), axis=1)

    @property
    def condition(self) -> Array:
        """Return the Jacobian's condition number, lengths over the arm's reach, shape (N,)."""
        return self._posture[0]

    @property
    def manipulability(self) -> Array:
        """Return Yoshikawa's measure, sqrt(det(J J^T)), of the same Jacobian, shape (N,) [1]_."""
        return self._posture[1]

    @property
    def limit_margin(self) -> Array:
        """Return the distance to the nearest joint limit, shape (N,) [rad or m]."""
        return self._posture[2]

    @cached_property
    def _posture(self) -> tuple[Array, Array, Array]:
        return _posture(self.robot, self.q, frames(self.robot, self.q))


def solve_path(robot: Robot, poses: Array, seed: Array | None = None) -> PathSolution:
    """
    Return joint positions on one branch along a path.

    Of the branches that reach every sample within the limits and without a jump, the one with
    most room to limits and singularities is taken, or the one that starts nearest the seed.

    Parameters
    ----------
    poses : array, shape (N, 4, 4)
        ``T_world_tool``, close enough together that neighbours are one small motion apart.
    seed : array, shape (n,), optional
        Joint positions to start near.

    Raises
    ------
    ReachError
        Names the first sample out of reach, where it is and why.
    ModelError
        The robot has a positioner.

    Examples
    --------
    >>> import numpy as np
    >>> import weld_twin_core as wt
    >>> robot = wt.load('ur5')
    >>> seam = wt.default_seam(robot)
    >>> poses = wt.paths.Torch().poses(seam.sample(np.linspace(0.0, seam.length, 20)))
    >>> path = wt.solve_path(robot, poses)
    >>> path.q.shape, bool(np.abs(np.diff(path.q, axis=0)).max() < 0.1)
    ((20, 6), True)

    """
    robot.refuse_positioner('a path of the tool')
    poses = np.asarray(poses, dtype=np.float64)
    if seed is not None:
        q = follow(robot, poses, np.asarray(seed, dtype=np.float64))
        if q is not None:
            return PathSolution(robot, poses, q, 'followed')
    kind = family(robot)
    of_all = _followed if kind is None else _closed
    tracks = of_all(robot, poses, seed)
    fails: _Mask = np.any(
        np.isnan(tracks) | (tracks < robot.lower) | (tracks > robot.upper), axis=-1
    )
    fails[:, 1:] |= jumps(robot, tracks, poses)
    failures = np.where(fails.any(axis=1), fails.argmax(axis=1), len(poses))
    good = np.flatnonzero(failures == len(poses))
    if not good.size:
        raise ReachError(_explain(robot, tracks, failures, poses))
    best = good[_best_first(robot, tracks[good], seed)[0]]
    q = polish(robot, tracks[best], poses)[0]
    return PathSolution(robot, poses, q, kind or 'search')


def _closed(robot: Robot, poses: Array, seed: Array | None) -> Array:
    """Return every closed-form branch, shape (8, N, n), unwrapped and on its best turn."""
    q = _joined(_determined(robot, branches(robot, poses), poses))
    sound = np.asarray(np.isfinite(q).all(axis=-1))
    whole = np.asarray(sound.all(axis=-1))
    if whole.any():
        q[whole] = _on_turn(robot, np.unwrap(q[whole], axis=1), seed)
    for track, there in zip(q, sound, strict=True):
        if there.any() and not there.all():
            track[there] = _on_turn(robot, np.unwrap(track[there], axis=0), seed)
    return q


def _determined(robot: Robot, q: Array, poses: Array) -> Array:
    """
    Return branches (K, N, n) with samples on a singularity replaced by what they tend to.

    There the pose leaves joints undetermined; a little way towards the next sample it does not.
    The straight way there bends off the path, so the joints are right to a part of a step.
    """
    kernel = kernel_of(robot, tuple(('theta', i) for i in range(robot.n)))
    screws = kernel.screws(np.nan_to_num(q).reshape(-1, robot.n))[1]
    size = np.abs(np.linalg.det(screws.T)).reshape(q.shape[:2])
    singular = np.flatnonzero((size < _SINGULAR).any(axis=0))
    if singular.size and len(poses) > 1:
        other = np.where(singular + 1 < len(poses), singular + 1, singular - 1)
        q = q.copy()
        start = poses[singular]
        beside = moved(start, _NUDGE * missing(poses[other], start))
        q[:, singular] = branches(robot, beside)
    return q


def _on_turn(robot: Robot, q: Array, seed: Array | None) -> Array:
    """Return tracks (..., N, n) on the whole turns nearest the seed, or the middle of the limits."""
    middle = q + TURN * turns_to_middle(robot, q.min(axis=-2), q.max(axis=-2))[..., None, :]
    if seed is None:
        return middle
    shift = np.round((np.asarray(seed) - q[..., :1, :]) / TURN)
    near = q + TURN * np.where(robot.prismatic, 0.0, shift)
    within = (near >= robot.lower) & (near <= robot.upper)
    inside = np.asarray(within.all(axis=(-2, -1)))
    return np.where(inside[..., None, None], near, middle)


def _followed(robot: Robot, poses: Array, seed: Array | None) -> Array:
    """Return tracks, shape (K, N, n), followed from every posture found at the first sample."""
    starts, lacking = search(robot, poses[0], seed)
    if not len(starts):
        raise ReachError(
            f'{robot.name} cannot reach sample 0 at {where(poses[0])}: the nearest the tool gets '
            f'is {gap(lacking)}; move the seam or turn the torch'
        )
    best = _best_first(robot, starts[:, None], seed)
    starts = starts[best[:_TRACKED]]
    index = spread_over(len(poses), _KNOTS)
    knots = _track(robot, starts, poses[index])
    if len(index) == len(poses):
        return knots
    along = _travel(robot, poses)
    # Slow to load, and who corrects poses needs no path.
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(along[index], np.where(np.isfinite(knots), knots, 0.0), axis=1)
    tracks = spline(along)
    lost: _Mask = np.any(np.isnan(knots), axis=-1)
    for k, track in enumerate(tracks):
        tracks[k] = _on_turn(robot, polish(robot, track, poses)[0], seed)
        if lost[k].any():
            tracks[k, index[max(int(np.argmax(lost[k])) - 1, 0)] + 1 :] = np.nan
    return np.asarray(tracks)


def _track(robot: Robot, q: Array, poses: Array) -> Array:
    """Follow postures q (K, n) over knots; NaN from where one is lost. Shape (K, M, n)."""
    out = []
    for pose in poses:
        target = np.broadcast_to(pose, (len(q), 4, 4))
        if robot.n > 6:
            jacobian = chain_jacobian(robot, frames(robot, q))
            q = q + 0.05 * null_space(jacobian, centring(robot, q))
        q, error = polish(robot, q, target)
        lost = ~(np.abs(error).max(axis=-1) < CLOSED)
        out.append(np.where(lost[:, None], np.nan, q))
    return np.stack(out, axis=1)


def _best_first(robot: Robot, q: Array, seed: Array | None) -> NDArray[np.intp]:
    """
    Return the order of tracks (K, N, n), the best first.

    Mirrored postures have the same room. Of these the one that turns the joints least comes first:
    rounding, which differs from machine to machine, must not decide.
    """
    if seed is not None:
        return np.argsort(np.linalg.norm(q[:, 0] - seed, axis=-1), kind='stable')
    some = q[:, :: max(1, q.shape[1] // 100)]
    chain = frames(robot, some)
    condition, _, margin = _posture(robot, some, chain)
    room = np.minimum(margin.min(axis=-1) / _COMFORTABLE, 1.0)
    suits = np.where(_above_base(robot, chain), 1.0, 0.1)
    better = np.round(room / condition.max(axis=-1) * suits, _SAME)
    return np.lexsort((np.linalg.norm(q[:, 0], axis=-1), -better))


def _above_base(robot: Robot, chain: Frames) -> _Mask:
    """Tell, shape (K,), whether joints stay on the arm's side of the surface the base stands on."""
    up, foot = rising(robot) * chain.base_rotation[:, 2], chain.base_point
    samples = chain.position.shape[:-1]
    heights = [np.moveaxis(row.z_point, 0, -1) @ up - foot @ up for row in chain.rows]
    lowest = [np.broadcast_to(height, samples).min(axis=-1) for height in heights]
    return np.asarray(np.min(lowest, axis=0) > -1e-6)


def _posture(robot: Robot, q: Array, chain: Frames) -> tuple[Array, Array, Array]:
    """Return condition number, manipulability and distance to the nearest limit, (...) each."""
    jacobian = chain_jacobian(robot, chain).copy()
    jacobian[..., :3, :] /= reach(robot)
    values = np.linalg.svd(jacobian, compute_uv=False)
    condition = values[..., 0] / np.maximum(values[..., -1], 1e-300)
    margin = np.minimum(q - robot.lower, robot.upper - q).min(axis=-1)
    return condition, values.prod(axis=-1), margin


def _explain(robot: Robot, tracks: Array, failures: NDArray[np.intp], poses: Array) -> str:
    """Return the sentence about the branch that gets farthest."""
    best = int(np.argmax(failures))
    k = int(failures[best])
    text = f'{robot.name} cannot reach sample {k} at {where(poses[k])}: '
    q = tracks[best, k]
    if not np.isfinite(q).all():
        return text + why_not(robot, poses[k])
    outside = np.maximum(robot.lower - q, q - robot.upper)
    joint = int(np.argmax(outside))
    if outside[joint] > 0.0:
        return text + past_limit(robot, joint, q[joint])
    return text + OTHER_POSTURE


_STEEP = 20.0
"""Joint motion per motion of the tool (both in rad, lengths over reach) beyond which it flips."""

_SUMS = np.array([[[0.0, 1.0]] * 3 + [[1.0, 0.0]]] * 3 + [[[0.0, 0.0]] * 4]).reshape(16, 2)
"""Adds up the squares of a pose's position and of its rotation."""


def reach(robot: Robot) -> float:
    """Return the length of the stretched-out chain [m], an upper bound of the arm's reach."""
    return float(np.hypot(robot.a, robot.d).sum() + np.linalg.norm(robot.T_flange_tool[:3, 3]))


def _travel(robot: Robot, poses: Array) -> Array:
    """Return a strictly increasing measure of the way along the poses, shape (N,) [rad]."""
    moved, turned = _distances(poses[1:], poses[:-1])
    return np.concatenate([[0.0], np.cumsum(moved / reach(robot) + turned + 1e-9)])


def _distances(first: Array, second: Array) -> tuple[Array, Array]:
    """Return how far poses (..., 4, 4) are apart, shape (...) each [m, rad]."""
    gap = first - second
    gap = gap.reshape(*gap.shape[:-2], 16)
    gap *= gap
    moved, turned = np.moveaxis(np.sqrt(gap @ _SUMS), -1, 0)
    # The chord between rotations, as long as 2 sqrt(2) sin(angle / 2).
    return moved, 2.0 * np.arcsin(np.minimum(turned / np.sqrt(8.0), 1.0))


def _joined(tracks: Array) -> Array:
    """Return branches (K, N, n) that change places where an arm passes a singularity onto another."""
    tracks = tracks.copy()
    steps = np.abs(wrapped(np.diff(tracks, axis=1))).max(axis=-1)
    for i in np.flatnonzero((steps > LEAP).any(axis=0)) + 1:
        apart = np.abs(wrapped(tracks[:, i] - tracks[:, i - 1, None])).max(axis=-1)
        apart = np.where(np.isnan(apart), np.inf, apart)
        order = np.where(np.isinf(apart).all(axis=1), np.arange(len(tracks)), apart.argmin(axis=1))
        if len(set(order)) == len(order):
            tracks[:, i:] = tracks[order, i:]
    return tracks


def jumps(robot: Robot, q: Array, poses: Array) -> _Mask:
    """
    Tell, (..., N - 1), where joints (..., N, n) leave the path of poses (N, 4, 4) between samples.

    Half way between two joint positions of one motion the tool is near both; half way between two
    branches it is somewhere else, or the joints move much farther than the tool.
    """
    if len(poses) < 2:
        return np.zeros((*q.shape[:-2], 0), dtype=bool)
    halfway = forward(robot, np.nan_to_num(0.5 * (q[..., 1:, :] + q[..., :-1, :])))
    tool = np.diff(_travel(robot, poses))
    size, away = reach(robot), -3.0 * tool
    for ends in (poses[:-1], poses[1:]):
        moved, turned = _distances(halfway, ends)
        away = away + np.hypot(moved / size, turned)
    joints = np.abs(np.diff(q, axis=-2)).max(axis=-1)
    return np.asarray((away > 1e-3) | ((joints > LEAP) & (joints > _STEEP * tool)))


def rest(robot: Robot) -> Array:
    """Return where a positioner stands that nobody has placed: at zero, or nearest, (behind,)."""
    return np.clip(
        np.zeros(robot.behind), *(v[: robot.behind] for v in (robot.lower, robot.upper))
    )


@dataclass(frozen=True, eq=False)
class CarriedArm:
    """
    A robot whose first joints are given, as a controller is given its external axes: (..., count).

    Inverse kinematics is that of the arm behind them, with its base where they put it. Raises
    DataError: a joint of the positioner is not given, or no joint is left.
    """

    robot: Robot
    count: int
    """Joints that are given: those of a positioner, and the first ones of the robot itself."""

    def __post_init__(self) -> None:
        if not self.robot.behind <= self.count < self.robot.n:
            raise DataError(
                f'robot {self.robot.name!r} needs positions of the {self.robot.behind} joints of '
                f'its positioner, and one joint left; {self.count} joints are told'
            )

    @cached_property
    def arm(self) -> Robot:
        """Return the arm alone; its base is where its rows begin."""
        if not self.count:
            return self.robot
        turn = np.eye(3) if self._track is None else self._slid(np.zeros(self.count))[:3, :3]
        return self.robot.part(
            range(self.count, self.robot.n),
            T_world_base=np.eye(4),
            gravity=turn.T @ self.robot.gravity,
            controller=None,
        )

    @cached_property
    def _track(self) -> Robot | None:
        first = self.robot.behind
        if self.count == first:
            return None
        still = {'T_world_base': np.eye(4), 'T_flange_tool': np.eye(4), 'controller': None}
        return self.robot.part(range(first, self.count), **still)

    def _slid(self, external: Array) -> Array:
        """Return the arm's base where the robot's own rows begin, shape (..., 4, 4)."""
        if self._track is None:
            return np.eye(4)
        return forward(self._track, external[..., self.robot.behind :])

    def feet(self, external: Array) -> Array:
        """Return the base of the arm in the frame that the chain begins in, (..., 4, 4) [m]."""
        if not self.count:
            return np.broadcast_to(np.eye(4), (*external.shape[:-1], 4, 4))
        return np.asarray(self.roots(external) @ self._slid(external))

    def roots(self, external: Array) -> Array:
        """Return where the robot's own rows begin in that frame, shape (..., 4, 4) [m]."""
        robot = self.robot
        if not robot.behind:
            return np.broadcast_to(robot.T_world_base, (*external.shape[:-1], 4, 4))
        table = forward(robot.branches[0], external[..., : robot.behind][..., ::-1])
        return np.asarray(np.linalg.inv(table) @ robot.T_root_base)

    def seen(self, poses: Array, external: Array) -> Array:
        """Return poses (..., 4, 4) as the arm's base sees them."""
        return np.asarray(np.linalg.inv(self.feet(external)) @ poses) if self.count else poses

    def whole(self, external: Array, q: Array) -> Array:
        """Return positions (..., n) of all joints, of those given (..., count) and of the arm."""
        if not self.count:
            return q
        external = np.broadcast_to(external, (*q.shape[:-1], self.count))
        return np.concatenate([external, q], axis=-1)

    def solve(self, pose: Array, external: Array, seed: Array | None = None) -> Array:
        """Return every posture that reaches a pose (4, 4), shape (K, n), as `solve` does."""
        seed = None if seed is None else seed[self.count :]
        return self.whole(external, solve(self.arm, self.seen(pose, external), seed))

    def solve_path(self, poses: Array, external: Array, seed: Array | None = None) -> PathSolution:
        """Return the arm's own joints along a path of poses (N, 4, 4), as `solve_path` does."""
        seed = None if seed is None else seed[self.count :]
        return solve_path(self.arm, self.seen(poses, external), seed)

    def polish(self, q: Array, poses: Array) -> tuple[Array, Array]:
        """Return positions (N, n) closed onto poses by the arm, and the error left as `polish`."""
        external = q[..., : self.count]
        result, error = polish(self.arm, q[..., self.count :], self.seen(poses, external))
        return self.whole(external, result), error
