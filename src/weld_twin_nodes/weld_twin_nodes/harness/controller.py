# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A trajectory controller that stands in for a cell's own: it tells its joint states as it goes."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future

from weld_twin_core.arrays import Array
from weld_twin_core.twin.goal_motion import Goal, course
from weld_twin_msgs_py.messages.cdr import JointStateEncoder
from weld_twin_msgs_py.messages.goals import read_goal
from weld_twin_msgs_py.messages.topics import JOINT_STATES

TICK = 0.004
"""Seconds between two looks at what is due."""
IDLE = 5
"""Looks from one joint state to the next of an arm that stands: whoever listens has work to do."""


class Controller(Node):
    """
    Offers ``~/follow_joint_trajectory``, and runs one goal at a time; a new one takes its place.

    pace: how many times as fast as the goals say it runs them.
    beside: times [s] of a goal that it visits beside those of its beat.
    `track`: stamps [ns] of joint states on the way of the latest goal, and its time there [s].
    """

    def __init__(
        self,
        joint_names: Sequence[str],
        q: Array,
        pace: float = 1.0,
        beside: Callable[[Goal], Array] | None = None,
        name: str = 'joint_trajectory_controller',
        **kwargs: Any,
    ) -> None:
        from control_msgs.action import FollowJointTrajectory

        super().__init__(name, **kwargs)
        self._kind, self._names = FollowJointTrajectory, tuple(joint_names)
        self._pace, self._beside = pace, beside
        self.q = np.array(q, dtype=np.float64)
        self.goals: list[Any] = []
        self.track: list[tuple[int, float]] = []
        self.accepts, self.answers = True, 0.0
        self._encode = JointStateEncoder(self._names)
        self._states = self.create_publisher(
            JOINT_STATES.message_class(), JOINT_STATES.relative, JOINT_STATES.offered.to_rclpy()
        )
        self._now: tuple[Any, Goal, list[float], Future] | None = None
        self._idle = 0
        self._timer = self.create_timer(TICK, self._look)
        self._server = ActionServer(
            self,
            FollowJointTrajectory,
            '~/follow_joint_trajectory',
            self._execute,
            goal_callback=self._take,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),  # it thinks, and goes on meanwhile
        )

    def destroy_node(self) -> None:
        """Be gone at once, whatever runs."""
        self._server.destroy()
        super().destroy_node()  # type: ignore[no-untyped-call]

    async def _take(self, goal: Any) -> GoalResponse:
        if self.answers:
            thought: Future = Future()
            timer = self.create_timer(
                self.answers, lambda: thought.done() or thought.set_result(None)
            )
            await thought
            self.destroy_timer(timer)
        self.goals.append(goal)
        return GoalResponse.ACCEPT if self.accepts else GoalResponse.REJECT

    async def _execute(self, handle: Any) -> Any:
        """Run a goal to its end, or until it is cancelled or another takes its place."""
        result, trajectory = self._kind.Result(), handle.request.trajectory
        if self._now is not None:
            self._now[3].set_result('preempted')
        if not trajectory.points:
            self._now = None
            handle.succeed()
            return result
        goal, done = read_goal(trajectory, self._names).goal, Future()
        if goal.t[0] > 0.0:
            rates = [None if r is None else np.vstack([np.zeros_like(r[:1]), r]) for r in goal[2:]]
            goal = Goal(np.append(0.0, goal.t), np.vstack([self.q, goal.q]), *rates)
        self._now, self.track = (handle, goal, self._visited(goal), done), []
        end = await done
        if end == 'done':
            handle.succeed()
        elif end == 'cancelled':
            handle.canceled()
        else:
            result.error_code, result.error_string = result.INVALID_GOAL, end
            handle.abort()
        return result

    def _visited(self, goal: Goal) -> list[float]:
        """
        Return the times [s] of a goal at which the arm is commanded to be, the last one first.

        By looks, not by the clock: one that comes late must not leave out where a joint turns.
        """
        end = float(goal.t[-1])
        beat = np.append(np.arange(0.0, end, TICK * self._pace), end)
        more = np.zeros(0) if self._beside is None else self._beside(goal)
        return [float(t) for t in np.union1d(beat, more)[::-1]]

    def _look(self) -> None:
        """Go on, and tell where the arm is."""
        if self._now is None:
            self._idle = (self._idle + 1) % IDLE
            if self._idle == 0:
                self._tell()
            return
        handle, goal, remaining, done = self._now
        t = remaining.pop()
        way = course(goal, np.array([t]))
        self.q = way.q[0]
        self.track.append((self._tell(way.qd[0]), t))
        feedback = self._kind.Feedback(joint_names=list(self._names))
        feedback.desired.positions = self.q.tolist()
        handle.publish_feedback(feedback)
        if handle.is_cancel_requested or not remaining:
            self._now = None
            done.set_result('cancelled' if handle.is_cancel_requested else 'done')

    def _tell(self, qd: Array | None = None) -> int:
        stamp = self.get_clock().now().nanoseconds
        self._states.publish(
            self._encode(stamp, self.q, np.zeros_like(self.q) if qd is None else qd)
        )
        return int(stamp)
