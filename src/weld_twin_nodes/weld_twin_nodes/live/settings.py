# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Parameters of a node: declared once, with unit and range, in a table at the top of its file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.parameter import Parameter

NUMBERS = Parameter.Type.DOUBLE_ARRAY
"""Default of a list of numbers that is not set."""


@dataclass(frozen=True)
class Setting:
    """
    One parameter.

    Attributes
    ----------
    name : str
    default : bool, int, float, str, list of str, or `NUMBERS`
        Also fixes the type.
    description : str
        What it is for, with its unit in square brackets.
    low, high : float, optional
        Range of a number, ends included.
    live : bool
        May be changed while the node runs.

    """

    name: str
    default: Any
    description: str
    low: float | None = None
    high: float | None = None
    live: bool = False

    def descriptor(self) -> ParameterDescriptor:
        """Return what `ros2 param describe` shows and rclpy enforces."""
        out = ParameterDescriptor(description=self.description, read_only=not self.live)
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
    Setting('stale_after', 1.0, 'silence after which an input counts as stale [s]', 0.05, 3600.0),
)
"""Parameters that every node has."""
