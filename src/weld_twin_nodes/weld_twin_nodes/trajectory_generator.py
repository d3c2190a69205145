# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Trajectory generator: plans a seam and publishes it as joint states."""

from __future__ import annotations

from typing import Any

import numpy as np
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration

from weld_twin_core.errors import DataError
from weld_twin_msgs_py import convert
from weld_twin_msgs_py.topics import BY_NAME, JOINT_STATES

from .cell_node import CellNode
from .motions import plan_motion, stamps
from .pump import Pump
from .robot_settings import ROBOT_SETTINGS, robot_of
from .running import run
from .settings import Setting

TICK = 0.002
"""Seconds between two looks at what is due."""
BURST = 50
"""Samples sent at one look; well below the depth of the listeners' queues."""

ACKNOWLEDGED = 3.0
"""Seconds to wait for the subscribers' middleware to have received everything."""


class TrajectoryGenerator(CellNode):
    """Publishes planned positions and velocities once its subscribers are there."""

    settings = (
        *ROBOT_SETTINGS,
        Setting('path', 'line', 'kind of the bundled seam, or path of a path file'),
        Setting('profile', 'smooth', 'time law: constant, trapezoid, s-curve, smooth, aggressive'),
        Setting('speed', 0.0, "speed along the seam [m/s]; 0: the time law's own", 0.0, 10.0),
        Setting('rate', 125.0, 'samples of the motion [1/s]', 1.0, 10_000.0),
        Setting('playback', 1.0, 'speed against real time [1]; 0: as fast as the subscribers '
                'keep up', 0.0, 1000.0),
        Setting('follow', '', 'topic of the last result of a joint state, whose stamps tell '
                'that the subscribers kept up'),
        Setting('window', 100, 'joint states that may be under way [1]', 1, 100_000),
        Setting('start_stamp_ns', 0, 'stamp of the first sample [ns]; 0: now', 0, 2**62),
        Setting('exit_when_done', False, 'end the node after the last sample'),
    )  # fmt: skip

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('trajectory_generator', **kwargs)
        self._robot = robot_of(self)
        plan = plan_motion(
            self._robot, self.setting('path'), self.setting('profile'), self.setting('rate'),
            self.setting('speed'),
        )  # fmt: skip
        self._motion = plan.motion
        self._publisher = self.offer(JOINT_STATES)
        self._stamps = np.zeros(0, dtype=np.int64)
        self._pump: Pump | None = None
        self._follow()
        self.get_logger().info(
            f'{plan.length:.3f} m of seam in {plan.report.duration:.1f} s, '
            f'{plan.motion.t.size} joint states'
        )
        self.when_ready(self._begin)

    @property
    def done(self) -> bool:
        """Return whether the last sample was sent."""
        return self._pump is not None and self._pump.done

    def _follow(self) -> None:
        name = self.setting('follow')
        if not name:
            return
        if name not in BY_NAME:
            raise DataError(f'follow must be one of {", ".join(BY_NAME)}, got {name!r}')
        topic = BY_NAME[name]
        self.create_subscription(
            topic.message_class(), topic.name, self._on_answer, topic.offered.to_rclpy()
        )

    def _on_answer(self, message: Any) -> None:
        if self._pump is not None:
            self._pump.answer(convert.stamp_ns(message))

    def _begin(self) -> None:
        start = self.setting('start_stamp_ns') or self.get_clock().now().nanoseconds
        self._stamps = stamps(self._motion.t, start)
        self._pump = Pump(
            self._stamps, playback=self.setting('playback'), window=self.setting('window'),
            answered=bool(self.setting('follow')),
        )  # fmt: skip
        # The look-out itself runs on the wall clock: under use_sim_time the time of the samples
        # is the simulator's, which may stand still.
        self._timer = self.create_timer(
            TICK, self._send, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )

    def _send(self) -> None:
        assert self._pump is not None
        for k in self._pump.due(self.get_clock().now().nanoseconds, BURST):
            self._publisher.publish(self.messages.joint_state(
                int(self._stamps[k]), self._robot.joint_names,
                self._motion.q[k], self._motion.velocity[k],
            ))  # fmt: skip
        if self._pump.done or (self.setting('playback') == 0.0 and not self.setting('follow')):
            self._publisher.wait_for_all_acked(Duration(seconds=ACKNOWLEDGED))
        if self._pump.done:
            self._timer.cancel()
            self.get_logger().info(f'{self._pump.sent} joint states sent')
            self.finished = self.setting('exit_when_done')


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return run(TrajectoryGenerator, args)


if __name__ == '__main__':
    raise SystemExit(main())
