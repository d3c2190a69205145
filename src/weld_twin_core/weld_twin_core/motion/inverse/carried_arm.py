# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""An arm that is carried, or whose workpiece is moved, by joints that are given beforehand."""

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
