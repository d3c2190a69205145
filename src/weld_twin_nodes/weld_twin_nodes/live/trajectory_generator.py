# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Plans a seam and publishes it as joint states, in real time or as fast as the listeners keep up."""

import time
from collections.abc import Callable, Collection
from functools import partial
from typing import Any, ClassVar

import numpy as np
from rclpy.duration import Duration

from weld_twin_core.arm.chain import forward
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion
from weld_twin_msgs_py.messages import from_messages, topics
from weld_twin_msgs_py.messages.cdr import JointStateEncoder

from ..offline.exporting import without_limits
from ..offline.seam_motion import backward, joint_motion, plan_through, sampled, stamps, thinned
from .cell_node import CellNode
from .robot_settings import ROBOT_SETTINGS, measuring_frame, robot_of
from .run_node import run
from .settings import MODULES, Setting
from .words import Book

QUIET = 1.0
"""
Seconds without a change on the graph after which nobody else is taken to be coming. Nodes that
are started together appear within some tenths of a second of each other.
"""
LOOK_EVERY = 0.05
"""Seconds between two looks at who is there."""
Count = Callable[[str], int]


def apart(book: Book, there: Collection[str]) -> list[str]:
    """
    Return whose word or whose listeners are still to come, among the nodes there are.

    That two others have not found each other yet only they know, and perhaps one alone.
    """
    words = [word for word in book.latest() if word.node in there]
    known = [node for node in there if node.rpartition('/')[2] in MODULES]
    out = [f'{node} to tell of itself' for node in known if node not in book.nodes()]
    for word in words:
        for topic, count in word.reached.items():
            wanted = [other.node for other in words if topic in other.inputs]
            if count < len(wanted):
                out.append(f'{word.node} to reach {" and ".join(wanted)} on {topic}')
    for word in words:
        for topic, heard in word.heard.items():
            wanted = [other.node for other in words if topic in other.reached]
            if heard.publishers < len(wanted):
                out.append(f'{word.node} to hear {" and ".join(wanted)} on {topic}')
    return out


def beyond(book: Book, there: Collection[str], publishers: Count, subscribers: Count) -> list[str]:
    """Return whom the nodes that are there have met and the own graph does not show yet."""
    out = []
    for word in book.latest():
        if word.node in there:
            out += [
                f'somebody to be seen who sends {topic} to {word.node}'
                for topic, heard in word.heard.items()
                if publishers(topic) < heard.publishers
            ]
            out += [
                f'somebody to be seen who takes {topic} from {word.node}'
                for topic, count in word.reached.items()
                if subscribers(topic) < count
            ]
    return out


class Meeting:
    """
    Runs an action once, when the listeners of a node are there.

    With ``wait_for_subscribers`` it waits for that many. Without, for a graph that has at least
    one listener and no longer changes, on which the nodes of the project reach each other. Either
    wait has an end [s], at which it says what is missing.
    """

    def __init__(self, node: CellNode, within: float, action: Callable[[], None]) -> None:
        self._node, self._within, self._action = node, within, action
        self._begun = self._changed = time.monotonic()
        self._seen: Any = None
        self._book = Book()
        node.neighbours.hear(self._book.take)
        self._timer = node.every(LOOK_EVERY, self._look)

    def _look(self) -> None:
        now = time.monotonic()
        missing = self._missing(now)
        if missing and now - self._begun <= self._within:
            self._node.wait_for(missing)
            return
        if missing:
            self._node.tell_once(f'waited {self._within:g} s for {missing}; beginning without')
        self._node.wait_for('')
        self._timer.cancel()
        self._node.neighbours.hear_no_more(self._book.take)
        self._action()

    def _missing(self, now: float) -> str:
        """Return what is still to come, empty when nothing is."""
        node = self._node
        if node.setting('wait_for_subscribers'):
            unmet = node.lacking() or [f'{topic} to be matched' for topic in node.unmatched()]
            return ', '.join(unmet)
        seen = (sorted(node.get_node_names_and_namespaces()), node.listeners(), node.unmatched())
        if seen != self._seen:
            self._seen, self._changed = seen, now
        if not any(node.listeners().values()):
            return f'somebody to listen to {" or ".join(node.listeners())}'
        there = {f'{space.rstrip("/")}/{name}' for name, space in seen[0]}
        unmet = apart(self._book, there)
        unmet += beyond(self._book, there, node.count_publishers, node.count_subscribers)
        if unmet:
            return ', '.join(unmet)
        if node.unmatched() or now - self._changed < QUIET:
            return 'the listeners to be complete'
        return ''


STALLED = 5.0
"""Seconds without an answer after which the window is taken to be too small: a loaded machine may
starve a listener for a second or two, and a wider window would then overflow its queue."""


class Pump:
    """
    Hands out sample numbers to send, for increasing stamps (N,) [ns].

    playback: run speed against the stamps; 0 is as fast as the listeners keep up.
    window: how many samples may be under way that nobody has answered, if answers are wanted.
    """

    def __init__(
        self, stamps: np.ndarray, *, playback: float, window: int, answered: bool
    ) -> None:
        self._stamps = stamps
        self._playback = playback
        self._window = window
        self._limit = window if answered else len(stamps)
        self._begin: int | None = None
        self._progress: int | None = None
        self.sent = 0

    @property
    def done(self) -> bool:
        """Return whether all samples were handed out."""
        return self.sent == len(self._stamps)

    def answer(self, stamp: int) -> None:
        """Take note that a listener has worked through the samples up to a stamp."""
        seen = int(np.searchsorted(self._stamps, stamp, side='right'))
        self._limit = max(self._limit, seen + self._window)
        self._progress = None

    def due(self, now: int, most: int) -> range:
        """Return the numbers of the samples to send at a time [ns], at most so many."""
        if self._begin is None:
            self._begin = now
        end = min(self._limit, self.sent + most, len(self._stamps))
        if self._playback > 0.0:
            reached = self._stamps[0] + (now - self._begin) * self._playback
            end = min(end, int(np.searchsorted(self._stamps, reached, side='right')))
        out = range(self.sent, max(end, self.sent))
        self.sent = out.stop
        # The window opens when answers stay out: a late measurement clock shifts them all.
        if self.sent < self._limit or self.done:
            self._progress = None
        elif self._progress is None:
            self._progress = now
        elif now - self._progress > STALLED * 1e9:
            self._window *= 2
            self._limit += self._window
            self._progress = None
        return out


TICK = 0.002
"""Seconds between two looks at what is due."""
BURST = 50
"""Samples sent at one look; well below the depth of the listeners' queues."""

SHOWN = 500
"""Points of the motion as it is published for planners and pictures."""
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
        for note in without_limits(self._robot):
            self.remark(note)
        self._law = self.setting('profile'), self.setting('rate'), self.setting('speed')
        self._playback = self.setting('playback')
        self._encode = JointStateEncoder(self._robot.joint_names)
        self._publisher = self.offer(topics.JOINT_STATES)
        self._planned = self.offer(topics.PLANNED_TRAJECTORY, awaited=False)
        self._seam = self.offer(topics.PLANNED_PATH, awaited=False)
        self._stamps = np.zeros(0, dtype=np.int64)
        self._pump: Pump | None = None
        self._meeting: Meeting | None = None
        self._given = False
        self._follow()
        source = self.setting('source')
        if source == 'plan':
            self._run(joint_motion(self._robot, self.setting('path'), *self._law))
        elif source == 'joint_trajectory':
            self.listen(topics.JOINT_TRAJECTORY, self._on_trajectory, required=True)
        else:
            self.listen(topics.PATH, self._on_path, required=True)

    @property
    def done(self) -> bool:
        """Return whether the last sample was sent."""
        return self._pump is not None and self._pump.done and self._rounds == 0

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
        topic = topics.BY_NAME.get('/' + name.lstrip('/'))
        if topic is None:
            raise DataError(f'follow must be one of {", ".join(topics.BY_NAME)}, got {name!r}')
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
        if start == 0:  # simulated time that nobody has published yet
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
            # It goes back the way it came, the first sample one step after the last one.
            self._rounds -= 1
            self._motion = backward(self._motion)
            self._stamp(2 * int(self._stamps[-1]) - int(self._stamps[-2]))
        if self._pump.done or (self._playback == 0.0 and not self.setting('follow')):
            self._publisher.wait_for_all_acked(Duration(seconds=ACKNOWLEDGED))
        if self._pump.done:
            self._timer.cancel()
            self.get_logger().info(f'{self._pump.sent} joint states sent')
            self.finished = self.setting('exit_when_done')


def _listened(listeners: dict[str, int]) -> str:
    return ', '.join(f'{count} subscribers of {topic}' for topic, count in listeners.items())


main = partial(run, TrajectoryGenerator)


if __name__ == '__main__':
    raise SystemExit(main())
