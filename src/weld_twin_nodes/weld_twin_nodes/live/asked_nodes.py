# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How a recording came about: robot, effects and seed, asked of the nodes beside the recorder."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from rcl_interfaces.msg import ParameterEvent
from rcl_interfaces.srv import GetParameters
from rclpy.task import Future

from weld_twin_core.arm.robot import Robot
from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.robots import load_robot, parse_urdf

from ..offline.given_twin import build_twin
from .cell_node import CellNode
from .robot_settings import names_topic

ASKED = {'error_injector': 'effects', 'forward_kinematics_twin': 'twin_effects'}
"""Nodes whose parameters tell how the bag came about, and where their effects are noted."""
QUESTIONS = ['robot', 'base_link', 'tip_link', 'model', 'effects']
ASK_EVERY = 0.2
"""Seconds between two looks for nodes that have not answered yet."""


class AskedNodes:
    """Notes what the nodes of the recorder's own namespace say of themselves."""

    def __init__(self, node: CellNode, note: Callable[[str, Any], None]) -> None:
        self._node, self._note = node, note
        self._unasked = {
            name: node.create_client(GetParameters, f'{name}/get_parameters') for name in ASKED
        }
        self._changes: list[dict[str, Any]] = []
        self._description = ''
        self._waiting: list[tuple[str, list[Any]]] = []
        self._robot_known = False
        self._clients = [*self._unasked.values()]
        self._events = node.create_subscription(
            ParameterEvent, '/parameter_events', self._changed, 10
        )
        self._asking = node.every(ASK_EVERY, self._ask)

    def close(self) -> None:
        """Ask and listen no more."""
        self._unasked.clear()  # a look may be waiting in the executor already
        self._node.destroy_timer(self._asking)
        self._node.destroy_subscription(self._events)
        for client in self._clients:
            self._node.destroy_client(client)

    def describe(self, urdf: str) -> None:
        """Take the robot that robot_state_publisher tells; a node's own word counts more."""
        self._description = urdf
        waiting, self._waiting = self._waiting, []
        for name, values in waiting:
            self._take(name, values)
        if not self._robot_known:
            try:
                self._note('robot', parse_urdf(urdf, 'robot_description').to_mapping())
            except TwinError as error:
                self._node.get_logger().info(f'no robot is noted from robot_description: {error}')

    def _ask(self) -> None:
        for name, client in list(self._unasked.items()):
            if client.service_is_ready():
                del self._unasked[name]
                asked = QUESTIONS + (['seed'] if name == 'error_injector' else [])
                question = GetParameters.Request(names=asked)
                client.call_async(question).add_done_callback(partial(self._answered, name))
        if not self._unasked:
            self._node.destroy_timer(self._asking)

    def _answered(self, name: str, answer: Future) -> None:
        self._take(name, answer.result().values)

    def _take(self, name: str, values: list[Any]) -> None:
        robot_name, base, tip, model, text = [value.string_value for value in values[:5]]
        if names_topic(robot_name) and not self._description:
            self._waiting.append((name, values))
            return
        try:
            robot = self._robot(robot_name, base or None, tip or None)
            effects = build_twin(robot, model, text).effects
        except TwinError as error:
            self._node.refuse(name, str(error))
            return
        self._robot_known = True
        self._note('robot', robot.to_mapping())
        self._note(ASKED[name], [effect.to_mapping() for effect in effects])
        if name == 'error_injector':
            self._note('seed', values[5].integer_value)

    def _robot(self, name: str, base: str | None, tip: str | None) -> Robot:
        if names_topic(name):
            return parse_urdf(self._description, 'robot_description', base, tip)
        return load_robot(name, base, tip)

    def _changed(self, event: ParameterEvent) -> None:
        """Note effects that change while recording, with the time they did."""
        space, _, node = event.node.rpartition('/')
        if node not in ASKED or space != self._node.get_namespace().rstrip('/'):
            return
        for parameter in event.changed_parameters:
            if parameter.name == 'effects':
                now = self._node.get_clock().now().nanoseconds
                text = parameter.value.string_value
                self._changes.append({'node': node, 'log_ns': now, 'effects': text})
                self._note('effects_changes', self._changes)
