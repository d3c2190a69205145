# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The table of answers, and its marginals: name, place and dependence of every effect found.

A row of the table is an effect that the search found, with every other that was fitted in its place
and what share of the evidence each has. What these data cannot tell apart shares its row. The three
marginals are sums over a row, so a place may be certain where several names at it are not.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeVar

from ...effects.registry import REGISTRY
from ..beliefs import Beliefs
from ..hypotheses.rivals import Rival
from ..result import Site

Key = TypeVar('Key')
Slot = tuple[Rival, ...]
"""An effect found and its alternatives, most probable first; their weights add up to one."""


@dataclass(frozen=True, eq=False)
class Row:
    """One effect found, with what could stand in its place."""

    slot: Slot
    listed: tuple[Site, ...]
    """Those named together: the leader alone where it has nearly all of the weight."""

    @classmethod
    def of(cls, slot: Slot, beliefs: Beliefs) -> Row:
        """Return the row of an effect found."""
        return cls(slot, named_together(slot, beliefs))

    @property
    def leader(self) -> Rival:
        """Return the most probable; its evidence is how far the answer with it is ahead."""
        return self.slot[0]

    @property
    def mass(self) -> float:
        """Return the weight of all that are named together."""
        return float(sum(one.probability for one in self.slot if one.site in self.listed))

    def names(self) -> dict[Site, float]:
        """Return the weight of every name."""
        return marginal((one.site, one.probability) for one in self.slot)

    def places(self) -> dict[str, float]:
        """Return the weight of every place."""
        return marginal((one.place, one.probability) for one in self.slot)

    def dependences(self) -> dict[str, float]:
        """Return the weight of everything that it may depend on."""
        return marginal((one.dependence, one.probability) for one in self.slot)


def marginal(weights: Iterable[tuple[Key, float]]) -> dict[Key, float]:
    """Return the sum of the weights of every key, in the order in which keys come."""
    out: dict[Key, float] = {}
    for key, weight in weights:
        out[key] = out.get(key, 0.0) + weight
    return out


def named_together(candidate_set: Slot, beliefs: Beliefs) -> tuple[Site, ...]:
    """Return the leader alone when it is sure, else all worth naming, the simplest first."""
    if candidate_set[0].probability >= beliefs.sure:
        return (candidate_set[0].site,)
    listed = dict.fromkeys(r.site for r in candidate_set if r.probability >= beliefs.listed)
    return tuple(sorted(listed, key=_numbers))


def _numbers(site: Site) -> int:
    """Return how many numbers an effect has: the fewer, the simpler."""
    return sum(max(parameter.size, 1) for parameter in REGISTRY[site.effect].parameters)
