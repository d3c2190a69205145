# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recorder: what topics carry, as a bag with its provenance, and what it lacks."""

import json
import time
from collections.abc import Callable, Collection, Sequence
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from rclpy.exceptions import InvalidTopicNameException
from rclpy.validate_topic_name import validate_topic_name
from std_srvs.srv import Trigger

from weld_twin_core import __version__
from weld_twin_core.errors import DataError, TwinError
from weld_twin_msgs_py.bags import BackgroundBag, GrowingBag
from weld_twin_msgs_py.bags.needed import COMPLETENESS
from weld_twin_msgs_py.messages.cdr import decoder
from weld_twin_msgs_py.messages.topics import ROBOT_DESCRIPTION, TOPICS

from .cell_node import CellNode
from .managed_node import ManagedNode
from .recorded import (
    AT_START,
    AskedNodes,
    RecordedTopic,
    SentBook,
    Shortfall,
    offered_channel,
    shortfall,
)
from .run_node import run
from .settings import Setting
from .source import full_names, named
from .words import Sent

_TEXT = decoder(ROBOT_DESCRIPTION.type)
LOOK_EVERY = 0.2
"""Seconds between two looks for new topics."""
DRAIN_EVERY = 0.05
"""Seconds between two looks at whether an ending recorder has everything."""
COUNTED_WITHIN = 2.0
"""
Seconds an ending recorder waits for the publishers' last counts. Each tells once a second; one that
takes longer stands still, and an end may take three seconds in all.
"""
ARRIVED_WITHIN = 4.0
"""
Seconds without a message after which what is still missing will not come. Fast DDS tells every 3 s
what it has sent, and a reader that lacks some of it asks for it then. Of a node that stands still,
or has ended, nothing will.
"""
FLOWS_WITHIN = 1.0
"""
Seconds without a message after which nothing more comes of a node that does not tell of itself. A
recorder that stood still itself has heard of nobody for a while, and yet has much to take in.
"""
LONGEST = 9.0
"""Seconds in all; `ros2 launch` kills what has not ended ten seconds after Ctrl-C."""


class RecordingRun:
    """
    Writes messages as they arrive, unread, until it is ended; then, or when it cannot, ``done``.

    joins: it begins at a moment of its own: what was sent before is none of it.
    """

    def __init__(self, node: CellNode, done: Callable[[], None], *, joins: bool = False) -> None:
        self._node, self._done, self._joins = node, done, joins
        self.out: str = node.setting('out')
        self._bag = BackgroundBag(
            GrowingBag(
                self.out,
                storage=node.setting('storage'),
                split_bytes=int(node.setting('split_size') * 1e6),
                split_ns=int(node.setting('split_duration') * 1e9),
                provenance={'version': __version__},
            ),
            flush_every=node.setting('flush_every'),
            most_bytes=int(node.setting('buffer') * 1e6),
        )
        self._asked = AskedNodes(node, self._bag.note)
        self._book = SentBook()
        self._publishers: set[str] = set()
        self._ending_since: float | None = None
        self._moved = 0.0
        self._lacked: dict[str, int] = {}
        self._concluded = False
        given = {node.resolve_topic_name(name): name for name in node.setting('topics')}
        self._topics = {
            name: RecordedTopic(node, each, self._write) for name, each in given.items()
        }
        node.neighbours.hear(self._book.take)
        self._timers = [node.every(LOOK_EVERY, self._look)]
        node.get_logger().info(
            f'recording into {self.out}: '
            + ', '.join(
                name if topic.source.kind else f'{name} when it appears'
                for name, topic in self._topics.items()
            )
        )

    # Taking in -------------------------------------------------------------------------------

    def _look(self) -> None:
        """Follow what appears on the graph; end when nothing can be written any more."""
        for topic in self._topics.values():
            topic.source.adapt()
        self._meet()
        if self._bag.failure is not None:
            self._done()

    def _write(self, topic: RecordedTopic, kind: str, data: bytes) -> None:
        if topic.announced != kind:
            topic.announced = kind
            self._bag.announce(offered_channel(topic.name, kind, topic.source.publishers()))
        taken = self._bag.put(topic.name, kind, data, self._node.get_clock().now().nanoseconds)
        if not taken and self._bag.failure is None:
            self._node.refuse(topic.name, 'the disk does not keep up, messages are dropped')
        if topic.name.endswith(ROBOT_DESCRIPTION.name) and kind == ROBOT_DESCRIPTION.type:
            self._asked.describe(_TEXT(data).data)

    def counts(self) -> dict[str, Any]:
        """Return the messages written by topic, those dropped, and who said how many were sent."""
        written, dropped = self._bag.counts()
        counts = {topic: written.get(topic, 0) for topic in self._topics}
        return {**counts, 'dropped': dropped, 'told_by': sorted(self._book.nodes() & self._meet())}

    # Ending ----------------------------------------------------------------------------------

    def end(self) -> None:
        """Begin to take in what is under way; `done` is called when all of it is there."""
        if self._ending_since is None:
            self._ending_since = self._moved = time.monotonic()
            self._timers.append(self._node.every(DRAIN_EVERY, self._complete))
            self._complete()

    def _complete(self) -> None:
        """Conclude once everything that was sent is there, or will not come any more."""
        if self._concluded:
            if self._bag.end():  # the node serves all else while the disk takes the rest
                self._done()
            return
        if self._ending_since is None:
            return
        now = time.monotonic()
        for topic in self._topics.values():
            topic.source.take_waiting()
        lacking = {name: short.recorded for name, short in self._shortfalls().items()}
        if lacking != self._lacked:
            self._lacked, self._moved = lacking, now
        since = now - self._ending_since
        untold = self._untold() and since < COUNTED_WITHIN
        within = ARRIVED_WITHIN if self._still_sent(lacking) else FLOWS_WITHIN
        coming = lacking and now - self._moved < within
        if not (untold or coming) or since > LONGEST or self._bag.failure is not None:
            self._conclude()

    def _still_sent(self, lacking: Collection[str]) -> bool:
        """Return whether a node that sent what is lacking goes on telling of itself."""
        alive = self._node.neighbours.alive()
        return any(self._book.tellers(topic) & alive for topic in lacking)

    def _untold(self) -> list[str]:
        """Return the nodes recorded here that have not said what they sent since the end."""
        there = self._meet()
        silent = self._book.silent_since(self._ending_since or time.monotonic())
        return [node for node in silent if node in there]

    def _meet(self) -> set[str]:
        """Return who publishes what is recorded, and take note of them."""
        sources = [topic.source for topic in self._topics.values()]
        there = {name for source in sources for name in full_names(source.publishers())}
        self._publishers |= there
        for node in there:
            self._book.meet(node, time.monotonic())
        return there

    def _shortfalls(self) -> dict[str, Shortfall]:
        _, dropped = self._bag.counts()
        out = {}
        for name, topic in self._topics.items():
            count, first, last = topic.taken
            result = shortfall(
                self._book.sent(name), Sent(count - dropped.get(name, 0), first, last)
            )
            if result is not None and not (self._joins and result.where == AT_START):
                out[name] = result
        return out

    def _conclude(self) -> None:
        """Note what every publisher sent and what is missing of it, and say so."""
        self._concluded = True
        lacking = self._shortfalls()
        counts: dict[str, Any] = {}
        untold = set(self._untold()) if self._ending_since is not None else set[str]()
        for name, topic in self._topics.items():
            sent = self._book.sent(name)
            if name in lacking:
                counts[name] = lacking[name].to_mapping()
            elif self._book.tellers(name) & untold:
                continue  # what was told last is from before the end
            elif sent is not None and 0 < sent.number <= topic.taken.number:
                counts[name] = {'sent': sent.number, 'recorded': sent.number, 'missing': 0}
        self._bag.note(COMPLETENESS, counts)
        sentences = [short.sentence(name) for name, short in lacking.items()]
        unknown = [name for name, topic in self._topics.items() if not topic.source.kind]
        sentences += [f'{name}: nobody published this topic' for name in unknown]
        silent = {*self._book.silent_nodes(), *untold}
        sentences += [f'{named(node)} has not told what it sent' for node in sorted(silent)]
        if not self._joins:
            sentences += self._book.unheard(self._publishers)
        for k, sentence in enumerate(sentences):
            self._node.keep(f'incomplete {k}', sentence)
        if counts and not lacking and not untold:
            total = sum(row['sent'] for row in counts.values())
            self._node.get_logger().info(f'all {total:,} messages that were sent are in the bag')

    def close(self) -> None:
        """Complete the bag and stop listening."""
        for timer in self._timers:
            self._node.destroy_timer(timer)
        if not self._concluded:
            for topic in self._topics.values():
                topic.source.take_waiting()
            self._conclude()
        self._asked.close()
        self._node.neighbours.hear_no_more(self._book.take)
        self._node.stop_listening(*(topic.source for topic in self._topics.values()))
        self._bag.close()


class Recorder(ManagedNode):
    """
    Writes messages as they arrive, unread; the bag appears under its name when complete.

    Until then it grows in ``OUT.unfinished``, where a kill or a power cut leaves all but the last
    moment of it. Told to end, it takes in what has reached the process, hears from every
    publisher of the project how many messages it sent, and says what is missing. A managed one
    records while it is active; ``out`` may be set anew while it is not.
    """

    settings: ClassVar[tuple[Setting, ...]] = (
        *ManagedNode.settings,
        Setting('out', '', 'path of the bag to write; must not exist', live=True),
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
        self._run: RecordingRun | None = None
        self._ending = False
        self._wound_down: Callable[[], None] | None = None
        self.create_service(Trigger, '~/counts', self._tell)
        self.start()

    def own_topics(self) -> Sequence[str]:
        """Return what it is asked to record."""
        topics: list[str] = self.setting('topics')
        for name in topics:
            try:
                validate_topic_name(name)
            except InvalidTopicNameException as error:
                said = str(error).splitlines()[0].removeprefix('Invalid topic name: ')
                raise DataError(f"topics: '{name}' is no name of a topic: {said}") from None
        return topics

    def prepare(self) -> None:
        """Refuse a path that cannot become a bag."""
        out = self.setting('out')
        if not out:
            raise DataError("the recorder needs the parameter 'out', the path of the bag")
        if Path(out).exists():
            raise DataError(f"'{out}' exists already; a recorder replaces nothing: set out anew")

    def begin(self) -> None:
        """Begin a bag."""
        self.prepare()
        self._run = RecordingRun(self, self._done, joins=self.managed)

    def wind_down(self, done: Callable[[], None]) -> None:
        """Take in what is under way."""
        if self._run is None:
            done()
            return
        self._wound_down = done
        self._run.end()

    def finish(self) -> None:
        """Complete the bag before anything else happens."""
        self._close()

    def complete(self) -> bool:
        """Begin to take in what is under way; the node is finished when it is there."""
        self._ending = True
        if self._run is not None:
            self._run.end()
        return self._run is None

    def destroy_node(self) -> None:
        """Complete the bag."""
        try:
            self._close()
        except TwinError as error:
            self.failure = error
        super().destroy_node()

    def _done(self) -> None:
        """Go on with the transition that waits for it, or end the program."""
        waiting, self._wound_down = self._wound_down, None
        if waiting is not None:
            waiting()
        if self._ending or not self.managed:
            self.finished = True

    def _close(self) -> None:
        run, self._run = self._run, None
        if run is not None:
            run.close()

    def why_not(self, name: str, value: Any) -> str:
        """Return that a bag is under way."""
        if name != 'out' or self._run is None:
            return ''
        return f"'{self._run.out}' is being recorded; a bag keeps its name"

    def _tell(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Answer with the messages written by topic, and those dropped."""
        counts = {} if self._run is None else self._run.counts()
        response.success = not counts.get('dropped')
        response.message = json.dumps(counts)
        return response


main = partial(run, Recorder)


if __name__ == '__main__':
    raise SystemExit(main())
