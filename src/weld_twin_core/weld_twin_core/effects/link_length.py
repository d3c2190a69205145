# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Link length: a -> a + da (paper, eq. II.iii.b)."""

from dataclasses import dataclass

from .constant import URS, ChannelError
from .registry import register
from .view import Parameter, Plausible, Stage, Value


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
    parameters = (
        Parameter(
            'da',
            'm',
            typical=2e-4,
            range=Plausible.even(
                5e-4,
                1e-2,
                f'{URS}: 0.02 to 0.28 mm; range derived: beyond a centimetre it is another arm',
            ),
        ),
    )
