# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The mix of cases that belief is learned from, and that its bounds hold for.

Robots, kinds of causes, their sizes and the kinds of motion are those of the blind check, with a
quarter of the cases outside the library or withheld from it; a third of the motions is poor.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..blind.ambiguous import CONSTRUCTIONS
from ..blind.deck import KINDS, Deck, Lot, lots
from ..blind.making import SealedCase, draw_case
from ..blind.poor_motion import WAYS

SHARES = {**KINDS, 'outside': 6, 'withheld': 6}
"""Of 44 cases, how many are of each kind."""
POOR = ('', '', '', '', '', '', '', '', *WAYS)
"""How motions are made poor: one in three; 'few' changes stations alone."""
SPANS = (15.0, 45.0)
"""Length [s] of a recording, drawn between these."""


class Drawn(NamedTuple):
    """A case, and how its motion was made poor."""

    case: SealedCase
    poor: str


def drawn(seed: int, number: int) -> Drawn:
    """
    Return case ``number`` of a seed; it depends on nothing else.

    Raises DataError: no cell and motion show such causes.
    """
    lot = mixed(seed, number + 1)[number]
    ways = Deck(POOR, seed, 60)
    poor = [ways.next() for _ in range(number + 1)][number]
    if 'equal lag' in lot.families or (poor == 'few' and lot.motion != 'stations'):
        poor = ''
    rng = np.random.default_rng([seed, 2000 + number])
    return Drawn(draw_case(lot, rng, SPANS, poor), poor)


def mixed(seed: int, count: int) -> list[Lot]:
    """Return what the first cases of a seed are to be, in the shares of the mix."""
    return lots(seed, count, constructions=tuple(CONSTRUCTIONS), shares=SHARES)
