# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joint trajectories of action goals to points of a robot, and corrected points back into them."""

from collections.abc import Sequence
from copy import deepcopy
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.twin.goal_motion import Goal

from .from_messages import NANOSECONDS

RATES = ('velocities', 'accelerations')


class GoalPoints(NamedTuple):
    """The robot's part of a joint trajectory."""

    goal: Goal
    columns: tuple[int, ...]  # where the joints of the robot stand in every point


def read_goal(trajectory: Any, joint_names: Sequence[str]) -> GoalPoints:
    """Return the points of a JointTrajectory in the robot's order, one prefix taken off."""
    names = list(trajectory.joint_names)
    columns = _columns(names, joint_names)
    points, count = trajectory.points, len(names)
    if any(len(point.positions) != count for point in points):
        raise DataError(f'every point of the goal must have {count} positions')
    values: dict[str, Array | None] = {}
    for kind in RATES:
        sizes = {len(getattr(point, kind)) for point in points}
        if not sizes <= {0, count} or len(sizes) > 1:
            raise DataError(f'either every point of the goal has {count} {kind}, or none has any')
        values[kind] = _values(points, kind, columns) if sizes == {count} else None
    since = [point.time_from_start for point in points]
    t = np.array([s.sec + s.nanosec / NANOSECONDS for s in since], dtype=np.float64)
    goal = Goal(t, _values(points, 'positions', columns), *(values[kind] for kind in RATES))
    return GoalPoints(goal.checked(len(columns)), columns)


def _columns(names: list[str], wanted: Sequence[str]) -> tuple[int, ...]:
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise DataError(f'the goal names joint {twice!r} twice')
    prefixes = [name.removesuffix(wanted[0]) for name in names if name.endswith(wanted[0])]
    fitting = [p for p in ('', *prefixes) if all(p + name in names for name in wanted)]
    if len(fitting) > 1 and fitting[0]:
        raise DataError(
            f'the goal holds the joints of several robots, with the prefixes {", ".join(fitting)}; say '
            'which with joint_prefix'
        )
    if fitting:
        return tuple(names.index(fitting[0] + name) for name in wanted)
    missing = next(name for name in wanted if name not in names)
    raise DataError(
        f'the goal has no joint {missing!r}; it has {", ".join(names) or "none"}. All joints of the '
        'arm are needed: what is off in one is corrected by all'
    )


def _values(points: Sequence[Any], kind: str, columns: tuple[int, ...]) -> Array:
    rows = [getattr(point, kind) for point in points]
    return np.array(rows, dtype=np.float64).reshape(len(rows), -1)[:, list(columns)]


def corrected_trajectory(trajectory: Any, columns: Sequence[int], goal: Goal, waits: float) -> Any:
    """Return a copy of a JointTrajectory with its columns of the robot corrected, later by [s]."""
    out = deepcopy(trajectory)
    late = round(waits * NANOSECONDS)
    for k, point in enumerate(out.points):
        for kind, values in zip(('positions', *RATES), goal[1:], strict=True):
            if values is not None:
                row = list(getattr(point, kind))
                for column, value in zip(columns, values[k], strict=True):
                    row[column] = float(value)
                setattr(point, kind, row)
        since = point.time_from_start
        since.sec, since.nanosec = divmod(
            since.sec * NANOSECONDS + since.nanosec + late, NANOSECONDS
        )
    return out


def beyond_tolerance(
    tolerances: Sequence[Any], names: Sequence[str], columns: Sequence[int], moved: Array
) -> str:
    """
    Return which joint a correction (N, n) takes beyond what a goal tolerates; empty for none.

    Positions that are not positive tolerate what the controller does.
    """
    most = dict(zip((names[c] for c in columns), np.abs(moved).max(axis=0), strict=True))
    for one in tolerances:
        if 0.0 < one.position < most.get(one.name, 0.0):
            return (
                f'the correction takes {one.name} {most[one.name]:.3g} from where the goal has it, '
                f'which tolerates {one.position:.3g}'
            )
    return ''
