# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Link offset: d -> d + dd."""

from dataclasses import dataclass

from .constant import URS, ChannelError
from .registry import register
from .view import Parameter, Plausible, Stage, Value


@register
@dataclass(frozen=True, eq=False)
class LinkOffset(ChannelError):
    """A wrong offset along the axis of one DH row."""

    joint: str
    dd: Value = 0.0

    name = 'link_offset'
    title = 'link offset error'
    entered = 'model'
    everywhere = True
    depends_on = 'constant'
    of = 'link'
    stage = Stage.LINK
    channel = 'd'
    parameters = (
        Parameter(
            'dd',
            'm',
            typical=2e-4,
            range=Plausible.even(
                5e-4,
                1e-2,
                f'{URS}: 0.09 to 0.32 mm; range derived: beyond a centimetre it is another arm',
            ),
        ),
    )
