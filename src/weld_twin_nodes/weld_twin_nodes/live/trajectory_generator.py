# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Trajectory generator: plans a seam and publishes it as joint states."""

from __future__ import annotations

from functools import partial
from typing import Any, ClassVar

import numpy as np
from rclpy.duration import Duration

from weld_twin_core.arm.chain import forward
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.cdr_write import JointStateEncoder
from weld_twin_msgs_py.messages.topics import (
    BY_NAME,
    JOINT_STATES,
    JOINT_TRAJECTORY,
    PATH,
    PLANNED_PATH,
    PLANNED_TRAJECTORY,
)

from ..offline.seam_motion import backward, joint_motion, plan_through, sampled, stamps, thinned
from .cell_frames import measuring_frame
from .cell_node import CellNode
from .meeting import Meeting
from .pacing import Pump
from .robot_settings import ROBOT_SETTINGS, robot_of
from .run_node import run
from .settings import Setting

TICK = 0.002
"""Seconds between two looks at what is due."""
BURST = 50
"""Samples sent at one look; well below the depth of the listeners' queues."""

SHOWN = 500
"""Points of the motion as it is told to planners and pictures."""
ACKNOWLEDGED = 3.0
"""Seconds to wait for the subscribers' middleware to have received everything."""


class TrajectoryGenerator(CellNode):
    """Publishes planned positions and velocities once its subscribers are there."""

    settings: ClassVar[tuple[Setting, ...]] = (
        *ROBOT_SETTINGS,
        Setting(
            'source',
            'plan',
            'where the motion is from: plan, or the messages of '
            'joint_trajectory or path, each run when it comes',
            choices=('plan', 'joint_trajectory', 'path'),
        ),
        Setting('path', 'line', 'kind of the bundled seam, or path of a path file'),
        Setting('profile', 'smooth', 'time law: constant, trapezoid, s-curve, smooth, aggressive'),
        Setting('speed', 0.0, "speed along the seam [m/s]; 0: the time law's own", 0.0, 10.0),
        Setting('rate', 125.0, 'samples of the motion [1/s]', 1.0, 10_000.0),
        Setting(
            'repeat', 1, 'how often, there and back by turns [1]; 0: until stopped', 0, 1_000_000
        ),
        Setting(
            'playback',
            1.0,
            'speed against real time [1]; 0: as fast as the subscribers keep up',
            0.0,
            1000.0,
        ),
        Setting(
            'follow',
            '',
            'topic of the last result of a joint state, whose stamps tell '
            'that the subscribers kept up',
        ),
        Setting('window', 100, 'joint states that may be under way [1]', 1, 100_000),
        Setting('start_stamp_ns', 0, 'stamp of the first sample [ns]; 0: now', 0, 2**62),
        Setting(
            'meet_within',
            30.0,
            'longest wait for the subscribers before the first sample [s]',
            0.0,
            3600.0,
        ),
        Setting('exit_when_done', False, 'end the node after the last sample'),
    )

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('trajectory_generator', **kwargs)
        self._robot = robot_of(self)
        self._law = self.setting('profile'), self.setting('rate'), self.setting('speed')
        self._playback = self.setting('playback')
        self._encode = JointStateEncoder(self._robot.joint_names)
        self._publisher = self.offer(JOINT_STATES)
        self._planned = self.offer(PLANNED_TRAJECTORY, awaited=False)
        self._seam = self.offer(PLANNED_PATH, awaited=False)
        self._stamps = np.zeros(0, dtype=np.int64)
        self._pump: Pump | None = None
        self._meeting: Meeting | None = None
        self._given = False
        self._follow()
        self._take_source()

    @property
    def done(self) -> bool:
        """Return whether the last sample was sent."""
        return self._pump is not None and self._pump.done and self._rounds == 0

    def _take_source(self) -> None:
        source = self.setting('source')
        if source == 'plan':
            self._run(joint_motion(self._robot, self.setting('path'), *self._law))
        elif source == 'joint_trajectory':
            self.listen(JOINT_TRAJECTORY, self._on_trajectory, required=True)
        else:
            self.listen(PATH, self._on_path, required=True)

    def _on_trajectory(self, message: Any) -> None:
        self._refuse_busy()
        motion = from_messages.joint_trajectory(message, self._robot.joint_names)
        self._run(sampled(self._robot, motion, self.setting('rate')))

    def _on_path(self, message: Any) -> None:
        self._refuse_busy()
        self._run(plan_through(self._robot, from_messages.path_points(message), *self._law).motion)

    def _refuse_busy(self) -> None:
        if self._given and not self.done:
            raise DataError('the motion before is still under way; send the next one after it')

    def _follow(self) -> None:
        name = self.setting('follow')
        if not name:
            return
        topic = BY_NAME.get('/' + name.lstrip('/'))
        if topic is None:
            raise DataError(f'follow must be one of {", ".join(BY_NAME)}, got {name!r}')
        self.create_subscription(
            topic.message_class(), name, self._on_answer, topic.offered.to_rclpy()
        )

    def _on_answer(self, message: Any) -> None:
        if self._pump is not None:
            self._pump.answer(from_messages.stamp_ns(message))

    def _run(self, motion: JointMotion) -> None:
        """Tell of a motion, and run it when the subscribers are there."""
        self._motion, self._rounds = motion, self.setting('repeat') - 1
        self._given, self._pump = True, None
        now = self.get_clock().now().nanoseconds
        shown = thinned(motion, SHOWN)
        self._planned.publish(self.messages.joint_trajectory(now, self._robot.joint_names, shown))
        self._seam.publish(
            self.messages.path(now, forward(self._robot, shown.q), measuring_frame(self))
        )
        self.get_logger().info(
            f'{motion.t.size} joint states in {motion.t[-1] - motion.t[0]:.1f} s'
        )
        if self._meeting is None:
            self._meeting = Meeting(self, self.setting('meet_within'), self._begin)
        else:
            self._begin()

    def _begin(self) -> None:
        self.get_logger().info(f'beginning: {_listened(self.listeners())}')
        self._timer = self.every(TICK, self._begin_in_time)
        self._begin_in_time()

    def _begin_in_time(self) -> None:
        start = self.setting('start_stamp_ns') or self.get_clock().now().nanoseconds
        if start == 0:  # simulated time that nobody has told yet
            return
        self._timer.cancel()
        self._stamp(start)
        # The look-out runs on the wall clock: under use_sim_time the time of the samples is the
        # simulator's, which may stand still.
        self._timer = self.every(TICK, self._send)

    def _stamp(self, start: int) -> None:
        self._stamps = stamps(self._motion.t, start)
        self._pump = Pump(
            self._stamps,
            playback=self._playback,
            window=self.setting('window'),
            answered=bool(self.setting('follow')),
        )

    def _send(self) -> None:
        assert self._pump is not None
        for k in self._pump.due(self.get_clock().now().nanoseconds, BURST):
            self._publisher.publish(
                self._encode(int(self._stamps[k]), self._motion.q[k], self._motion.velocity[k])
            )
        if self._pump.done and self._rounds:
            self._turn()
        if self._pump.done or (self._playback == 0.0 and not self.setting('follow')):
            self._publisher.wait_for_all_acked(Duration(seconds=ACKNOWLEDGED))
        if self._pump.done:
            self._timer.cancel()
            self.get_logger().info(f'{self._pump.sent} joint states sent')
            self.finished = self.setting('exit_when_done')

    def _turn(self) -> None:
        """Go back the way the motion came, its first sample one step after the last one."""
        self._rounds -= 1
        self._motion = backward(self._motion)
        self._stamp(2 * int(self._stamps[-1]) - int(self._stamps[-2]))


def _listened(listeners: dict[str, int]) -> str:
    return ', '.join(f'{count} subscribers of {topic}' for topic, count in listeners.items())


main = partial(run, TrajectoryGenerator)
"""Run the node with arguments, or with those of the program; return the exit code."""


if __name__ == '__main__':
    raise SystemExit(main())
