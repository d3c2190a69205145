# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Hayati's turn about y, for axes that are nearly parallel (IEEE CDC 1983)."""

from dataclasses import dataclass

from .constant import ChannelError
from .registry import register
from .view import Parameter, Stage, Value


@register
@dataclass(frozen=True, eq=False)
class AxisParallelism(ChannelError):
    """The tilt that alpha cannot express where two axes are nearly parallel."""

    joint: str
    dbeta: Value = 0.0

    name = 'axis_parallelism'
    everywhere = True
    depends_on = 'constant'
    of = 'link'
    stage = Stage.LINK
    channel = 'beta'
    off = 'the axes are out of parallel by'
    parameters = (Parameter('dbeta', 'rad', typical=5e-4),)
