# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Goals worked out beside a node, so that it serves poses meanwhile, and what became of each."""

import json
from collections.abc import Callable
from concurrent.futures import Future, wait
from datetime import datetime, timezone
from pathlib import Path
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
from weld_twin_msgs_py.messages.from_messages import time_ns
from weld_twin_msgs_py.messages.goals import GoalPoints, beyond_tolerance, read_goal
from weld_twin_msgs_py.messages.topics import AUDIT
from weld_twin_msgs_py.programs.languages import MARK

from .cell_node import CellNode
from .work_beside import WorkBeside

WRITTEN = 1.0
"""Seconds an ending node gives its disk to take the audit."""


class GoalAudit:
    """Tells of goals for a node, whose parameters ``apply`` and ``audit`` it reads."""

    def __init__(self, node: CellNode) -> None:
        self._node = node
        self._out = node.offer(AUDIT, awaited=False)
        self._books = WorkBeside()
        self._written: Future[None] | None = None

    def close(self) -> None:
        """End, when what became of goals is written."""
        if self._written is not None and not wait([self._written], WRITTEN).done:
            path = self._node.setting('audit')
            self._node.get_logger().warning(f"audit '{path}' has not taken all lines")

    def judged(self, model: str | None, result: CorrectedGoal | Refusal, below: str = '') -> None:
        """Tell of a goal that was worked out; as `settle`."""
        if isinstance(result, Refusal):
            self.settle(model, result, 'refused', result.reason, below)
        else:
            self.settle(
                model, result, 'corrected' if result.before else 'nothing to correct', '', below
            )

    def settle(
        self,
        model: str | None,
        result: CorrectedGoal | Refusal | None,
        verdict: str,
        why: str,
        below: str = '',
    ) -> None:
        """Tell what became of a goal; ``below``: what a controller said that did not take it."""
        largest = None if result is None else result.largest
        line: dict[str, Any] = {
            'time': datetime.now(timezone.utc).isoformat(timespec='milliseconds'),
            'model': model,
            'applied': self._node.setting('apply'),
            'verdict': 'rejected by the controller' if below else verdict,
            'why': below or why,
            'largest_m': None if largest is None else largest[0],
            'largest_rad': None if largest is None else largest[1],
        }
        if isinstance(result, CorrectedGoal):
            line |= {
                'expected_before_m': result.before,
                'expected_after_m': result.after,
                'bound_m': result.bound,
                'waits_s': result.waits,
                'notes': list(result.notes),
            }
        text = json.dumps(line)
        self._out.publish(AUDIT.message_class()(data=text))
        sentence = f'goal {text}'
        if below or verdict == 'refused':
            self._node.get_logger().warning(sentence)
            self._node.health.say(f'goal {line["verdict"]}: {line["why"]}')
        else:
            self._node.get_logger().info(sentence)
        self._write(text)

    def _write(self, text: str) -> None:
        """Add a line to the file beside: poses do not wait for a disk."""
        path = self._node.setting('audit')
        if path:
            if self._written is not None and not self._written.done():
                self._node.warn(path, f"audit '{path}' does not take lines; they wait")
            self._written = self._books.submit(self._append, path, text)

    def _append(self, path: str, text: str) -> None:
        try:
            with Path(path).open('a', encoding='utf-8') as file:
                file.write(text + '\n')
        except OSError as error:
            self._node.warn(path, f"audit '{path}' cannot be written: {error.strerror}")


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
        done: Callable[[Judged], None],
    ) -> None:
        """Work a goal out, its joints called by the names it has; then tell."""
        try:
            points = self._read(goal, names)
        except TwinError as error:
            done((Refusal(str(error)), ()))
            return
        doing = self._goals.submit(corrected_goal, model, points.goal, limits, start)

        def look() -> None:
            if not doing.done() or timer.is_canceled():
                return
            timer.cancel()
            self._node.destroy_timer(timer)
            try:
                done((_tolerated(goal, points, doing.result()), points.columns))
            except TwinError as error:
                done((Refusal(str(error)), ()))

        timer = self._node.every(POLL, look)

    def _read(self, goal: Any, names: tuple[str, ...]) -> GoalPoints:
        """Return the points of a goal; refuse one that was corrected or should have begun already."""
        if MARK in goal.trajectory.header.frame_id:
            raise DataError('the goal was corrected already, as the frame_id of its header says')
        given = read_goal(goal.trajectory, names)
        at = time_ns(goal.trajectory.header.stamp)
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
