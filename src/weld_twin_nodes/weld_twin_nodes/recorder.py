# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recorder: what the topics of the table carry, as a bag with its provenance."""

from __future__ import annotations

import json
from functools import partial
from typing import Any

from rcl_interfaces.msg import ParameterEvent
from rclpy.parameter_client import AsyncParameterClient
from rclpy.task import Future
from std_srvs.srv import Trigger

from weld_twin_core import __version__
from weld_twin_core.errors import DataError, TwinError
from weld_twin_msgs_py.bags import BagWriter
from weld_twin_msgs_py.robots import load_robot
from weld_twin_msgs_py.topics import BY_NAME, TOPICS

from .cell_node import CellNode
from .models import build_twin
from .running import run
from .settings import Setting

ASKED = {'error_injector': 'effects', 'forward_kinematics_twin': 'twin_effects'}
"""Nodes whose parameters tell how the bag came about, and where their effects are noted."""
QUESTIONS = ['robot', 'base_link', 'tip_link', 'model', 'effects']
ASK_EVERY = 0.2


class Recorder(CellNode):
    """Writes messages as they arrive, unread; the bag appears under its name when complete."""

    settings = (
        Setting('out', '', 'path of the bag to write; must not exist'),
        Setting('storage', 'mcap', 'mcap or sqlite3'),
        Setting('topics', [topic.name for topic in TOPICS], 'what to record'),
        Setting('flush_every', 1.0, 'longest time a message is only in memory [s]', 0.05, 60.0),
    )

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('recorder', **kwargs)
        if not self.setting('out'):
            raise DataError("the recorder needs the parameter 'out', the path of the bag")
        unknown = [name for name in self.setting('topics') if name not in BY_NAME]
        if unknown:
            raise DataError(f'cannot record {unknown[0]!r}; topics are {", ".join(BY_NAME)}')
        self._writer = BagWriter(
            self.setting('out'), storage=self.setting('storage'),
            provenance={'version': __version__},
        ).open()  # fmt: skip
        self._counts = dict.fromkeys(self.setting('topics'), 0)
        for name in self._counts:
            topic = BY_NAME[name]
            self.listen(topic, partial(self._write, topic.name, topic.type), raw=True)
        self.create_timer(self.setting('flush_every'), self._writer.flush)
        self._unasked = {name: AsyncParameterClient(self, name) for name in ASKED}
        self._changes: list[dict[str, Any]] = []
        self.create_subscription(ParameterEvent, '/parameter_events', self._changed, 10)
        self.create_service(Trigger, '~/counts', self._tell)
        self._asking = self.create_timer(ASK_EVERY, self._ask)

    def destroy_node(self) -> None:
        """Complete the bag."""
        self._writer.close()
        super().destroy_node()

    def _write(self, topic: str, kind: str, data: bytes) -> None:
        self._writer.write_cdr(topic, kind, data, self.get_clock().now().nanoseconds)
        self._counts[topic] += 1

    def _tell(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = True
        response.message = json.dumps(self._counts)
        return response

    def _ask(self) -> None:
        for name, client in list(self._unasked.items()):
            if client.services_are_ready():
                del self._unasked[name]
                asked = QUESTIONS + (['seed'] if name == 'error_injector' else [])
                client.get_parameters(asked).add_done_callback(partial(self._told, name))
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
        self._writer.note('robot', robot.to_mapping())
        self._writer.note(ASKED[name], [effect.to_mapping() for effect in effects])
        if name == 'error_injector':
            self._writer.note('seed', answer.result().values[5].integer_value)

    def _changed(self, event: ParameterEvent) -> None:
        """Note effects that change while recording, with the time they did."""
        node = event.node.rpartition('/')[2]
        for parameter in event.changed_parameters:
            if node in ASKED and parameter.name == 'effects':
                now = self.get_clock().now().nanoseconds
                self._changes.append({
                    'node': node, 'log_ns': now, 'effects': parameter.value.string_value,
                })  # fmt: skip
                self._writer.note('effects_changes', self._changes)


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return run(Recorder, args)


if __name__ == '__main__':
    raise SystemExit(main())
