# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Link twist: alpha -> alpha + dalpha (paper, eq. II.iii.c)."""

from dataclasses import dataclass

from .constant import ChannelError
from .registry import register
from .view import Parameter, Stage, Value


@register
@dataclass(frozen=True, eq=False)
class LinkTwist(ChannelError):
    """A wrong angle between the axes of one DH row."""

    joint: str
    dalpha: Value = 0.0

    name = 'link_twist'
    everywhere = True
    depends_on = 'constant'
    of = 'link'
    stage = Stage.LINK
    channel = 'alpha'
    off = 'the axes are twisted by'
    parameters = (Parameter('dalpha', 'rad', typical=5e-4),)
