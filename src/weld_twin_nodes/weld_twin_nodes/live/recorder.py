# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recorder: what topics carry, as a bag with its provenance, and what it lacks."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from rclpy.exceptions import InvalidTopicNameException
from rclpy.validate_topic_name import validate_topic_name
from std_srvs.srv import Trigger

from weld_twin_core.errors import DataError, TwinError
from weld_twin_msgs_py.messages.topics import ROBOT_DESCRIPTION, TOPICS

from .managed_node import ManagedNode
from .recording_run import RecordingRun
from .run_node import run
from .settings import Setting


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
        """
        Return what it is told to record.

        Raises DataError: a name is none that a topic can have.
        """
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
"""Run the node with arguments, or with those of the program; return the exit code."""


if __name__ == '__main__':
    raise SystemExit(main())
