# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Link length: a -> a + da (paper, eq. II.iii.b)."""

from dataclasses import dataclass

from .constant import ChannelError
from .registry import register
from .view import Parameter, Stage, Value


@register
@dataclass(frozen=True, eq=False)
class LinkLength(ChannelError):
    """A wrong length of the common normal of one DH row."""

    joint: str
    da: Value = 0.0

    name = 'link_length'
    title = 'link length error'
    entered = 'model'
    changes_in_use = True
    everywhere = True
    depends_on = 'constant'
    of = 'link'
    stage = Stage.LINK
    channel = 'a'
    parameters = (Parameter('da', 'm', typical=2e-4),)
