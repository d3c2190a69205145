# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recorder: what the topics of the table carry, as a bag with its provenance."""

from __future__ import annotations

import json
from functools import partial
from typing import Any, ClassVar

from rcl_interfaces.msg import ParameterEvent
from rcl_interfaces.srv import GetParameters
from rclpy.task import Future
from std_srvs.srv import Trigger

from weld_twin_core import __version__
from weld_twin_core.errors import DataError, TwinError
from weld_twin_msgs_py.bags import BackgroundBag, GrowingBag
from weld_twin_msgs_py.messages.topics import BY_NAME, TOPICS
from weld_twin_msgs_py.robots import load_robot

from ..offline.told_twin import build_twin
from .cell_node import CellNode
from .run_node import run
from .settings import Setting

ASKED = {'error_injector': 'effects', 'forward_kinematics_twin': 'twin_effects'}
"""Nodes whose parameters tell how the bag came about, and where their effects are noted."""
QUESTIONS = ['robot', 'base_link', 'tip_link', 'model', 'effects']
ASK_EVERY = 0.2
LOOK_EVERY = 0.2


class Recorder(CellNode):
    """
    Writes messages as they arrive, unread; the bag appears under its name when complete.

    Until then it grows in ``OUT.unfinished``, where a kill or a power cut leaves all but the last
    moment of it.
    """

    settings: ClassVar[tuple[Setting, ...]] = (
        Setting('out', '', 'path of the bag to write; must not exist'),
        Setting('storage', 'mcap', 'mcap or sqlite3'),
        Setting('topics', [topic.name for topic in TOPICS], 'what to record'),
        Setting('flush_every', 0.25, 'longest time a message is only in memory [s]', 0.05, 60.0),
        Setting('split_size', 1024.0, 'size of a file of the bag, 0 is any [MB]', 0.0, 1e6),
        Setting('split_duration', 3600.0, 'time a file of the bag spans, 0 is any [s]', 0.0, 1e7),
        Setting('buffer', 64.0, 'memory for messages a slow disk keeps waiting [MB]', 0.01, 1e4),
    )

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('recorder', **kwargs)
        if not self.setting('out'):
            raise DataError("the recorder needs the parameter 'out', the path of the bag")
        unknown = [name for name in self.setting('topics') if name not in BY_NAME]
        if unknown:
            raise DataError(f'cannot record {unknown[0]!r}; topics are {", ".join(BY_NAME)}')
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
        for name in self.setting('topics'):
            topic = BY_NAME[name]
            self.listen(topic, partial(self._write, topic.name, topic.type), raw=True)
        self.every(LOOK_EVERY, self._look)
        self._unasked = {
            name: self.create_client(GetParameters, f'/{name}/get_parameters') for name in ASKED
        }
        self._changes: list[dict[str, Any]] = []
        self.create_subscription(ParameterEvent, '/parameter_events', self._changed, 10)
        self.create_service(Trigger, '~/counts', self._tell)
        self._asking = self.every(ASK_EVERY, self._ask)

    def destroy_node(self) -> None:
        """Complete the bag."""
        try:
            self._bag.close()
        except TwinError as error:
            self.failure = error
        super().destroy_node()

    def _write(self, topic: str, kind: str, data: bytes) -> None:
        taken = self._bag.put(topic, kind, data, self.get_clock().now().nanoseconds)
        if not taken and self._bag.failure is None:
            self.refuse(topic, 'the disk does not keep up, messages are dropped')

    def _tell(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Answer with the messages written by topic, and those dropped."""
        written, dropped = self._bag.counts()
        counts = {topic: written.get(topic, 0) for topic in self.setting('topics')}
        response.success = not dropped
        response.message = json.dumps({**counts, 'dropped': dropped})
        return response

    def _look(self) -> None:
        """End the node when nothing can be written any more."""
        self.finished = self.finished or self._bag.failure is not None

    def _ask(self) -> None:
        for name, client in list(self._unasked.items()):
            if client.service_is_ready():
                del self._unasked[name]
                asked = QUESTIONS + (['seed'] if name == 'error_injector' else [])
                question = GetParameters.Request(names=asked)
                client.call_async(question).add_done_callback(partial(self._told, name))
        if not self._unasked:
            self._asking.cancel()

    def _told(self, name: str, answer: Future) -> None:
        """Note the robot, the effects and the seed of another node."""
        robot_name, base, tip, model, text = [v.string_value for v in answer.result().values[:5]]
        try:
            robot = load_robot(robot_name, base or None, tip or None)
            effects = build_twin(robot, model, text).effects
        except TwinError as error:
            self.refuse(name, str(error))
            return
        self._bag.note('robot', robot.to_mapping())
        self._bag.note(ASKED[name], [effect.to_mapping() for effect in effects])
        if name == 'error_injector':
            self._bag.note('seed', answer.result().values[5].integer_value)

    def _changed(self, event: ParameterEvent) -> None:
        """Note effects that change while recording, with the time they did."""
        node = event.node.rpartition('/')[2]
        for parameter in event.changed_parameters:
            if node in ASKED and parameter.name == 'effects':
                now = self.get_clock().now().nanoseconds
                self._changes.append(
                    {
                        'node': node,
                        'log_ns': now,
                        'effects': parameter.value.string_value,
                    }
                )
                self._bag.note('effects_changes', self._changes)


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return run(Recorder, args)


if __name__ == '__main__':
    raise SystemExit(main())
