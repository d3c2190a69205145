# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Parameters of a node, declared once, in a table at the top of its file; and which nodes there are.

Quality of service comes from a parameter file, as other nodes of ROS 2 take it:
``qos_overrides./joint_states.subscription.reliability: reliable`` and the like.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from difflib import get_close_matches
from importlib import import_module
from inspect import getdoc
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.messages.topics import BEST_EFFORT, LATCHED, RELIABLE, VOLATILE, Qos

PREFIX = 'qos_overrides.'
ROLES = ('publisher', 'subscription')
CHOICES = {'reliability': (RELIABLE, BEST_EFFORT), 'durability': (VOLATILE, LATCHED)}
"""Policies that can be chosen, and what each may be; `depth` is a number from 1."""


class QosOverrides:
    """What the parameters that a node was started with say of its topics, by the names it has."""

    def __init__(self, node: Node, given: Iterable[str], topics: Collection[str]) -> None:
        self._node = node
        self._given = {name for name in given if name.startswith(PREFIX)}
        for name in self._given:
            self._refuse_odd(name, topics)

    def of(self, topic: str, role: str, qos: Qos) -> Qos:
        """Return the quality of service of a publisher or subscription."""
        policies = ('reliability', 'durability', 'depth')
        values = {policy: self._value(topic, role, policy) for policy in policies}
        return replace(qos, **{key: value for key, value in values.items() if value is not None})

    def has(self, topic: str, role: str) -> bool:
        """Return whether anything is said of a topic."""
        return any(name.startswith(f'{PREFIX}{topic}.{role}.') for name in self._given)

    def _value(self, topic: str, role: str, policy: str) -> Any:
        name = f'{PREFIX}{topic}.{role}.{policy}'
        if name not in self._given:
            return None
        if not self._node.has_parameter(name):
            described = ParameterDescriptor(
                description=f'{policy} of the {role}', read_only=True, dynamic_typing=True
            )
            self._node.declare_parameter(name, '', described)
        value = self._node.get_parameter(name).value
        choices = CHOICES.get(policy)
        if choices is None and not (isinstance(value, int) and value > 0):
            raise DataError(f'{name} must be a whole number from 1, got {value!r}')
        if choices is not None and value not in choices:
            raise DataError(f'{name} must be {" or ".join(choices)}, got {value!r}')
        return value

    def _refuse_odd(self, name: str, topics: Collection[str]) -> None:
        topic, role, policy = (*name.removeprefix(PREFIX).rsplit('.', 2), '', '')[:3]
        if role not in ROLES or policy not in (*CHOICES, 'depth'):
            raise DataError(
                f"'{name}' says nothing that can be chosen here: it is "
                f'{PREFIX}TOPIC.ROLE.POLICY, with the roles {" and ".join(ROLES)} and the policies '
                f'{", ".join(CHOICES)} and depth'
            )
        if topic not in topics:
            like = get_close_matches(topic, topics, n=1)
            hint = f"; did you mean '{like[0]}'?" if like else ''
            raise DataError(f"'{name}': no node has a topic '{topic}'{hint}")


NO_NUMBERS = ''
"""
Default of a list of numbers that is not set. ROS has no empty list of numbers: a parameter that is
declared without a value makes `ros2 param dump` fail for the whole node.
"""


@dataclass(frozen=True)
class Setting:
    """One parameter."""

    name: str
    default: Any  # also fixes the type, unless ``numbers`` is set
    description: str  # what it is for, with its unit in square brackets
    low: float | None = None
    high: float | None = None  # range of a number, ends included
    live: bool = False  # may be changed while the node runs
    numbers: bool = False  # it is a list of numbers; `NO_NUMBERS` where it is not set
    choices: tuple[str, ...] = ()  # what it may be; empty for anything

    def odd(self, value: Any) -> str:
        """Return why a value is none that it may be; empty where it is one."""
        if not self.choices or value in self.choices:
            return ''
        return f'{self.name} must be one of {", ".join(self.choices)}, got {value!r}'

    def descriptor(self) -> ParameterDescriptor:
        """Return what `ros2 param describe` shows and rclpy enforces."""
        out = ParameterDescriptor(
            description=self.description, read_only=not self.live, dynamic_typing=self.numbers
        )
        if self.low is None or self.high is None:
            return out
        if isinstance(self.default, float):
            limits = FloatingPointRange(from_value=float(self.low), to_value=float(self.high))
            out.floating_point_range = [limits]
        else:
            limits = IntegerRange(from_value=int(self.low), to_value=int(self.high), step=1)
            out.integer_range = [limits]
        return out


SHARED = (
    Setting(
        'wait_for_subscribers',
        0,
        'take no input before the main outputs have this many subscribers [1]',
        0,
        100,
    ),
    Setting(
        'reliable_inputs',
        False,
        'request reliable delivery; only for inputs whose publishers offer it',
    ),
    Setting(
        'hardware_id',
        '',
        'what the diagnostics call this robot; empty: the namespace and the name of the model',
    ),
    Setting(
        'executor',
        'events',
        "what serves the node's messages: events, the quickest, or single_threaded, for an rclpy "
        'without it; events becomes single_threaded there by itself',
        choices=('events', 'single_threaded'),
    ),
    Setting('stale_after', 1.0, 'silence after which an input counts as stale [s]', 0.05, 3600.0),
)
"""Parameters that every node has."""


MODULES = {
    'trajectory_generator': 'weld_twin_nodes.live.trajectory_generator',
    'error_injector': 'weld_twin_nodes.live.error_injector',
    'forward_kinematics_twin': 'weld_twin_nodes.live.forward_kinematics_twin',
    'deviation_analyzer': 'weld_twin_nodes.live.deviation_analyzer',
    'recorder': 'weld_twin_nodes.live.recorder',
    'live_diagnosis': 'weld_twin_nodes.live.live_diagnosis',
    'deviation_markers': 'weld_twin_nodes.live.deviation_markers',
    'contact_marker': 'weld_twin_nodes.live.contact_marker',
    'compensator': 'weld_twin_nodes.live.compensator',
}
ROS_OWN = ('use_sim_time', 'start_type_description_service')
"""Parameters that every node of ROS 2 takes; so are those of `QosOverrides`."""


def node_class(name: str) -> Any:
    """Return the class of a node by its name, which is that of its file."""
    module = import_module(MODULES[name])
    return next(
        item
        for item in vars(module).values()
        if isinstance(item, type)
        and item.__module__ == module.__name__
        and hasattr(item, 'every_setting')
    )


def refuse_unknown(given: Iterable[str], own: Iterable[str]) -> None:
    """Refuse parameters that no node of this package has: a mistyped one would be passed over."""
    known = {*own, *ROS_OWN}
    odd = [name for name in given if name not in known and not name.startswith(PREFIX)]
    if not odd:
        return
    others = {item.name for name in MODULES for item in node_class(name).every_setting()}
    for name in odd:
        if name in others:
            continue
        like = get_close_matches(name, known, n=1)
        hint = (
            f"; did you mean '{like[0]}'?" if like else f'; there are {", ".join(sorted(known))}'
        )
        raise DataError(f"no parameter is called '{name}'{hint}")


def usage(kind: Any, name: str) -> str:
    """Return what a node does and its parameters, as ``--help`` prints them."""
    lines = [
        f'usage: {name} [--help] [--ros-args -p PARAMETER:=VALUE ... -r FROM:=TO ...]',
        '',
        getdoc(kind) or '',
        '',
        'parameters:',
    ]
    for item in kind.every_setting():
        limits = f', {range_of(item)}' if range_of(item) else ''
        lines.append(f'  {item.name} ({value_of(item)}{limits})')
        lines.append(f'      {item.description}')
    return '\n'.join(lines)


def value_of(item: Setting) -> str:
    """Return the default of a parameter in words."""
    if isinstance(item.default, bool):
        return str(item.default).lower()
    if isinstance(item.default, list):
        return '[' + ', '.join(str(value) for value in item.default) + ']'
    if item.numbers:
        return 'not set'
    return repr(item.default) if isinstance(item.default, str) else f'{item.default:g}'


def range_of(item: Setting) -> str:
    """Return the range of a parameter in words, empty where it has none."""
    if item.low is None or item.high is None:
        return ''
    return f'{item.low:g} to {item.high:g}'
