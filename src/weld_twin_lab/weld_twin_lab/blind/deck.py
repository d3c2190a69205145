# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which case is of which kind: shuffled decks, so that every kind, family and stratum has its share.

Case number i depends on the seed and on i alone; asking for more cases extends the same list.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from weld_twin_core.errors import DataError

from .cause_sizes import FAMILIES, OUTSIDE

Card = TypeVar('Card')

KINDS = {
    'single': 16,
    'double': 6,
    'triple': 3,
    'none': 4,
    'outside': 4,
    'withheld': 4,
    'ambiguous': 3,
}
"""Kinds of cases, and how many of 40 are of each."""
STRATA = ((0.3, 1.0), (1.0, 3.0), (3.0, 10.0), (10.0, 40.0))
"""Effect RMS over measurement noise."""
_STRATUM = {
    'single': (0, 1, 1, 2, 2, 3),
    'double': (1, 2, 2, 3),
    'triple': (1, 2, 2, 3),
    'outside': (1, 2, 2, 3),
    'withheld': (1, 2, 2, 3),
    'ambiguous': (1, 2, 2, 3),
    'none': (0,),
}
"""
Number of the stratum of each case of a kind, dealt like cards: each comes as often as it stands
here.
"""
_COUNT = {'double': 2, 'triple': 3, 'none': 0}
"""Causes of a case; one where the kind is not named."""
ROBOTS = (
    'ur5',
    'ur10',
    'kuka_kr6_r900',
    'abb_irb120',
    'abb_irb1600',
    'fanuc_m10ia',
    'franka_panda',
)
MOTIONS = ('seams', 'free', 'free', 'stations')


@dataclass(frozen=True)
class Lot:
    """What a case is to be."""

    kind: str
    robot: str
    motion: str
    families: tuple[str, ...]
    """Of the causes; the construction where the kind is 'ambiguous'."""
    strata: tuple[int, ...]
    """Which of `STRATA` each cause is to be in."""
    align: tuple[str, ...] | None = None
    """Frames that the diagnosis is to fit; drawn with the cell where left out."""
    noise_m: float | None = None
    """RMS length of the measurement noise [m]; drawn with the cell where left out."""


def lots(
    seed: int,
    count: int,
    kinds: Sequence[str] = (),
    constructions: Sequence[str] = ('',),
    shares: Mapping[str, int] = KINDS,
) -> list[Lot]:
    """
    Return what the first cases of a seed are to be.

    kinds: only these; empty for all.
    constructions: names of the ambiguous constructions.
    shares: how often each kind comes.

    Raises DataError: an unknown kind, or no cases asked for.
    """
    for kind in kinds:
        if kind not in KINDS:
            raise DataError(f'there are no cases of kind {kind!r}; kinds are ' + ', '.join(KINDS))
    if count < 1 or seed < 0:
        raise DataError('the number of cases must be at least 1 and the seed not negative')
    chosen = {kind: shares[kind] for kind in (kinds or shares)}
    table = {'outside': OUTSIDE, 'ambiguous': tuple(constructions)}
    pattern = [kind for kind, share in chosen.items() for _ in range(share)]
    decks = {kind: Deck(table.get(kind, FAMILIES), seed, k) for k, kind in enumerate(KINDS)}
    strata = {kind: Deck(_STRATUM[kind], seed, 20 + k) for k, kind in enumerate(KINDS)}
    order, robots = Deck(pattern, seed, 50), Deck(ROBOTS, seed, 51)
    motions = Deck(MOTIONS, seed, 52)
    out = []
    for _ in range(count):
        kind = order.next()
        number = _COUNT.get(kind, 1)
        out.append(
            Lot(
                kind,
                robots.next(),
                motions.next(),
                decks[kind].several(number),
                tuple(strata[kind].next() for _ in range(number)),
            )
        )
    return out


class Deck(Generic[Card]):
    """Cards dealt in a random order, all of them before any comes again."""

    def __init__(self, cards: Sequence[Card], seed: int, number: int) -> None:
        self._cards = list(cards)
        self._rng = np.random.default_rng([seed, number])
        self._left: list[Card] = []

    def next(self) -> Card:
        """Return the next card."""
        if not self._left:
            self._left = [self._cards[k] for k in self._rng.permutation(len(self._cards))]
        return self._left.pop()

    def several(self, count: int) -> tuple[Card, ...]:
        """Return so many different cards."""
        out: list[Card] = []
        while len(out) < count:
            card = self.next()
            if card not in out:
                out.append(card)
        return tuple(out)
