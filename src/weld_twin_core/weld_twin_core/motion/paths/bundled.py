# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A seam of each kind placed where a given robot works comfortably."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...arm.chain import rising, up
from ...arm.robot import Robot
from ...arm.rotation import rotation_matrix, transform
from ...arrays import Array
from ...errors import PathError, ReachError
from ..inverse import CarriedArm, rest, solve_path
from ..inverse.along_path import reach
from .seams import Arc, Circle, Line, Path, Polyline, Spline, Torch, Weave

_COMFORT_LIMIT = 0.15
"""Distance to a joint limit [rad] from which a place is as good as any."""
_COMFORT_CONDITION = 40.0
"""Condition number of the Jacobian up to which a place is as good as any."""


_STANDING = (0.15, 0.3, 0.05, 0.45, -0.1)
"""Heights of seams over the foot of an arm that stands, in lengths of the arm [1]."""
_HANGING = (0.65, 0.55, 0.75, 0.45, 0.85)
"""The same below the foot of an arm that hangs from a ceiling [1]."""
_HEADINGS = (0.0, 0.5 * np.pi, -0.5 * np.pi, np.pi)
"""Turns about the first axis [rad]: an arm's zero may look to any side of its base."""


class _Place(NamedTuple):
    """Where a seam lies: centre, direction, out of the work (world frame), and its size [m]."""

    centre: Array
    along: Array
    normal: Array
    size: float

    def points(self, *plane: tuple[float, float]) -> Array:
        """Return points given along and across the seam in units of its size, shape (M, 3)."""
        across = np.cross(self.normal, self.along)
        local = self.size * np.array(plane)
        return self.centre + local[:, :1] * self.along + local[:, 1:] * across


def _line(at: _Place) -> Path:
    start, end = at.points((-0.5, 0.0), (0.5, 0.0))
    return Line(start, end, at.normal)


def _arc(at: _Place) -> Path:
    start, middle, end = at.points((-0.45, -0.15), (0.0, 0.15), (0.45, -0.15))
    return Arc(start, middle, end, at.normal)


_SHAPES: dict[str, Callable[[_Place], Path]] = {
    'line': _line,
    'arc': _arc,
    'circle': lambda at: Circle(at.centre, 0.2 * at.size, at.normal, at.along),
    'polyline': lambda at: Polyline(
        at.points((-0.4, -0.2), (-0.4, 0.2), (0.0, 0.0), (0.4, 0.2), (0.4, -0.2)),
        0.03 * at.size,
        at.normal,
    ),
    'spline': lambda at: Spline(
        at.points((-0.5, 0.0), (-0.25, 0.15), (0.0, 0.0), (0.25, -0.15), (0.5, 0.0)), at.normal
    ),
    'weave': lambda at: Weave(_line(at), 0.01 * at.size, 0.05 * at.size),
}
KINDS = tuple(_SHAPES)


def default_seam(robot: Robot, kind: str = 'line', torch: Torch | None = None) -> Path:
    """
    Return a seam of a kind that the robot reaches with the torch upright on it.

    Parameters
    ----------
    robot : Robot
    kind : str
        One of `KINDS`.
    torch : Torch, optional
        Angles the seam must be reachable with; left out, all zero.

    Raises
    ------
    PathError
        There is no such kind.
    ReachError
        None of the places tried is within reach.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> seam = wt.default_seam(wt.load('ur5'), 'circle')
    >>> print(f'{seam.length:.3f} m')
    0.375 m

    """
    if kind not in _SHAPES:
        raise PathError(f'no bundled seam is of kind {kind!r}; there are ' + ', '.join(KINDS))
    if robot.behind:  # on the workpiece, where a positioner that stands at rest has it
        beside = CarriedArm(robot, robot.behind)
        robot = beside.arm.with_frames(base=beside.feet(rest(robot)))
    best: tuple[float, Path | None] = (-np.inf, None)
    for places in _places(robot):
        for place in places:
            path = _SHAPES[kind](place)
            comfort = _comfort(robot, path, torch or Torch())
            if comfort > 1.0:
                return path
            if comfort > best[0]:
                best = comfort, path
        if best[1] is not None:
            return best[1]
    raise ReachError(
        f'{robot.name} reaches none of the places tried for a seam of kind {kind!r}; '
        'describe a seam in its workspace'
    )


def _comfort(robot: Robot, path: Path, torch: Torch) -> float:
    """Return a number above 1 where limits and singularities are far, -inf out of reach."""
    frames = path.sample(np.linspace(0.0, path.length, 33))
    try:
        solution = solve_path(robot, torch.poses(frames))
    except ReachError:
        return -np.inf
    room = float(solution.limit_margin.min()) / _COMFORT_LIMIT
    return min(room, _COMFORT_CONDITION / float(solution.condition.max()))


def _places(robot: Robot) -> Iterator[list[_Place]]:
    """Yield places from the likeliest on, scaled with the robot; later lists are rarely needed."""
    over = [0.0 if rising(robot) > 0.0 else np.pi, 0.0, 0.0]
    foot = robot.T_world_base @ transform(rotation_matrix(over), np.zeros(3))
    above = robot.T_world_base[:3, :3] @ up(robot)
    # Hanging from a ceiling, the wire points away from the base and the work lies far from it.
    hangs = foot[:3, 2] @ above < -0.5
    for heights in (_HANGING, _STANDING) if hangs else (_STANDING, _HANGING):
        for heading in _HEADINGS:
            turned = foot @ transform(rotation_matrix([0.0, 0.0, heading]), np.zeros(3))
            yield [*_places_at(turned, turned[:3, :3].T @ above, heights, reach(robot))]


def _places_at(
    base: Array, above: Array, heights: Sequence[float], size: float
) -> Iterator[_Place]:
    """Yield places in front of a base, on heights in sizes of the robot."""
    for height in heights:
        for distance in (0.5, 0.4, 0.6, 0.3):
            for along in ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0)):
                flat = np.asarray(along) - (above @ along) * above
                if np.linalg.norm(flat) < 0.5:
                    continue
                centre = base[:3, :3] @ [distance * size, 0.0, height * size] + base[:3, 3]
                direction = base[:3, :3] @ (flat / np.linalg.norm(flat))
                yield _Place(centre, direction, base[:3, :3] @ above, 0.25 * size)
