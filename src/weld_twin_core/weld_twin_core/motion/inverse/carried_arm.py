# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""An arm that is carried, or whose workpiece is moved, by joints that are told beforehand."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...arm.chain import forward
from ...arm.robot import Robot
from ...arrays import Array
from ...errors import DataError
from .all_branches import solve
from .along_path import PathSolution, solve_path
from .newton import polish


def rest(robot: Robot) -> Array:
    """Return where a positioner stands of which nothing is told: at zero, or nearest, (behind,)."""
    return np.clip(
        np.zeros(robot.behind), *(v[: robot.behind] for v in (robot.lower, robot.upper))
    )


@dataclass(frozen=True, eq=False)
class CarriedArm:
    """
    A robot whose first joints are told, as a controller is told its external axes: (..., count).

    Inverse kinematics is that of the arm behind them, with its base where they put it. Raises
    DataError: a joint of the positioner is not told, or no joint is left.
    """

    robot: Robot
    count: int
    """Joints that are told: those of a positioner, and the first ones of the robot itself."""

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

    def _slid(self, reported: Array) -> Array:
        """Return the arm's base where the robot's own rows begin, shape (..., 4, 4)."""
        if self._track is None:
            return np.eye(4)
        return forward(self._track, reported[..., self.robot.behind :])

    def feet(self, reported: Array) -> Array:
        """Return the base of the arm in the frame that the chain begins in, (..., 4, 4) [m]."""
        if not self.count:
            return np.broadcast_to(np.eye(4), (*reported.shape[:-1], 4, 4))
        return np.asarray(self.roots(reported) @ self._slid(reported))

    def roots(self, reported: Array) -> Array:
        """Return where the robot's own rows begin in that frame, shape (..., 4, 4) [m]."""
        robot = self.robot
        if not robot.behind:
            return np.broadcast_to(robot.T_world_base, (*reported.shape[:-1], 4, 4))
        table = forward(robot.branches[0], reported[..., : robot.behind][..., ::-1])
        return np.asarray(np.linalg.inv(table) @ robot.T_root_base)

    def seen(self, poses: Array, reported: Array) -> Array:
        """Return poses (..., 4, 4) as the arm's base sees them."""
        return np.asarray(np.linalg.inv(self.feet(reported)) @ poses) if self.count else poses

    def whole(self, reported: Array, q: Array) -> Array:
        """Return positions (..., n) of all joints, of those told (..., count) and of the arm."""
        if not self.count:
            return q
        reported = np.broadcast_to(reported, (*q.shape[:-1], self.count))
        return np.concatenate([reported, q], axis=-1)

    def solve(self, pose: Array, reported: Array, seed: Array | None = None) -> Array:
        """Return every posture that reaches a pose (4, 4), shape (K, n), as `solve` does."""
        seed = None if seed is None else seed[self.count :]
        return self.whole(reported, solve(self.arm, self.seen(pose, reported), seed))

    def solve_path(self, poses: Array, reported: Array, seed: Array | None = None) -> PathSolution:
        """Return the arm's own joints along a path of poses (N, 4, 4), as `solve_path` does."""
        seed = None if seed is None else seed[self.count :]
        return solve_path(self.arm, self.seen(poses, reported), seed)

    def polish(self, q: Array, poses: Array) -> tuple[Array, Array]:
        """Return positions (N, n) closed onto poses by the arm, and the error left as `polish`."""
        reported = q[..., : self.count]
        result, error = polish(self.arm, q[..., self.count :], self.seen(poses, reported))
        return self.whole(reported, result), error
