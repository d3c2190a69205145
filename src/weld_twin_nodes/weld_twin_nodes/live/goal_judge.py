# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Goals worked out beside a node, so that it serves poses and the rest meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from weld_twin_core.errors import DataError, TwinError
from weld_twin_core.twin.goal_correction import (
    CorrectedGoal,
    GoalLimits,
    Refusal,
    Start,
    corrected_goal,
)
from weld_twin_core.twin.program_model import ProgramModel
from weld_twin_msgs_py.messages.goals import GoalPoints, beyond_tolerance, read_goal

from .cell_node import CellNode
from .work_beside import WorkBeside

POLL = 0.002
"""Seconds between two looks at whether a goal is worked out."""
LATE = 0.5
"""A goal that should have begun so long ago [s] begins in the middle, and its correction with a step."""
Judged = tuple[CorrectedGoal | Refusal, tuple[int, ...]]
"""What becomes of a goal, and where the robot's joints stand in it."""


class GoalJudge:
    """Works out goals, one after the other."""

    def __init__(self, node: CellNode) -> None:
        self._node = node
        self._goals = WorkBeside()

    def judge(
        self,
        goal: Any,
        names: tuple[str, ...],
        model: ProgramModel,
        limits: GoalLimits,
        start: Start,
        reported: Callable[[Judged], None],
    ) -> None:
        """
        Work a goal out; then tell.

        names: what it calls the joints of the robot.
        """
        try:
            points = self._read(goal, names)
        except TwinError as error:
            reported((Refusal(str(error)), ()))
            return
        doing = self._goals.submit(corrected_goal, model, points.goal, limits, start)

        def look() -> None:
            if not doing.done() or timer.is_canceled():
                return
            timer.cancel()
            self._node.destroy_timer(timer)
            try:
                reported((_tolerated(goal, points, doing.result()), points.columns))
            except TwinError as error:
                reported((Refusal(str(error)), ()))

        timer = self._node.every(POLL, look)

    def _read(self, goal: Any, names: tuple[str, ...]) -> GoalPoints:
        """Return the points of a goal; refuse one that should have begun already."""
        stamp = goal.trajectory.header.stamp
        given = read_goal(goal.trajectory, names)
        at = stamp.sec * 1_000_000_000 + stamp.nanosec
        late = (self._node.get_clock().now().nanoseconds - at) * 1e-9 - float(given.goal.t[0])
        if at and late > LATE:
            raise DataError(f'the goal should have begun {late:.2f} s ago, by its stamp')
        return given


def _tolerated(
    goal: Any, points: GoalPoints, result: CorrectedGoal | Refusal
) -> CorrectedGoal | Refusal:
    """Return a corrected goal, or that it goes beyond what the goal itself tolerates."""
    if isinstance(result, Refusal):
        return result
    beyond = beyond_tolerance(
        [*goal.path_tolerance, *goal.goal_tolerance],
        goal.trajectory.joint_names,
        points.columns,
        result.goal.q - points.goal.q,
    )
    return Refusal(beyond, result.largest) if beyond else result
