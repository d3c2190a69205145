# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Instrument knock: the instrument, or the base of the robot, stands elsewhere from an instant on."""

from __future__ import annotations

from dataclasses import dataclass

from .registry import register
from .sudden import SuddenFrame
from .view import Value


@register
@dataclass(frozen=True, eq=False)
class InstrumentKnock(SuddenFrame):
    """The base is displaced by xyz in the world and turned by rotvec from ``time`` [s] on."""

    xyz: Value = (0.0, 0.0, 0.0)
    rotvec: Value = (0.0, 0.0, 0.0)
    time: float = 0.0

    name = 'instrument_knock'
    title = 'knocked instrument or base'
    entered = 'the instrument or the base was knocked'
    place = 'instrument'
    of_setup = True
    channel = 'base'
