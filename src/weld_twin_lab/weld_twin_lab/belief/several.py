# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Cells with one to six causes at once, as real cells have them.

Every number of causes is equally often. In a fifth of the cases the family of one cause is taken
out of the library. The plant's statics are true: a spring settles where it balances the load.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..blind.cause_sizes import FAMILIES, MOVING
from ..blind.deck import ROBOTS, Deck, Lot
from ..blind.making import SealedCase, draw_case
from ..blind.poor_motion import poorer
from .mix import SPANS

MOST = 6
"""Causes of a case at the most."""
COMMON = (
    'joint_offset',
    'link_length',
    'link_offset',
    'link_twist',
    'axis_parallelism',
    'backlash',
    'joint_compliance',
    'gear_ratio',
    'transmission_ripple',
)
"""Families that most arms have something of; each comes `OFTEN` times as often as any other."""
OFTEN = 5
"""Cards of a common family in the deck for one of any other. A judgement: most cells have some."""
MOTIONS = ('stations', 'stations', 'seams', 'both')
CROWDED = ('stations', 'both')
"""Motions of cases with five and six causes: stations, 40 at least, that could tell them."""
STRATA = (1, 1, 2, 2, 2, 3)
"""Numbers of the strata of `blind.deck`, dealt like cards: 1 to 40 times the noise."""
ALIGN = (('base', 'tool'), ('base', 'tool'), ('base', 'tool'), ('base',), ())
"""Frames to be fitted: both in most cells, as nobody knows them."""
NOISE = (2e-5, 8e-5)
"""RMS length of the noise [m], drawn between these with even logarithms."""
WITHHELD = 5
"""One case of so many has a family taken out."""
HELD_OUT = 3
"""One case of so many brings a held-out recording; of stations it has few."""


def several(seed: int, number: int) -> tuple[SealedCase, bool]:
    """
    Return case ``number`` of a seed, and whether its held-out recording is given.

    Raises DataError: no cell and motion show such causes.
    """
    rng = np.random.default_rng([seed, 3000 + number])
    lot = lot_of(seed, number, rng)
    case = draw_case(lot, rng, SPANS)
    holdout = poorer(case.holdout, 'few', rng)
    if (number // MOST) % WITHHELD == WITHHELD - 1:
        case = replace(case, excluded=(str(rng.choice(lot.families)),))
    return replace(case, holdout=holdout), number % HELD_OUT == HELD_OUT - 1 and not case.also


def lot_of(seed: int, number: int, rng: np.random.Generator) -> Lot:
    """
    Return what a case is to be.

    rng: of the case.
    """
    count = 1 + number % MOST
    crowded = count >= MOST - 1
    motion = str(rng.choice(CROWDED if crowded else MOTIONS))
    align = ALIGN[int(rng.integers(len(ALIGN)))]
    fitted = {f'{frame}_pose' for frame in align}
    still = MOVING if motion in CROWDED else frozenset()
    cards = [name for name in (*COMMON * (OFTEN - 1), *FAMILIES) if name not in still | fitted]
    families = _families(cards, count, rng)
    withheld = (number // MOST) % WITHHELD == WITHHELD - 1
    robots = Deck(ROBOTS, seed, 71)
    robot = [robots.next() for _ in range(number + 1)][number]
    return Lot(
        'withheld' if withheld else 'several',
        robot,
        motion,
        families,
        tuple(int(rng.choice(STRATA)) for _ in range(count)),
        align,
        float(np.exp(rng.uniform(*np.log(NOISE)))),
    )


def _families(cards: Sequence[str], count: int, rng: np.random.Generator) -> tuple[str, ...]:
    """Return families; a common one may come twice, at two joints."""
    out: list[str] = []
    while len(out) < count:
        card = str(rng.choice(cards))
        if card in COMMON or card not in out:
            out.append(card)
    return tuple(out)
