# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of a node: declared once, with unit and range, in a table at the top of its file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor

NO_NUMBERS = ''
"""
Default of a list of numbers that is not set. ROS has no empty list of numbers: a parameter that is
declared without a value makes `ros2 param dump` fail for the whole node.
"""


@dataclass(frozen=True)
class Setting:
    """One parameter."""

    name: str
    default: Any
    """Also fixes the type, unless ``numbers`` is set."""
    description: str
    """What it is for, with its unit in square brackets."""
    low: float | None = None
    high: float | None = None
    """Range of a number, ends included."""
    live: bool = False
    """May be changed while the node runs."""
    numbers: bool = False
    """It is a list of numbers; `NO_NUMBERS` where it is not set."""
    choices: tuple[str, ...] = ()
    """What it may be; empty for anything."""

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
