# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
An action in front of a controller's own: goals are decided on, then sent on; all else passes through.

A goal is accepted when the controller has accepted what became of it. The answer to a goal has no
room for a reason; it is reported in the log, on `/diagnostics` and in the audit.
"""

import json
import time
from collections import deque
from collections.abc import Awaitable, Callable
from concurrent import futures
from datetime import datetime, timezone
from pathlib import Path
from typing import Any, NamedTuple

from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import InvalidTopicNameException
from rclpy.task import Future
from rclpy.validate_topic_name import validate_topic_name

from weld_twin_core.errors import DataError, ModelError, TwinError
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

ACTION = 'follow_joint_trajectory'
ANSWER = 5.0
"""Seconds a controller has to answer; it answers within milliseconds."""
LOOK = 0.25
"""Seconds between two looks at whether a controller is there."""
GONE = 2.0
"""Seconds for which a controller must be away before its goal is given up: discovery flickers."""


class Decision(NamedTuple):
    """What becomes of a goal."""

    goal: Any  # to be sent on; None for none
    why: str  # why there is none
    settled: Callable[[str], None]
    """Called with whether the controller took it, in words: empty where it did."""
    token: object = None  # of the model it was decided with, for `GoalRelay.since`


class _Running:
    """A goal that a controller runs."""

    def __init__(self, below: Any, token: object, outcome: Future) -> None:
        self.below, self.token, self.outcome = below, token, outcome
        self.above: Any = None
        self.cancelling: Future | None = None
        self.away: float | None = None


class GoalRelay:
    """
    Serves ``~/follow_joint_trajectory``, and is a client of the controller's.

    decide: takes a goal and returns what becomes of it, when that is known.
    since: takes the token of a decision; returns what has happened to the model since, in words.
    """

    def __init__(
        self,
        node: CellNode,
        kind: Any,
        controller: str,
        decide: Callable[[Any], Awaitable[Decision]],
        since: Callable[[object], str],
    ) -> None:
        self._node, self._kind, self._decide, self._since = node, kind, decide, since
        self.below = _action_of(node, controller)
        # What waits for an answer must not keep the executor from taking it.
        group = ReentrantCallbackGroup()
        self._client = ActionClient(node, kind, self.below, callback_group=group)
        self._pending: dict[int, _Running] = {}
        self._running: list[_Running] = []
        self._turns: deque[Future] = deque()
        self._stops = 0
        self._server = ActionServer(
            node,
            kind,
            f'~/{ACTION}',
            self._execute,
            goal_callback=self._take,
            cancel_callback=self._cancel,
            callback_group=group,
        )
        node.every(LOOK, self._look)

    def close(self) -> None:
        """End the action; what runs on the controller runs on."""
        self._server.destroy()
        self._client.destroy()

    async def _take(self, goal: Any) -> GoalResponse:
        """Decide on a goal after those before it, and send it on; an order to stop waits for none."""
        if not goal.trajectory.points:
            self._stops += 1
            return await self._sent_on(goal, self._stops)
        turn, stops = Future(), self._stops
        before = self._turns[-1] if self._turns else None
        self._turns.append(turn)
        try:
            if before is not None:
                await before
            return await self._sent_on(goal, stops)
        finally:
            self._turns.remove(turn)
            turn.set_result(None)

    async def _sent_on(self, goal: Any, stops: int) -> GoalResponse:
        decision = await self._decide(goal)
        if self._stops != stops:
            decision.settled('an order to stop came before it was sent on')
            return GoalResponse.REJECT
        if decision.goal is None:
            decision.settled('')
            return GoalResponse.REJECT
        if not self._client.server_is_ready():
            decision.settled(f'no controller offers {self.below}')
            return GoalResponse.REJECT
        outcome = Future()
        running = _Running(None, decision.token, outcome)
        sending = self._client.send_goal_async(decision.goal, self._feedback(running))
        running.below = await self._answered(sending)
        if running.below is None:
            # A controller that answers after all must not run what nobody waits for.
            sending.add_done_callback(_call_back)
            decision.settled(f'{self.below} did not answer within {ANSWER:g} s')
            return GoalResponse.REJECT
        if not running.below.accepted:
            decision.settled(f'{self.below} rejected it')
            return GoalResponse.REJECT
        decision.settled('')
        running.below.get_result_async().add_done_callback(
            lambda done: outcome.done() or outcome.set_result(done.result())
        )
        self._pending[id(goal)] = running
        self._running.append(running)
        return GoalResponse.ACCEPT

    async def _answered(self, asked: Future) -> Any:
        """Return the answer to something asked, None where it stays out."""
        either: Future = Future()
        asked.add_done_callback(lambda _: either.done() or either.set_result(None))
        timer = self._node.every(ANSWER, lambda: either.done() or either.set_result(None))
        await either
        self._node.destroy_timer(timer)
        return asked.result() if asked.done() else None

    def _feedback(self, running: _Running) -> Callable[[Any], None]:
        def pass_on(message: Any) -> None:
            if running.above is not None and running.above.is_active:
                running.above.publish_feedback(message.feedback)

        return pass_on

    async def _execute(self, above: Any) -> Any:
        """Pass the result through, and say where the model was withdrawn meanwhile."""
        running = self._pending.pop(id(above.request))
        running.above = above
        outcome = await running.outcome
        if running.cancelling is not None:  # the result may overtake the answer to the cancel
            await running.cancelling
        self._running.remove(running)
        if isinstance(outcome, str):
            above.abort()
            return self._kind.Result(
                error_code=self._kind.Result.INVALID_GOAL, error_string=outcome
            )
        result = outcome.result
        happened = self._since(running.token)
        if happened:
            sentence = f'weld_twin: ended as begun, though {happened}'
            result.error_string = '; '.join(filter(None, [result.error_string, sentence]))
            self._node.get_logger().warning(sentence)
        if outcome.status == GoalStatus.STATUS_SUCCEEDED:
            above.succeed()
        elif outcome.status == GoalStatus.STATUS_CANCELED and above.is_cancel_requested:
            above.canceled()
        else:
            above.abort()
        return result

    async def _cancel(self, above: Any) -> CancelResponse:
        """Ask the controller, and answer what it answers."""
        running = next((each for each in self._running if each.above is above), None)
        running = running or self._pending.get(id(above.request))
        if running is None:
            return CancelResponse.REJECT
        running.cancelling = cancelling = Future()
        answer = await self._answered(running.below.cancel_goal_async())
        cancelling.set_result(None)
        taken = answer is not None and bool(answer.goals_canceling)
        return CancelResponse.ACCEPT if taken else CancelResponse.REJECT

    def _look(self) -> None:
        """Give up goals whose controller has gone."""
        there = self._client.server_is_ready() if self._running else True
        now = time.monotonic()
        for running in self._running:
            if there:
                running.away = None
                continue
            running.away = running.away or now
            if now - running.away > GONE and not running.outcome.done():
                running.outcome.set_result(
                    f'{self.below} is gone: whether the arm still moves is not known'
                )


def _action_of(node: CellNode, controller: str) -> str:
    own = controller.rstrip('/')
    below = own if own.endswith(ACTION) else f'{own}/{ACTION}'
    try:
        validate_topic_name(below)
    except InvalidTopicNameException as error:
        raise ModelError(
            f"controller '{controller}' is no name: {str(error).splitlines()[0].rstrip(':')}"
        ) from None
    if not own or node.resolve_topic_name(below) == node.resolve_topic_name(f'~/{ACTION}'):
        raise ModelError(
            f"controller '{controller}' names no controller: goals go from this node to the action "
            f'{ACTION} of the node that moves the arm'
        )
    return below


def _call_back(sent: Future) -> None:
    """Cancel a goal whose acceptance came too late."""
    below = sent.result()
    if below is not None and below.accepted:
        below.cancel_goal_async()


WRITTEN = 1.0
"""Seconds an ending node gives its disk to take the audit."""


class GoalAudit:
    """Tells of goals for a node, whose parameters ``apply`` and ``audit`` it reads."""

    def __init__(self, node: CellNode) -> None:
        self._node = node
        self._out = node.offer(AUDIT, awaited=False)
        self._books = WorkBeside()
        self._written: futures.Future[None] | None = None

    def close(self) -> None:
        """End, when what became of goals is written."""
        if self._written is not None and not futures.wait([self._written], WRITTEN).done:
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
