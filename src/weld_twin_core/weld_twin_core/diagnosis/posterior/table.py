# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The table of answers, and its marginals: name, place and dependence of every effect found.

A row of the table is an effect that the search found, with every other that was fitted in its place
and what share of the evidence each has. What these data cannot tell apart shares its row. The three
marginals are sums over a row, so a place may be certain where several names at it are not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from ...effects.effect import Effect
from ...effects.registry import REGISTRY
from ..beliefs import Beliefs
from ..hypotheses.rivals import Rival
from ..result import Site

Key = TypeVar('Key')
Slot = tuple[Rival, ...]


@dataclass(frozen=True, eq=False)
class Row:
    """One effect found, with what could stand in its place."""

    slot: Slot
    """Most probable first; their weights add up to one."""
    listed: tuple[Site, ...]
    """Those named together: the leader alone where it has nearly all of the weight."""

    @property
    def leader(self) -> Rival:
        """Return the most probable."""
        return self.slot[0]

    @property
    def mass(self) -> float:
        """Return the weight of all that are named together."""
        return float(
            sum(
                alternative.probability
                for alternative in self.slot
                if alternative.site in self.listed
            )
        )

    @property
    def gap(self) -> float:
        """Return by how much evidence the best answer with it is ahead of the best without [nats]."""
        return self.leader.nats

    def names(self) -> dict[Site, float]:
        """Return the weight of every name."""
        return _marginal(self.slot, lambda alternative: alternative.site)

    def places(self) -> dict[str, float]:
        """Return the weight of every place."""
        return _marginal(self.slot, place_of)

    def dependences(self) -> dict[str, float]:
        """Return the weight of everything that it may depend on."""
        return _marginal(self.slot, dependence_of)


def table_of(slots: Sequence[Slot], beliefs: Beliefs) -> tuple[Row, ...]:
    """
    Return the table of answers, a row for every effect found.

    slots: for every effect found, itself and its rivals, most probable first.
    """
    return tuple(
        Row(candidate_set, named_together(candidate_set, beliefs)) for candidate_set in slots
    )


def named_together(candidate_set: Slot, beliefs: Beliefs) -> tuple[Site, ...]:
    """Return the leader alone when it is sure, else all worth naming, the simplest first."""
    if candidate_set[0].probability >= beliefs.sure:
        return (candidate_set[0].site,)
    listed = dict.fromkeys(r.site for r in candidate_set if r.probability >= beliefs.listed)
    return tuple(sorted(listed, key=_numbers))


def effect_of(alternative: Rival) -> Effect | None:
    """Return a rival's effect as it was fitted."""
    for effect in alternative.fit.model.found:
        if (effect.name, effect.site) == (alternative.site.effect, alternative.site.joint):
            return effect
    return None


def place_of(alternative: Rival) -> str:
    """Return where a rival sits."""
    effect = effect_of(alternative)
    return effect.at if effect is not None else str(alternative.site.joint)


def dependence_of(alternative: Rival) -> str:
    """Return what a rival depends on."""
    effect = effect_of(alternative)
    return effect.on if effect is not None else REGISTRY[alternative.site.effect].traits.depends_on


def _marginal(candidate_set: Slot, key: Callable[[Rival], Key]) -> dict[Key, float]:
    out: dict[Key, float] = {}
    for alternative in candidate_set:
        own = key(alternative)
        out[own] = out.get(own, 0.0) + alternative.probability
    return out


def _numbers(site: Site) -> int:
    """Return how many numbers an effect has: the fewer, the simpler."""
    return sum(max(parameter.size, 1) for parameter in REGISTRY[site.effect].parameters)
