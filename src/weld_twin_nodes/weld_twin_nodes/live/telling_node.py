# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A node that tells how it is doing, and what its inputs lack: in its log, and on `/diagnostics`."""

import time
from abc import abstractmethod
from collections import deque
from collections.abc import Callable
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.node import Node

from weld_twin_msgs_py.messages.to_messages import ros_messages
from weld_twin_msgs_py.messages.topics import DIAGNOSTICS, Topic

from ..streams.stamp_watch import Seen
from .health import Health, Input, Output
from .words import NeighbourHealth, Sent, Word

WARN_EVERY = 5.0
"""Seconds between two warnings about the same topic."""
HEALTH_EVERY = 1.0
"""Seconds between two health messages."""


class TellingNode(Node):
    """
    A node with its health.

    partners: each returns a sentence for everybody at the other end of a topic whom nothing
    reaches, or of whom nothing comes.
    """

    def __init__(self, name: str, **kwargs: Any) -> None:
        super().__init__(name, **kwargs)
        self.messages = ros_messages()
        self.refused = 0
        self.partners: list[Callable[[], list[str]]] = []
        self._warned: dict[str, float] = {}
        self._losses: dict[str, Losses] = {}
        self._holding: list[Input] = []
        self._unmatched: list[str] = []
        self.declare()
        self.health = Health(self.get_fully_qualified_name(), self.setting('stale_after'))
        self.diagnostics = self.offer(DIAGNOSTICS, awaited=False)
        self.neighbours = NeighbourHealth(self)
        self.neighbours.hear(self._hear_counts)
        self.partners += [self._named_twice, self._timeless]
        self.every(HEALTH_EVERY, self.tell_health)

    @abstractmethod
    def declare(self) -> None:
        """Declare the parameters."""

    def setting(self, name: str) -> Any:
        """Return the value of a parameter."""
        return self.get_parameter_or(name).value

    def get_logger(self) -> RcutilsLogger:
        """Return the logger of this node."""
        logger: RcutilsLogger = super().get_logger()  # type: ignore[no-untyped-call]
        return logger

    def every(self, period: float, action: Callable[[], None]) -> Any:
        """Return a timer [s] that runs on whether or not simulated time stands still."""

        def guarded() -> None:
            try:
                action()
            except Exception:
                self.raise_unless_over()

        return self.create_timer(period, guarded, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def raise_unless_over(self) -> None:
        """Pass an exception on, except what a shutdown in the middle of a callback causes."""
        if self.context.ok():
            raise

    @abstractmethod
    def offer(self, topic: Topic, *, awaited: bool = True) -> Output:
        """Return a publisher of a topic of the table; ``wait_for_subscribers`` is for awaited."""

    # What happens ----------------------------------------------------------------------------

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
        if sentence and sentence not in self.health.remarks:
            self.health.remarks.append(sentence)
            self.get_logger().info(sentence)

    def warn(self, source: str, sentence: str) -> None:
        """Write a sentence into the log, unless one from the same source was written just now."""
        now = time.monotonic()
        if now - self._warned.get(source, -WARN_EVERY) >= WARN_EVERY:
            self._warned[source] = now
            self.get_logger().warning(sentence)

    def tell_once(self, sentence: str) -> None:
        """Tell something in the log and in the next health message, if there is something."""
        if sentence:
            self.get_logger().warning(sentence)
            self.health.say(sentence)

    def keep(self, key: str, sentence: str, *, logged: bool = True) -> None:
        """Tell something as long as it is so, in the log when it begins; an empty sentence ends it."""
        if not sentence:
            self.health.lasting.pop(key, None)
            return
        if logged and key not in self.health.lasting:
            self.get_logger().warning(sentence)
        self.health.lasting[key] = sentence

    # Inputs ----------------------------------------------------------------------------------

    def watch(self, name: str, *, required: bool, steady: bool, hold_last: bool = False) -> Input:
        """
        Return a new input, whose rate, age and losses are reported from now on.

        hold_last: its last value counts until the next one comes, and that is reported.
        """
        state = self.health.watch(name, required=required, steady=steady)
        self._losses[name] = Losses(state)
        if hold_last:
            self._holding.append(state)
        return state

    def unwatch(self, name: str) -> None:
        """Tell no more of an input."""
        self.health.inputs.pop(name, None)
        self._losses.pop(name, None)
        self._holding = [state for state in self._holding if state.topic != name]
        self.keep(_loss_of(name), '')

    def look(self) -> None:
        """Look at the inputs before their health is reported."""

    def tell_health(self) -> None:
        self.look()
        now = time.monotonic()
        for name, losses in self._losses.items():  # of inputs that lack messages
            for sentence in losses.look(now):
                self.tell_once(sentence)
            self.keep(_loss_of(name), losses.telling, logged=False)
        self._look_at_old_values()
        self._look_at_partners()
        self.diagnostics.publish(
            self.messages.statuses(self.get_clock().now().nanoseconds, self.health.statuses())
        )

    def tell_last_losses(self) -> None:
        """Tell of losses that the end of the node cuts short."""
        for losses in self._losses.values():
            for sentence in losses.ended():
                self.get_logger().warning(sentence)

    def _hear_counts(self, word: Word) -> None:
        """Hold what a node tells it has sent against what has come of it."""
        for topic in word.sent.keys() & self._losses.keys():
            self._losses[topic].tell(word)

    def _look_at_old_values(self) -> None:
        """Tell, as long as it is so, of a value that counts although nobody tells it any more."""
        now = time.monotonic()
        for state in self._holding:
            old = state.silent(now) and state.used  # what was refused counts for nothing
            age = f'{now - state.used:.1f} s old, nothing usable came since'
            sentence = f'{state.topic}: the value that counts is {age}' if old else ''
            self.keep(f'held from {state.topic}', sentence)

    def _look_at_partners(self) -> None:
        """Tell of every partner that does not match, as long as it is there."""
        unmatched = [sentence for look in self.partners for sentence in look()]
        for sentence in unmatched:
            if sentence not in self._unmatched:
                self.get_logger().warning(sentence)
        self._unmatched = unmatched
        self.keep('partners', '; '.join(unmatched), logged=False)

    def _named_twice(self) -> list[str]:
        own = self.get_fully_qualified_name()
        if not self.neighbours.twice(own):
            return []
        return [
            f'another node of the name {own} is running: both publish, and both answer; end one of them'
        ]

    def _timeless(self) -> list[str]:
        if not self.setting('use_sim_time') or self.get_clock().now().nanoseconds:
            return []
        return ['use_sim_time is set, and nothing has come on /clock: time stands at zero']


def _loss_of(name: str) -> str:
    """Return under what the health keeps that messages of an input go missing."""
    return f'loss of {name}'


TELLS = 4
"""
Counts in a row that must all be short before messages are missing. They come once a second, and
what was lost on the way to a reliable reader is sent again within 3 s (Fast DDS).
"""
OVER = 4.0
"""Seconds without another missing message after which a loss is over."""


SETTLES = 3.0
"""Seconds within which a loss that still grows is reported: a burst is over by then, and the number is
that of all of it."""


class Counted:
    """What came of a topic, compared with what its publishers say they sent."""

    def __init__(self, state: Input) -> None:
        self._state = state
        self._sent: dict[tuple[str, str], Sent] = {}
        self._base = (0, 0)
        self._short: deque[int] = deque(maxlen=TELLS)
        self._heard = False
        self._before = self._now = 0

    @property
    def tellers(self) -> list[str]:
        return sorted({node for node, _ in self._sent})

    @property
    def sent(self) -> int:
        """Return how many messages were sent since they are counted."""
        return self._total() - self._base[0]

    def tell(self, word: Word) -> None:
        """Take what a node, in one of its runs, has sent by the time that this is heard."""
        teller, state = (word.node, word.run), self._state
        sent, new = word.sent[state.topic], teller not in self._sent
        alone = not self._sent
        self._sent[teller] = sent
        self._heard = True
        if new or not state.matched:  # what was sent before the two met is no loss
            whole = alone and sent.first is not None and sent.first == state.first
            self._base = (0, 0) if whole else (self._total(), state.received)
            self._before, self._now = self._before + self._now, 0
            self._short.clear()
        self._short.append(self._lack())

    def look(self) -> int:
        """Return how many messages are missing for good; to be called once a second."""
        if not self._heard and self._sent:
            self._short.append(self._lack())
        self._heard = False
        if len(self._short) == TELLS:
            self._now = max(min(self._short), 0)  # what is sent again comes after all
        return self._before + self._now

    def _total(self) -> int:
        return sum(sent.number for sent in self._sent.values())

    def _lack(self) -> int:
        return self.sent - (self._state.received - self._base[1])


class Losses:
    """The losses of one input, and, as long as they go on, what to report: `telling`."""

    def __init__(self, state: Input) -> None:
        self._state = state
        self._counted = Counted(state)
        self.tell = self._counted.tell
        self._by_stamps = 0
        self._grew = self._since = 0.0
        self._said = False
        self.telling = ''

    def look(self, now: float) -> list[str]:
        """Return sentences at a time [s], on what went missing since the last look and on stamps."""
        topic, seen, tellers = self._state.topic, self._state.stamps.look(), self._counted.tellers
        out = [f'{topic}: {sentence}' for sentence in _of_clock(seen)]
        if tellers and self._state.senders <= set(tellers):
            lost = self._counted.look()
            said = (
                f'{topic}: {lost:,} of {self._counted.sent:,} messages that '
                f'{" and ".join(tellers)} sent did not arrive'
            )
        else:
            self._by_stamps += seen.missing
            lost = self._by_stamps
            said = (
                f'{topic}: {lost:,} missing messages, by the gaps between its stamps (one is '
                f'due every {seen.step * 1e3:.3g} ms): they were lost on the way, or never sent'
            )
        grown = lost > self._state.lost
        if grown:
            self._since = self._since if self.telling else now
            self._grew, self.telling = now, said
        self._state.lost = lost
        if self.telling and not self._said and (not grown or now - self._since > SETTLES):
            self._said = True
            out.append(self.telling)
        if self.telling and now - self._grew > OVER:
            self.telling, self._said = '', False
            out.append(f'{topic}: no more messages go missing; {lost:,} are missing in all')
        return out

    def ended(self) -> list[str]:
        """Return what to report about a loss that the end of the node cuts short."""
        if not self.telling:
            return []
        return [f'{self._state.topic}: {self._state.lost:,} messages are missing in all']


def _of_clock(seen: Seen) -> list[str]:
    """Return what to report about stamps that jumped."""
    if seen.back:
        return [f'the stamps begin anew, {seen.back:,.1f} s behind the last one']
    if seen.ahead:
        return [
            f'the stamps jumped forwards by {seen.ahead:,.1f} s: a clock was set, or another '
            'recording is played'
        ]
    return []
