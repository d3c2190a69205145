# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recorder: what topics carry, as a bag with its provenance, and what it lacks."""

from __future__ import annotations

import json
import time
from typing import Any, ClassVar

from std_srvs.srv import Trigger

from weld_twin_core import __version__
from weld_twin_core.errors import DataError, TwinError
from weld_twin_msgs_py.bags import BackgroundBag, GrowingBag
from weld_twin_msgs_py.bags.ends import COMPLETENESS
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.cdr_read import decoder
from weld_twin_msgs_py.messages.topics import (
    BY_NAME,
    DIAGNOSTICS,
    ROBOT_DESCRIPTION,
    TOPICS,
    Topic,
)

from .asked_nodes import AskedNodes
from .cell_node import CellNode
from .completeness import SentBook, Shortfall, shortfall
from .offered_channel import offered_channel
from .outputs import Sent
from .recorded_topic import RecordedTopic
from .run_node import run
from .settings import Setting

_TEXT = decoder(ROBOT_DESCRIPTION.type)
LOOK_EVERY = 0.2
"""Seconds between two looks for new topics."""
DRAIN_EVERY = 0.05
"""Seconds between two looks at whether an ending recorder has everything."""
TOLD_WITHIN = 5.0
"""
Seconds an ending recorder waits for the publishers' last counts. Each tells once a second; on a
crowded machine some seconds late; one that takes longer hangs.
"""
ARRIVED_WITHIN = 4.0
"""
Seconds without a message after which what is still missing will not come. Fast DDS tells every 3 s
what it has sent, and a reader that lacks some of it asks for it then.
"""
LONGEST = 9.0
"""Seconds in all; `ros2 launch` kills what has not ended ten seconds after Ctrl-C."""


class Recorder(CellNode):
    """
    Writes messages as they arrive, unread; the bag appears under its name when complete.

    Until then it grows in ``OUT.unfinished``, where a kill or a power cut leaves all but the last
    moment of it. Told to end, it takes in what has reached the process, hears from every
    publisher of the project how many messages it sent, and says what is missing.
    """

    settings: ClassVar[tuple[Setting, ...]] = (
        Setting('out', '', 'path of the bag to write; must not exist'),
        Setting('storage', 'mcap', 'mcap or sqlite3'),
        Setting(
            'topics',
            [topic.name.lstrip('/') for topic in (*TOPICS, ROBOT_DESCRIPTION)],
            'what to record, topics of any type; names without a slash are in the namespace',
        ),
        Setting('flush_every', 0.25, 'longest time a message is only in memory [s]', 0.05, 60.0),
        Setting('split_size', 1024.0, 'size of a file of the bag, 0 is any [MB]', 0.0, 1e6),
        Setting('split_duration', 3600.0, 'time a file of the bag spans, 0 is any [s]', 0.0, 1e7),
        Setting('buffer', 64.0, 'memory for messages a slow disk keeps waiting [MB]', 0.01, 1e4),
    )

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('recorder', **kwargs)
        if not self.setting('out'):
            raise DataError("the recorder needs the parameter 'out', the path of the bag")
        self._bag = BackgroundBag(
            GrowingBag(
                self.setting('out'),
                storage=self.setting('storage'),
                split_bytes=int(self.setting('split_size') * 1e6),
                split_ns=int(self.setting('split_duration') * 1e9),
                provenance={'version': __version__},
            ),
            flush_every=self.setting('flush_every'),
            most_bytes=int(self.setting('buffer') * 1e6),
        )
        self._asked = AskedNodes(self, self._bag.note)
        self._book = SentBook()
        self._ending_since: float | None = None
        self._moved = 0.0
        self._lacked: dict[str, int] = {}
        self._concluded = False
        self._topics: dict[str, RecordedTopic] = {}
        self._untyped = {
            self.resolve_topic_name(name): _row(name) for name in self.setting('topics')
        }
        self._subscribe()
        self.create_subscription(
            DIAGNOSTICS.message_class(),
            DIAGNOSTICS.name,
            self._hear,
            DIAGNOSTICS.requested.to_rclpy(),
        )
        self.create_service(Trigger, '~/counts', self._tell)
        self.every(LOOK_EVERY, self._look)
        names = ', '.join([*self._topics, *(f'{name} when it appears' for name in self._untyped)])
        self.get_logger().info(f'recording into {self.setting("out")}: {names}')

    # Taking in -------------------------------------------------------------------------------

    def _look(self) -> None:
        """Follow what appears on the graph; end when nothing can be written any more."""
        self._subscribe()
        for topic in self._topics.values():
            topic.adapt()
        self._meet()
        self.finished = self.finished or self._bag.failure is not None

    def _subscribe(self) -> None:
        """Subscribe to the topics whose type is known by now."""
        present: dict[str, list[str]] = {}
        if any(row is None for row in self._untyped.values()):
            present = dict(self.get_topic_names_and_types())
        for name, row in list(self._untyped.items()):
            kinds = [row.type] if row is not None else present.get(name, [])
            if not kinds:
                continue
            del self._untyped[name]
            try:
                self._topics[name] = RecordedTopic(self, name, kinds[0], row, self._write)
            except ImportError as error:
                sentence = f'{name} is not recorded: {error}'
                self.get_logger().warning(sentence)
                self.health.lasting[f'type of {name}'] = sentence

    def _write(self, topic: RecordedTopic, data: bytes) -> None:
        if not topic.announced:
            topic.announced = True
            self._bag.announce(offered_channel(topic.name, topic.kind, topic.publishers()))
        taken = self._bag.put(topic.name, topic.kind, data, self.get_clock().now().nanoseconds)
        if not taken and self._bag.failure is None:
            self.refuse(topic.name, 'the disk does not keep up, messages are dropped')
        if topic.name.endswith(ROBOT_DESCRIPTION.name) and topic.kind == ROBOT_DESCRIPTION.type:
            self._asked.describe(_TEXT(data).data)

    def _hear(self, message: Any) -> None:
        for values in from_messages.diagnostics(message).values():
            self._book.take(values, time.monotonic())

    def _tell(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Answer with the messages written by topic, and those dropped."""
        written, dropped = self._bag.counts()
        counts = {topic: written.get(topic, 0) for topic in self._topics}
        response.success = not dropped
        response.message = json.dumps({**counts, 'dropped': dropped})
        return response

    # Ending ----------------------------------------------------------------------------------

    def end(self) -> None:
        """Begin to take in what is under way; the node is finished when it is there."""
        if self._ending_since is None:
            self._ending_since = self._moved = time.monotonic()
            self.every(DRAIN_EVERY, self._complete)
            self._complete()

    def _complete(self) -> None:
        """Conclude once everything that was sent is there, or will not come any more."""
        if self._concluded or self._ending_since is None:
            return
        now = time.monotonic()
        for topic in self._topics.values():
            topic.take_waiting()
        lacking = {name: short.recorded for name, short in self._shortfalls().items()}
        if lacking != self._lacked:
            self._lacked, self._moved = lacking, now
        since = now - self._ending_since
        untold = self._untold() and since < TOLD_WITHIN
        coming = lacking and now - self._moved < ARRIVED_WITHIN
        if not (untold or coming) or since > LONGEST or self._bag.failure is not None:
            self._conclude()
            self.finished = True

    def _untold(self) -> list[str]:
        """Return the nodes recorded here that have not told what they sent since the end."""
        there = self._meet()
        silent = self._book.silent_since(self._ending_since or time.monotonic())
        return [node for node in silent if node in there]

    def _meet(self) -> set[str]:
        """Return who publishes what is recorded, and take note of them."""
        there = {name for topic in self._topics.values() for name in topic.publishing_nodes()}
        for node in there:
            self._book.meet(node, time.monotonic())
        return there

    def _shortfalls(self) -> dict[str, Shortfall]:
        _, dropped = self._bag.counts()
        out = {}
        for name, topic in self._topics.items():
            count, first, last = topic.taken
            found = shortfall(
                self._book.sent(name), Sent(count - dropped.get(name, 0), first, last)
            )
            if found is not None:
                out[name] = found
        return out

    def _conclude(self) -> None:
        """Note what every publisher sent and what is missing of it, and say so."""
        self._concluded = True
        lacking = self._shortfalls()
        told: dict[str, Any] = {}
        for name in self._topics:
            sent = self._book.sent(name)
            if name in lacking:
                told[name] = lacking[name].to_mapping()
            elif sent is not None and sent.number:
                told[name] = {'sent': sent.number, 'recorded': sent.number, 'missing': 0}
        self._bag.note(COMPLETENESS, told)
        sentences = [short.sentence(name) for name, short in lacking.items()]
        sentences += [f'{name}: nobody published this topic' for name in self._untyped]
        if self._ending_since is not None:
            sentences += [f'{node} has not told what it sent' for node in self._untold()]
        for k, sentence in enumerate(sentences):
            self.get_logger().warning(sentence)
            self.health.lasting[f'incomplete {k}'] = sentence
        if told and not lacking:
            total = sum(row['sent'] for row in told.values())
            self.get_logger().info(f'all {total:,} messages that were sent are in the bag')

    def destroy_node(self) -> None:
        """Complete the bag."""
        if not self._concluded:
            for topic in self._topics.values():
                topic.take_waiting()
            self._conclude()
        try:
            self._bag.close()
        except TwinError as error:
            self.failure = error
        super().destroy_node()


def _row(name: str) -> Topic | None:
    """Return the row of the table of topics for a name as it was given."""
    return BY_NAME.get('/' + name.lstrip('/'))


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return run(Recorder, args)


if __name__ == '__main__':
    raise SystemExit(main())
