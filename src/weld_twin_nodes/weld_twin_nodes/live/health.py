# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How a node is doing: what each input brought and each output sent, as diagnostic statuses."""

import json
import time
from collections import deque
from math import inf, isfinite
from typing import Any

from rclpy.duration import Duration

from weld_twin_msgs_py.messages.cdr import first_time_ns
from weld_twin_msgs_py.messages.from_messages import time_ns
from weld_twin_msgs_py.messages.to_messages import Status

from ..streams.stamp_watch import StampWatch
from .words import HEARD, NODE, REACHED, RUN, SENT, Sent


class Output:
    """A publisher that counts; its ``stamped`` messages begin with a header."""

    def __init__(self, publisher: Any, *, stamped: bool) -> None:
        self.publisher = publisher
        self.topic: str = publisher.topic_name
        self._send = publisher.publish
        self._stamped = stamped
        self._count = 0
        self._first: Any = None
        self._last: Any = None

    def publish(self, message: Any) -> None:
        """Publish a message, or the bytes of one."""
        self._send(message)
        self._count += 1
        self._last = message
        if self._first is None:
            self._first = message

    def get_subscription_count(self) -> int:
        """Return how many subscriptions the middleware has matched."""
        return int(self.publisher.get_subscription_count())

    def wait_for_all_acked(self, longest: Duration) -> bool:
        """Wait until all reliable subscribers have everything; return whether they have."""
        return bool(self.publisher.wait_for_all_acked(longest))

    @property
    def sent(self) -> Sent:
        """Return what was published so far."""
        if not self._stamped or self._first is None:
            return Sent(self._count)
        return Sent(self._count, header_stamp(self._first), header_stamp(self._last))


def header_stamp(message: Any) -> int:
    """Return the header stamp of a message, or of the bytes of one [ns]."""
    if isinstance(message, bytes | bytearray | memoryview):
        return first_time_ns(message)
    return time_ns(message.header.stamp)


OK, WARN, ERROR, STALE = range(4)
"""Levels of diagnostic_msgs/DiagnosticStatus."""
RATE_CHANGE = 3.0
"""Ratio to the usual rate from which on a rate is reported as changed."""
USUAL = 15
"""Looks over which the usual rate is taken."""
SLOW = 2
"""Pauses in a row, with no quicker message between, that make an input a slow one, such as a
thermometer that is read every ten seconds: it is silent when it misses one."""


class Input:
    """
    One input of a node, stale after ``patience`` [s], or five periods where that is longer.

    Patience is infinite for an input that comes when there is something to tell.
    """

    def __init__(self, topic: str, required: bool, patience: float) -> None:
        self.topic = topic
        self.received = self.refused = self.others = 0
        self.publishers = 0
        self.senders: set[str] = set()
        """Nodes that publish it, by the graph."""
        self.matched = 0
        """Publishers that the subscription itself has met; the graph may know of more."""
        self.last_reason = ''
        self.last = self.used = 0.0
        """When the last message came, and the last one that was not refused; 0 for none."""
        self.first: int | None = None
        """Stamp of the first message, where they have stamps [ns]."""
        self.lost = 0
        """Messages that were sent and did not come, as far as it is known."""
        self.stamps = StampWatch()
        self._required = required
        self._patience = patience
        self._rates: deque[float] = deque(maxlen=USUAL)
        self._pauses: deque[float] = deque(maxlen=SLOW)
        self._before = (time.monotonic(), 0, 0, 0)

    def arrived(self) -> None:
        now = time.monotonic()
        if now - self.last <= self._patience:
            self._pauses.clear()
        elif self.received:
            self._pauses.append(now - self.last)
        self.received += 1
        self.last = now

    def stamped(self, stamp: int) -> None:
        """Take the stamp of the message that has just arrived [ns]; one that is not set is none."""
        if stamp > 0:
            self.first = stamp if self.first is None else self.first
            self.stamps.add(stamp, self.last)

    def status(self, node: str, now: float) -> Status:
        """Return what happened since the last look."""
        then, received, refused, others = self._before
        span = max(now - then, 1e-9)
        n, bad = self.received - received, self.refused - refused
        rate = n / span
        level, message = self._judge(now, n, bad, rate, self.others - others)
        if n > bad:
            self._rates.append(rate)
        self._before = (now, self.received, self.refused, self.others)
        values = {
            'received': self.received,
            'refused': self.refused,
            'lost': self.lost,
            'rate_hz': round(rate, 1),
            'publishers': self.publishers,
            'age_s': round(now - self.last, 3) if self.received else 'never',
            'last_reason': self.last_reason,
        }
        return Status(f'{node}: {self.topic}', level, message, values)

    def silent(self, now: float) -> float:
        """Return for how long an input has been silent that was not before [s]; 0 where it is not."""
        usual = sorted(self._rates)[len(self._rates) // 2] if self._rates else 0.0
        silent = now - self.last
        slow = 2.0 * min(self._pauses) if len(self._pauses) == SLOW else 0.0
        most = max(self._patience, 5.0 / usual if usual else 0.0, slow)
        return silent if self.received and silent > most else 0.0

    def _judge(self, now: float, n: int, bad: int, rate: float, others: int) -> tuple[int, str]:
        usual = sorted(self._rates)[len(self._rates) // 2] if self._rates else 0.0
        silent = self.silent(now)
        if not self.received:
            return (STALE, 'nothing received yet') if self._required else (OK, 'not in use')
        if silent:
            return STALE, f'silent for {silent:.1f} s'
        if bad:
            level = ERROR if bad == n else WARN
            return level, f'{bad} of {n} refused: {self.last_reason}'
        if n > 1 and others == n:
            return WARN, f'none of {n} is about the joints of this robot'
        if self.publishers > 1 and not others:
            return WARN, f'{self.publishers} publishers send the same'
        beats = isfinite(self._patience) and len(self._rates) >= 3 and n
        if beats and not usual / RATE_CHANGE <= rate <= usual * RATE_CHANGE:
            return WARN, f'{rate:.0f}/s where {usual:.0f}/s is usual'
        return OK, f'{rate:.0f}/s'


class Health:
    """The inputs of a node and what else to report about it."""

    def __init__(self, node: str, patience: float) -> None:
        self._node = node
        self._patience = patience
        self.inputs: dict[str, Input] = {}
        self.outputs: list[Output] = []
        self.lasting: dict[str, str] = {}
        self.remarks: list[str] = []
        self.running = 'running'
        """What a node says of itself while nothing else is to be reported."""
        self.fault = ''
        """What makes the work of the node worthless as long as it lasts; empty for nothing."""
        self._run = time.time_ns()
        self.hardware_id = ''
        self._said: list[str] = []
        self._said_in_all = 0

    def watch(self, topic: str, *, required: bool, steady: bool = True) -> Input:
        """Return a new input; silence of one that is not steady means nothing."""
        self.inputs[topic] = Input(topic, required, self._patience if steady else inf)
        return self.inputs[topic]

    def say(self, sentence: str) -> None:
        """Tell something once."""
        self._said.append(sentence)
        self._said_in_all += 1

    def statuses(self) -> list[Status]:
        """Return the node itself and each of its inputs, since the last call."""
        now = time.monotonic()
        every = [*filter(None, [self.fault]), *self.lasting.values(), *self._said[-3:]]
        warnings = list(dict.fromkeys(every))  # what begins to last is said, too
        own = Status(
            self._node,
            ERROR if self.fault else WARN if warnings else OK,
            '; '.join(warnings) or self.running,
            {
                'inputs': len(self.inputs),
                'told': self._said_in_all,
                **{f'remark_{k}': sentence for k, sentence in enumerate(self.remarks)},
                SENT: json.dumps({each.topic: each.sent for each in self.outputs}),
                REACHED: json.dumps(
                    {each.topic: each.get_subscription_count() for each in self.outputs}
                ),
                HEARD: json.dumps(
                    {name: [item.matched, item.received] for name, item in self.inputs.items()}
                ),
                RUN: self._run,
                NODE: self._node,
            },
        )
        self._said.clear()
        all_of_it = [own, *(item.status(self._node, now) for item in self.inputs.values())]
        return [status._replace(hardware_id=self.hardware_id) for status in all_of_it]
