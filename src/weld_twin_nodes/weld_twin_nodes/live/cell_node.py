# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What every node of the cell shares: settings, a robot, guarded inputs, outputs, and its end."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar

from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

from weld_twin_core.arm.robot import Robot
from weld_twin_core.errors import DataError, ModelError, TwinError
from weld_twin_msgs_py.assembly import Intake
from weld_twin_msgs_py.assembly.foreign_types import ACCEPTED, FedBack, plain_messages, plain_poses
from weld_twin_msgs_py.messages.from_messages import time_ns
from weld_twin_msgs_py.messages.topics import (
    BY_NAME,
    DIAGNOSTICS,
    FRAMES,
    MEASURED_POSE,
    VOLATILE,
    Topic,
)

from ..streams.stamp_watch import StampWatch
from .health import Input, Output
from .settings import SHARED, QosOverrides, Setting, refuse_unknown
from .source import Source, Wanted, full_names, unreached_subscribers
from .telling_node import TellingNode
from .words import ALIVE, reader

READY_EVERY = 0.02
"""Seconds between two looks at whether the listeners are there."""
TURN = 0.1
"""Seconds of one turn of the loop that serves a node before it can begin."""
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
"""Seconds of a jump of the clock forwards that is reported: a bag that is played jumps by its pauses."""
KNOWN = 2.0
"""
Seconds for the middleware to match the subscriptions that the graph tells of. Discovery takes
0.1 s, on a crowded machine a second; one that never matches asks for another quality of service.
"""
BESIDE = 'joints beside'
"""Under which a node keeps what it says of joints that are none of the robot's."""


class CellNode(TellingNode):
    """A node whose bad input costs a sentence and a sample, never a crash or a wrong output."""

    settings: ClassVar[tuple[Setting, ...]] = ()

    def __init__(self, name: str, **kwargs: Any) -> None:
        self.finished = False
        self.failure: TwinError | None = None
        self.ending_since: float | None = None
        self.frames: Any = None
        """What the node knows of `/tf`, if it listens to it; see `tf_frames`."""
        self._outputs: list[Output] = []
        self._awaited: list[Output] = []
        self._waiting: list[Callable[[], None]] = []
        self._sources: list[Source] = []
        super().__init__(name, **kwargs)
        self.take_robot(None)
        self._jumps = self.get_clock().create_jump_callback(
            JumpThreshold(
                min_forward=Duration(seconds=FORWARDS),
                min_backward=Duration(nanoseconds=-1),
                on_clock_change=False,
            ),
            post_callback=self._jumped,
        )
        self.add_on_set_parameters_callback(self._check)

    # Settings --------------------------------------------------------------------------------

    @classmethod
    def every_setting(cls) -> tuple[Setting, ...]:
        """Return the parameters of this kind of node."""
        return (*SHARED, *cls.settings)

    def declare(self) -> None:
        """Declare the parameters; refuse those that nobody has."""
        every = self.every_setting()
        for item in every:
            self.declare_parameter(item.name, item.default, item.descriptor())
            if odd := item.odd(self.setting(item.name)):
                raise DataError(odd)
        refuse_unknown(self._parameter_overrides, [item.name for item in every])
        named = {*(topic.relative for topic in (*BY_NAME.values(), *FRAMES)), *self.own_topics()}
        self.overrides = QosOverrides(
            self, self._parameter_overrides, {self.resolve_topic_name(name) for name in named}
        )
        beside = self.setting('joints_beside') if self.has_parameter('joints_beside') else ''
        self.carrying_nothing = tuple(name.strip() for name in beside.split(','))

    def _check(self, parameters: list[Parameter]) -> SetParametersResult:
        every = {item.name: item for item in self.every_setting()}
        for name, value in ((each.name, each.value) for each in parameters):
            reason = every[name].odd(value) if name in every else ''
            reason = reason or self.why_not(name, value)
            if reason:
                return SetParametersResult(successful=False, reason=reason)
        return SetParametersResult(successful=True)

    def why_not(self, name: str, value: Any) -> str:
        """Return why a running node does not take a value of a parameter; empty where it does."""
        return ''

    def own_topics(self) -> Sequence[str]:
        """Return the names of topics that are none of the table."""
        return ()

    def take_robot(self, robot: Robot | None, joint_names: tuple[str, ...] | None = None) -> None:
        """Take the robot, and what joint states call its joints, for the diagnostics."""
        self.arm, self.joint_names = robot, joint_names
        parts = self.get_namespace().strip('/'), '' if robot is None else robot.name
        self.health.hardware_id = self.setting('hardware_id') or '/'.join(filter(None, parts))

    # Inputs ----------------------------------------------------------------------------------

    def listen(
        self,
        topic: Topic,
        callback: Callable[[Any], None],
        *,
        required: bool = False,
        at_once: bool = False,
        hold_last: bool = False,
    ) -> Input:
        """
        Subscribe to a topic of the table once the outputs have their subscribers.

        callback: takes an object that `weld_twin_msgs_py.messages.from_messages` reads. Messages
        of other types that stand for the same are turned into those of the table before.
        at_once: do not wait for the subscribers of the outputs.
        required, hold_last: see `watch`.
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
        state = self.watch(name, required=required, steady=topic.steady, hold_last=hold_last)
        qos = topic.requested
        if self.setting('reliable_inputs'):
            qos = replace(qos, reliability=topic.offered.reliability)
        kinds = ACCEPTED.get(topic.name, (topic.type,))
        qos = self.overrides.of(name, 'subscription', qos)
        wanted = Wanted(topic.relative, kinds, qos, own=topic.name, required=required)
        take = self._taker(topic, kinds[0], state, callback)

        def subscribe() -> None:
            self.follow(wanted, take)
            if required:
                self.get_logger().info(f'waiting for {name}')

        if at_once:
            subscribe()
        else:
            self.when_ready(subscribe)
        return state

    def follow(self, wanted: Wanted, take: Callable[[str, bytes], None]) -> Source:
        """Take the bytes of messages, of whatever type their publishers have."""
        source = Source(self, wanted, take)
        self._sources.append(source)
        self.partners.append(source.unheard)
        return source

    def stop_listening(self, *sources: Source) -> None:
        """Take some inputs, or all of them, no more, until somebody listens again."""
        for source in sources or [*self._sources]:
            source.close()
            self.unwatch(source.name)
            self._sources.remove(source)
            self.partners.remove(source.unheard)
        if not self._sources:
            self.frames = None

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
                    state.stamped(time_ns(message.header.stamp))

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
                self.raise_unless_over()

        return guarded

    def _plain_turn(self, topic: Topic) -> Callable[[str, Any], tuple[Any, ...]]:
        """Return what turns messages of other types into those that the topic usually has."""
        part = self.setting('measured_frame') if self.has_parameter('measured_frame') else ''
        of_joints = self.setting('joint_part') if self.has_parameter('joint_part') else ''
        if topic is not MEASURED_POSE:
            return partial(plain_messages, part=of_joints)
        fed_back = FedBack(self.arm, of_joints, self.joint_names) if self.arm else None
        return partial(plain_poses, part=part, fed_back=fed_back)

    def intakes(self) -> Sequence[Intake]:
        """Return what takes messages in; what it takes for granted is reported once."""
        return ()

    def look(self) -> None:
        """Look at what was taken for granted, and at who publishes."""
        # What takes messages in is made for the robot, and a node may wait for that.
        for intake in () if self.arm is None else self.intakes():
            for sentence in intake.remarks:
                self.remark(sentence)
            self.keep(BESIDE, intake.joints.beside.warning(self.carrying_nothing))
        for source in self._sources:
            source.adapt()
            state = self.health.inputs[source.name]
            state.publishers, state.matched = len(source.infos), source.matched()
            state.senders = full_names(source.infos)
            self.tell_once(source.switched())

    def time_went_back(self) -> None:
        """Forget what was heard: the clock begins anew, as when a bag is played in a loop."""

    def _jumped(self, jump: TimeJump) -> None:
        by = jump.delta.nanoseconds * 1e-9
        for state in self.health.inputs.values():
            state.stamps = StampWatch()  # that they jump along is no news
        if by > 0.0:
            if self.get_clock().now().nanoseconds > jump.delta.nanoseconds:  # it had a time before
                self.tell_once(f'the clock jumped forwards by {by:,.3f} s')
            return
        sentence = f'time went back by {-by:.3f} s; beginning anew'
        self.get_logger().info(sentence)
        self.health.say(sentence)
        if self.frames is not None:
            self.frames.tree.clear()
        self.time_went_back()

    def answer(self, service: str, action: Callable[[], str]) -> None:
        """Offer a service that answers with what an action says, or with why it cannot be done."""

        def answered(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            try:
                response.message, response.success = action(), True
            except TwinError as error:
                response.message = str(error)
            return response

        self.create_service(Trigger, service, answered)

    # Outputs ---------------------------------------------------------------------------------

    def offer(self, topic: Topic, *, awaited: bool = True) -> Output:
        """Return a publisher of a topic of the table; ``wait_for_subscribers`` is for awaited."""
        name = self.resolve_topic_name(topic.relative)
        offered = self.overrides.of(name, 'publisher', topic.offered)
        publisher = self.create_publisher(
            topic.message_class(),
            topic.relative,
            offered.to_rclpy(),
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        )
        output = Output(publisher, stamped=topic.stamped)
        if awaited:
            self._awaited.append(output)
        if offered.durability == VOLATILE and topic is not DIAGNOSTICS:
            self.health.outputs.append(output)
        self._outputs.append(output)
        self.partners.append(partial(unreached_subscribers, self, name, topic.type, offered))
        return output

    def when_ready(self, action: Callable[[], None]) -> None:
        """Run an action once every output has as many subscribers as it waits for."""
        if self.setting('wait_for_subscribers') == 0:
            action()
            return
        if not self._waiting:
            self._counted_at = time.monotonic()
            self._ready_timer = self.every(READY_EVERY, self._look_who_listens)
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

    def wait_for(self, what: str) -> None:
        """Tell, as long as it is so, what is waited for; empty for nothing."""
        said = f'waiting for {what}' if what else ''
        if said and 'waiting' not in self.health.lasting:
            self.get_logger().info(said)
        self.keep('waiting', said, logged=False)

    def serve_until(self, condition: Callable[[], bool], what: str) -> None:
        """Serve until the node has what it can do nothing without; say what it waits for."""
        self.wait_for(what)
        runner = SingleThreadedExecutor(context=self.context)
        runner.add_node(self)
        try:
            while not condition():
                if not self.context.ok():
                    raise ModelError(f'stopped while waiting for {what}')
                runner.spin_once(timeout_sec=TURN)
        finally:
            runner.remove_node(self)
            runner.shutdown()
        self.wait_for('')

    def _look_who_listens(self) -> None:
        now = time.monotonic()
        self.wait_for(', '.join(self.lacking()))
        if self.lacking():
            self._counted_at = now
            return
        if self.unmatched() and now - self._counted_at < KNOWN:
            return
        self._ready_timer.cancel()
        waiting, self._waiting = self._waiting, []
        for action in waiting:
            action()

    # The end ---------------------------------------------------------------------------------

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
            # Who listens to the health of nodes may not have found a new one yet.
            end = time.monotonic() + MEETS
            there = self.diagnostics.get_subscription_count
            while there() < self.count_subscribers(DIAGNOSTICS.name) and time.monotonic() < end:
                time.sleep(READY_EVERY)
            self.tell_health()
            self.tell_last_losses()
            begun = time.monotonic()
            for output in self._outputs:
                if not self._taken_in(output, begun):
                    self.get_logger().warning(
                        f'{output.topic}: a subscriber has not taken in all that was sent to it; '
                        'this node ends without waiting for it any longer'
                    )
        super().destroy_node()  # type: ignore[no-untyped-call]

    def _taken_in(self, output: Output, begun: float) -> bool:
        """Wait until all who take an output have all of it, or stand still; return whether they have."""
        asked = begun if self.ending_since is None else self.ending_since
        while True:
            readers = full_names(self.get_subscriptions_info_by_topic(output.topic))
            live = readers <= self.neighbours.alive()
            remaining = (begun + LAST_WORDS if live else asked + ALIVE) - time.monotonic()
            # What stands still has had its time with the outputs before, and an ack is there or not.
            if output.wait_for_all_acked(
                Duration(seconds=min(max(remaining, 1e-3), ACKNOWLEDGED))
            ):
                return True
            if remaining <= 0.0:
                return False
