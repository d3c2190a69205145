# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What every node of the cell shares: settings, guarded inputs, health, and its listeners."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar

from rclpy.clock import Clock, ClockType, JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.node import Node

from weld_twin_core.arm.robot import Robot
from weld_twin_core.errors import ModelError, TwinError
from weld_twin_msgs_py.assembly import Intake
from weld_twin_msgs_py.assembly.beside import Beside
from weld_twin_msgs_py.assembly.foreign_types import ACCEPTED, FedBack, plain_messages
from weld_twin_msgs_py.messages.to_messages import ros_messages
from weld_twin_msgs_py.messages.topics import (
    BY_NAME,
    DIAGNOSTICS,
    FRAMES,
    MEASURED_POSE,
    VOLATILE,
    Topic,
)

from ..streams.stamp_watch import StampWatch
from . import qos_events
from .all_nodes import refuse_unknown
from .health import Health, Input
from .losses import Losses
from .neighbour_health import ALIVE, NeighbourHealth, Statuses
from .outputs import NODE, RUN, Output, read_told
from .partners import readers, senders, unreached_subscribers
from .qos_overrides import QosOverrides
from .settings import SHARED, Setting
from .typed_input import Turn, TypedInput, measured_turn, reader

WARN_EVERY = 5.0
"""Seconds between two warnings about the same topic."""
READY_EVERY = 0.02
"""Seconds between two looks at whether the listeners are there."""
HEALTH_EVERY = 1.0
"""Seconds between two health messages."""
MEETS = 0.5
"""Seconds in which listeners that are known find a publisher: some tenths on busy cores."""
LAST_WORDS = 8.0
"""
Seconds an ending node waits in all until its subscribers have everything. Acknowledgements take
milliseconds; what was lost on the way is sent again with Fast DDS's heartbeat, every 3 s, and on a
busy machine the first of them may be lost too. Where a subscriber does not tell of itself it is
`ALIVE` alone, counted from when the node was told to end: one that stands still would keep the node,
and `ros2 launch` ends by force what takes 5 s.
"""
ACKNOWLEDGED = 0.2
"""Seconds between two looks at who still tells of itself, and that everybody is given."""
FORWARDS = 10.0
"""Seconds of a jump of the clock forwards that is told: a bag that is played jumps by its pauses."""
KNOWN = 2.0
"""
Seconds for the middleware to match the subscriptions that the graph tells of. Discovery takes
0.1 s, on a crowded machine a second; one that never matches asks for another quality of service.
"""


BESIDE = 'joints beside'
"""Under which a node keeps what it says of joints that are none of the robot's."""


class CellNode(Node):
    """A node whose bad input costs a sentence and a sample, never a crash or a wrong output."""

    settings: ClassVar[tuple[Setting, ...]] = ()

    def __init__(self, name: str, **kwargs: Any) -> None:
        super().__init__(name, **kwargs)
        self.messages = ros_messages()
        self.refused = 0
        self.finished = False
        self.failure: TwinError | None = None
        self.ending_since: float | None = None
        self.frames: Any = None
        """What the node knows of `/tf`, if it listens to it; see `tf_frames`."""
        self._warned: dict[str, float] = {}
        self._outputs: list[Output] = []
        self._awaited: list[Output] = []
        self._waiting: list[Callable[[], None]] = []
        self._partners: list[Callable[[], list[str]]] = []
        self._sources: list[TypedInput] = []
        self._losses: dict[str, Losses] = {}
        self._held: list[Input] = []
        self._unmatched: list[str] = []
        self._declare_settings()
        self.health = Health(self.get_fully_qualified_name(), self.setting('stale_after'))
        self.take_robot(None)
        self._diagnostics = self.offer(DIAGNOSTICS, awaited=False)
        self.neighbours = NeighbourHealth(self)
        self.neighbours.hear(self._hear_counts)
        self._partners += [self._named_twice, self._timeless]
        self.every(HEALTH_EVERY, self._tell_health)
        self._jumps = self.get_clock().create_jump_callback(
            JumpThreshold(
                min_forward=Duration(seconds=FORWARDS),
                min_backward=Duration(nanoseconds=-1),
                on_clock_change=False,
            ),
            post_callback=self._jumped,
        )

    def _declare_settings(self) -> None:
        """Declare the parameters; refuse those that nobody has."""
        every = self.every_setting()
        for item in every:
            self.declare_parameter(item.name, item.default, item.descriptor())
        refuse_unknown(self._parameter_overrides, [item.name for item in every])
        named = {*(topic.relative for topic in (*BY_NAME.values(), *FRAMES)), *self.own_topics()}
        self.overrides = QosOverrides(
            self, self._parameter_overrides, {self.resolve_topic_name(name) for name in named}
        )
        beside = self.setting('joints_beside') if self.has_parameter('joints_beside') else ''
        self._moving_beside = 0
        self._carrying_nothing = tuple(name.strip() for name in beside.split(','))

    @classmethod
    def every_setting(cls) -> tuple[Setting, ...]:
        """Return the parameters of this kind of node."""
        return (*SHARED, *cls.settings)

    def own_topics(self) -> Sequence[str]:
        """Return the names of topics that are none of the table."""
        return ()

    def get_logger(self) -> RcutilsLogger:
        """Return the logger of this node."""
        logger: RcutilsLogger = super().get_logger()  # type: ignore[no-untyped-call]
        return logger

    def end(self) -> None:
        """Come to an end as by Ctrl-C: at once, unless there is something to complete."""
        self.ending_since = time.monotonic()
        if self.complete():
            self.finished = True

    def complete(self) -> bool:
        """Return whether there is nothing to complete; else begin with it, and be finished later."""
        return True

    def destroy_node(self) -> None:
        """Tell what was sent in all, and stay until everybody has it."""
        if self.context.ok():
            self._meet_listeners()
            self._tell_health()
            self._tell_last_losses()
            begun = time.monotonic()
            for output in self._outputs:
                if not self._taken_in(output, begun):
                    self.get_logger().warning(
                        f'{output.topic}: a subscriber has not taken in all that was sent to it; '
                        'this node ends without waiting for it any longer'
                    )
        super().destroy_node()  # type: ignore[no-untyped-call]

    def _meet_listeners(self) -> None:
        """Wait until those who listen to the health of nodes have found this one: it may be new."""
        end = time.monotonic() + MEETS
        there = self._diagnostics.get_subscription_count
        while there() < self.count_subscribers(DIAGNOSTICS.name) and time.monotonic() < end:
            time.sleep(READY_EVERY)

    def _taken_in(self, output: Output, begun: float) -> bool:
        """Wait until all who take an output have all of it, or stand still; return whether they have."""
        asked = begun if self.ending_since is None else self.ending_since
        while True:
            live = readers(self, output.topic) <= self.neighbours.alive()
            remaining = (begun + LAST_WORDS if live else asked + ALIVE) - time.monotonic()
            # What stands still has had its time with the outputs before, and an ack is there or not.
            if output.wait_for_all_acked(
                Duration(seconds=min(max(remaining, 1e-3), ACKNOWLEDGED))
            ):
                return True
            if remaining <= 0.0:
                return False

    def take_robot(self, robot: Robot | None, joint_names: tuple[str, ...] | None = None) -> None:
        """
        Take the robot: for the diagnostics to tell robots apart, and for what tells its joints.

        Parameters
        ----------
        joint_names : sequence of str, optional
            What its joint states call its joints.

        """
        self.arm, self.joint_names = robot, joint_names
        parts = self.get_namespace().strip('/'), '' if robot is None else robot.name
        self.health.hardware_id = self.setting('hardware_id') or '/'.join(filter(None, parts))

    def setting(self, name: str) -> Any:
        """Return the value of a parameter."""
        return self.get_parameter_or(name).value

    def every(self, period: float, action: Callable[[], None]) -> Any:
        """Return a timer [s] that runs on whether or not simulated time stands still."""

        def guarded() -> None:
            try:
                action()
            except Exception:
                self._raise_unless_over()

        return self.create_timer(period, guarded, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _raise_unless_over(self) -> None:
        """Pass an exception on, except what a shutdown in the middle of a callback causes."""
        if self.context.ok():
            raise

    def offer(self, topic: Topic, *, awaited: bool = True) -> Output:
        """Return a publisher of a topic of the table; ``wait_for_subscribers`` is for awaited."""
        name = self.resolve_topic_name(topic.relative)
        offered = self.overrides.of(name, 'publisher', topic.offered)
        publisher = self.create_publisher(
            topic.message_class(),
            topic.relative,
            offered.to_rclpy(),
            event_callbacks=qos_events.of_publisher(name, offered, self._unmatched_event),
        )
        output = Output(publisher, stamped=topic.stamped)
        if awaited:
            self._awaited.append(output)
        if offered.durability == VOLATILE and topic is not DIAGNOSTICS:
            self.health.outputs.append(output)
        self._outputs.append(output)
        self._partners.append(partial(unreached_subscribers, self, name, topic.type, offered))
        return output

    def listen(
        self,
        topic: Topic,
        callback: Callable[[Any], None],
        *,
        required: bool = False,
        at_once: bool = False,
        held: bool = False,
    ) -> Input:
        """
        Subscribe to a topic of the table once the outputs have their subscribers.

        Parameters
        ----------
        callback : callable
            Takes an object that `weld_twin_msgs_py.messages.from_messages` reads. Messages of
            other types that stand for the same are turned into those of the table before.
        required : bool
            The node can do nothing without this input; health calls its absence stale.
        at_once : bool
            Do not wait for the subscribers of the outputs.
        held : bool
            Its last value counts until the next one comes; that it does so without a source is told.

        Raises
        ------
        ModelError
            By a remap the node publishes the topic itself, or has it as another input.

        """
        name = self.resolve_topic_name(topic.relative)
        if any(output.topic == name for output in self._outputs):
            raise ModelError(
                f"{topic.name} is remapped to '{name}', which this node publishes itself; it would "
                'answer its own messages'
            )
        if name in self.health.inputs:
            raise ModelError(
                f"{topic.name} is remapped to '{name}', which is another input of this node: it would "
                'be compared with itself'
            )
        state = self.watch(name, required=required, steady=topic.steady)
        if held:
            self._held.append(state)
        kinds = ACCEPTED.get(topic.name, (topic.type,))
        take = self._taker(topic, kinds[0], state, callback)
        subscribe = partial(self._subscribe_to, topic, kinds, take, required=required)
        if at_once:
            subscribe()
        else:
            self.when_ready(subscribe)
        return state

    def _taker(
        self, topic: Topic, usual: str, state: Input, callback: Callable[[Any], None]
    ) -> Callable[[str, bytes], None]:
        """Return what takes the type and the bytes of a message, whatever they are."""
        read, turn = {usual: reader(usual)}, self._plain_turn(topic)

        counted = topic.stamped and topic.steady

        def use(message: Any) -> None:
            try:
                callback(message)
                state.used = state.last
            finally:  # whoever waits for the answer does not wait for the books
                if counted:
                    at = message.header.stamp
                    state.stamped(at.sec * 1_000_000_000 + at.nanosec)

        def guarded(kind: str, data: bytes) -> None:
            state.arrived()
            try:
                if kind == usual:
                    use(read[usual](data))
                    return
                if kind not in read:
                    read[kind] = reader(kind)
                for message in turn(kind, read[kind](data)):
                    use(message)
            except TwinError as error:
                self.refuse(state.topic, str(error))
            except Exception:
                self._raise_unless_over()

        return guarded

    def watch(self, name: str, *, required: bool, steady: bool) -> Input:
        """Return a new input, whose rate, age and losses are told from now on."""
        state = self.health.watch(name, required=required, steady=steady)
        self._losses[name] = Losses(state)
        return state

    def unwatch(self, name: str) -> None:
        """Tell no more of an input."""
        self.health.inputs.pop(name, None)
        self._losses.pop(name, None)
        self.health.lasting.pop(_loss_of(name), None)

    def stop_listening(self) -> None:
        """Take no input any more, until somebody listens again."""
        for source in self._sources:
            source.close()
            self.unwatch(source.name)
        self._sources.clear()
        self._held.clear()
        self.frames = None

    def _plain_turn(self, topic: Topic) -> Turn:
        """Return what turns messages of other types into those that the topic usually has."""
        part = self.setting('measured_frame') if self.has_parameter('measured_frame') else ''
        of_joints = self.setting('joint_part') if self.has_parameter('joint_part') else ''
        if topic is not MEASURED_POSE:
            return partial(plain_messages, part=of_joints)
        fed_back = FedBack(self.arm, of_joints, self.joint_names) if self.arm else None
        return measured_turn(part, fed_back)

    def _subscribe_to(
        self,
        topic: Topic,
        kinds: Sequence[str],
        take: Callable[[str, bytes], None],
        *,
        required: bool,
    ) -> None:
        wanted = topic.requested
        if self.setting('reliable_inputs'):
            wanted = replace(wanted, reliability=topic.offered.reliability)
        name = self.resolve_topic_name(topic.relative)
        wanted = self.overrides.of(name, 'subscription', wanted)
        source = TypedInput(
            self,
            topic,
            kinds,
            wanted,
            take,
            required=required,
            remark=self.remark,
            lack=self._lack,
            unmatched=self._unmatched_event,
        )
        self._sources.append(source)
        if required:
            self.get_logger().info(f'waiting for {name}')

    def refuse(self, source: str, reason: str) -> None:
        """Count a sample that cannot be used, and say why, now and then."""
        self.refused += 1
        state = self.health.inputs.get(source)
        if state is None:
            self.health.say(f'{source}: {reason}')
        else:
            state.refused += 1
            state.last_reason = reason
        self.warn(source, f'{source}: {reason} ({self.refused} refused so far)')

    def remark(self, sentence: str) -> None:
        """Tell once what was taken for granted: in the log, and in the node's health as long."""
        if sentence not in self.health.remarks:
            self.health.remarks.append(sentence)
            self.get_logger().info(sentence)

    def tell_beside(self, beside: Beside) -> None:
        """Tell of joints that move and are none of the robot's: one may carry it."""
        if len(beside.moving) == self._moving_beside:
            return
        self._moving_beside = len(beside.moving)
        sentence = beside.warning(self._carrying_nothing)
        if sentence and self.health.lasting.get(BESIDE) != sentence:
            self.get_logger().warning(sentence)
            self.health.lasting[BESIDE] = sentence

    def warn(self, source: str, sentence: str) -> None:
        """Write a sentence into the log, unless one from the same source was written just now."""
        now = time.monotonic()
        if now - self._warned.get(source, -WARN_EVERY) >= WARN_EVERY:
            self._warned[source] = now
            self.get_logger().warning(sentence)

    def _tell_once(self, sentence: str) -> None:
        """Tell something in the log and in the next health message, if there is something."""
        if sentence:
            self.get_logger().warning(sentence)
            self.health.say(sentence)

    def time_went_back(self) -> None:
        """Forget what was heard: the clock begins anew, as when a bag is played in a loop."""

    def when_ready(self, action: Callable[[], None]) -> None:
        """Run an action once every output has as many subscribers as it waits for."""
        if self.setting('wait_for_subscribers') == 0:
            action()
            return
        if not self._waiting:
            self._counted_at = time.monotonic()
            self._ready_timer = self.every(READY_EVERY, self._look)
            if self.lacking():
                self.get_logger().info(f'waiting for {", ".join(self.lacking())}')
        self._waiting.append(action)

    def lacking(self) -> list[str]:
        """Return what the outputs still wait for, a few words each."""
        wanted = self.setting('wait_for_subscribers')
        return [
            f'{output.get_subscription_count()} of {wanted} subscribers of {output.topic}'
            for output in self._awaited
            if output.get_subscription_count() < wanted
        ]

    def listeners(self) -> dict[str, int]:
        """Return how many subscriptions each main output reaches."""
        return {output.topic: output.get_subscription_count() for output in self._awaited}

    def unmatched(self) -> list[str]:
        """Return the topics that somebody subscribes to whom the middleware does not reach yet."""
        return [
            output.topic
            for output in self._outputs
            if output.get_subscription_count() < self.count_subscribers(output.topic)
        ]

    def _look(self) -> None:
        now = time.monotonic()
        if self.lacking():
            self._counted_at = now
            self.health.lasting['waiting'] = f'waiting for {", ".join(self.lacking())}'
            return
        if self.unmatched() and now - self._counted_at < KNOWN:
            return
        self._ready_timer.cancel()
        self.health.lasting.pop('waiting', None)
        waiting, self._waiting = self._waiting, []
        for action in waiting:
            action()

    def mismatch(self, topic: str, sentence: str) -> None:
        """Tell of a partner that gets or gives nothing, as long as there are partners."""
        self.get_logger().warning(sentence)
        self.health.lasting[topic] = sentence

    def _jumped(self, jump: TimeJump) -> None:
        by = jump.delta.nanoseconds * 1e-9
        for state in self.health.inputs.values():
            state.stamps = StampWatch()  # that they jump along is no news
        if by > 0.0:
            if self.get_clock().now().nanoseconds > jump.delta.nanoseconds:  # it had a time before
                self._tell_once(f'the clock jumped forwards by {by:,.3f} s')
            return
        sentence = f'time went back by {-by:.3f} s; beginning anew'
        self.get_logger().info(sentence)
        self.health.say(sentence)
        if self.frames is not None:
            self.frames.tree.clear()
        self.time_went_back()

    def intakes(self) -> Sequence[Intake]:
        """Return what takes messages in: what it takes for granted is told, not with every message."""
        return ()

    def _tell_health(self) -> None:
        for intake in self.intakes():
            for sentence in intake.remarks:
                self.remark(sentence)
            self.tell_beside(intake.joints.beside)
        for source in self._sources:
            source.adapt()
            self.health.inputs[source.name].matched = source.matched()
            self._tell_once(source.switched())
        for name, state in self.health.inputs.items():
            state.publishers = self.count_publishers(name)
        self._look_at_losses()
        self._look_at_held()
        self._look_at_partners()
        self._diagnostics.publish(
            self.messages.statuses(self.get_clock().now().nanoseconds, self.health.statuses())
        )

    def _hear_counts(self, statuses: Statuses) -> None:
        """Hold what a node tells it has sent against what has come of it."""
        for values in statuses.values():
            for topic, sent in read_told(values).items():
                if topic in self._losses:
                    teller = values.get(NODE, ''), values.get(RUN, '')
                    self._losses[topic].counted.tell(teller, sent, self.health.inputs[topic])

    def _look_at_losses(self) -> None:
        """Tell of an input that lacks messages when it begins and when it ends."""
        now = time.monotonic()
        for name, losses in self._losses.items():
            for sentence in losses.look(senders(self, name), now):
                self._tell_once(sentence)
            self.health.lasting.pop(_loss_of(name), None)
            if losses.telling:
                self.health.lasting[_loss_of(name)] = losses.telling

    def _look_at_held(self) -> None:
        """Tell, as long as it is so, of a value that counts although nobody tells it any more."""
        now = time.monotonic()
        for state in self._held:
            key, silent = f'held from {state.topic}', state.silent(now)
            if not (silent and state.used):  # what was refused counts for nothing
                self.health.lasting.pop(key, None)
                continue
            if key not in self.health.lasting:
                self.get_logger().warning(f'{state.topic}: silent; its last value still counts')
            self.health.lasting[key] = (
                f'{state.topic}: the value that counts is {now - state.used:.1f} s old, nothing usable '
                'came since'
            )

    def _tell_last_losses(self) -> None:
        for losses in self._losses.values():
            for sentence in losses.ended():
                self.get_logger().warning(sentence)

    def _lack(self, sentence: str) -> None:
        """Tell of what is missing here, from now on."""
        self.get_logger().warning(sentence)
        self.health.lasting[sentence] = sentence

    def _named_twice(self) -> list[str]:
        """Return that another node has this one's name, if one has."""
        own = self.get_fully_qualified_name()
        if not self.neighbours.twice(own):
            return []
        return [
            f'another node of the name {own} is running: both publish, and both answer; end one of them'
        ]

    def _timeless(self) -> list[str]:
        """Return that simulated time is asked for and has not begun, if so."""
        if not self.setting('use_sim_time') or self.get_clock().now().nanoseconds:
            return []
        return ['use_sim_time is set, and nothing has come on /clock: time stands at zero']

    def _unmatched_event(self, _: str) -> None:
        """Tell at once of what the graph shows; the event itself does not know the partner."""
        self._look_at_partners()

    def _look_at_partners(self) -> None:
        """Tell of every partner that does not match, as long as it is there."""
        for key in [key for key in self.health.lasting if key.startswith('/') and ' ' not in key]:
            if not self.count_publishers(key) * self.count_subscribers(key):
                del self.health.lasting[key]
        looks = (*self._partners, *(source.unheard for source in self._sources))
        unmatched = [sentence for look in looks for sentence in look()]
        for sentence in unmatched:
            if sentence not in self._unmatched:
                self.get_logger().warning(sentence)
        self._unmatched = unmatched
        self.health.lasting.pop('partners', None)
        if unmatched:
            self.health.lasting['partners'] = '; '.join(unmatched)


def _loss_of(name: str) -> str:
    """Return under what the health keeps that messages of an input go missing."""
    return f'loss of {name}'
