# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a verdict is drawn from: values, the fits of the alternatives, and the table of answers.

A row of the table is an effect that the search found, with every other that was fitted in its place
and what share of the evidence each has. What these data cannot tell apart shares its row. Name, place
and dependence are sums over a row, so a place may be certain where several names at it are not.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

from ...effects.registry import REGISTRY
from ..beliefs import Beliefs
from ..hypotheses.alternatives import Alternative, CandidateSet
from ..result import Family, Site, Structure


class Scatter(NamedTuple):
    """Scatter along one joint."""

    joint: str
    share: float
    """Of the squared noise."""
    steady: float
    """The share in its standard errors between folds."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """What the verdict is drawn from."""

    candidate_sets: tuple[CandidateSet, ...]
    """For every found effect, itself and its alternatives, most probable first."""
    structure: Structure
    """What generic columns still find."""
    gap: float
    after: float
    floor: float
    """RMS on unseen data before and after, and of the noise, [m]."""
    independent: bool
    """Whether the floor was measured apart from any model."""
    parts: tuple[float, ...]
    """Squared contribution of every effect over the square of their sum."""
    refused: tuple[str, ...] = ()
    """What would explain the rest best but no machine has, in words."""
    lacking: tuple[str, ...] = ()
    """What was taken out of the library and fits clearly better than what was found, in words."""
    families: tuple[Family, ...] | None = None
    """Where many small errors were fitted together: what each kind accounts for."""
    leverage: float = 1.0
    """Ratio of ``after`` to ``floor`` that noise alone hardly ever exceeds: few stations are taken
    up in part by the fit."""
    believed: tuple[float, ...] = ()
    """How probable it is of every effect found that its name is right, as the calibration has it;
    of many small errors, of all that are named."""
    nameless: float = 0.0
    """How probable it is that a cause is at work that has no name in the library, as the
    calibration has it."""
    sizes: tuple[float, ...] = ()
    """RMS by which every effect moves the tool [m]."""
    wandered: tuple[float, ...] = ()
    """How far the values of every effect move from fold to fold, over what noise makes them: a
    formula that stands in for another wants other values in every fold."""
    missed: tuple[tuple[float, ...], ...] = ()
    """By what share the error of every part left out grows without every effect, all others fitted
    anew: one that stands in for another makes some part better."""
    rows: float = 1.0
    """Number of independent rows that the effects were chosen on."""
    travel: tuple[float, ...] = ()
    """How far every joint moves [rad, m]."""
    stations: bool = False
    """Whether the arm stood still where it was measured, in one of the recordings at least."""
    strays: tuple[str, ...] = ()
    """Readings that stand out by themselves and are left out of what is judged, in words."""
    with_strays: float = 0.0
    """What is left on unseen data with these readings, RMS [m]."""
    scattered: tuple[Scatter, ...] = ()
    """Noise that comes from joints beyond doubt, largest first."""


Key = TypeVar('Key')


@dataclass(frozen=True, eq=False)
class Row:
    """One effect found, with what could stand in its place."""

    candidate_set: CandidateSet
    listed: tuple[Site, ...]
    """Those named together: the leader alone where it has nearly all of the weight."""

    @classmethod
    def of(cls, candidate_set: CandidateSet, beliefs: Beliefs) -> Row:
        """Return the row of an effect found."""
        return cls(candidate_set, named_together(candidate_set, beliefs))

    @property
    def leader(self) -> Alternative:
        """Return the most probable; its evidence is how far the answer with it is ahead."""
        return self.candidate_set[0]

    @property
    def mass(self) -> float:
        """Return the weight of all that are named together."""
        return float(sum(one.probability for one in self.candidate_set if one.site in self.listed))

    def names(self) -> dict[Site, float]:
        """Return the weight of every name."""
        return marginal((one.site, one.probability) for one in self.candidate_set)

    def places(self) -> dict[str, float]:
        """Return the weight of every place."""
        return marginal((one.place, one.probability) for one in self.candidate_set)

    def dependences(self) -> dict[str, float]:
        """Return the weight of everything that it may depend on."""
        return marginal((one.dependence, one.probability) for one in self.candidate_set)


def marginal(weights: Iterable[tuple[Key, float]]) -> dict[Key, float]:
    """Return the sum of the weights of every key, in the order in which keys come."""
    out: dict[Key, float] = {}
    for key, weight in weights:
        out[key] = out.get(key, 0.0) + weight
    return out


def named_together(candidate_set: CandidateSet, beliefs: Beliefs) -> tuple[Site, ...]:
    """Return the leader alone when it is sure, else all worth naming, the simplest first."""
    if candidate_set[0].probability >= beliefs.sure:
        return (candidate_set[0].site,)
    listed = dict.fromkeys(r.site for r in candidate_set if r.probability >= beliefs.listed)
    return tuple(sorted(listed, key=_numbers))


def _numbers(site: Site) -> int:
    """Return how many numbers an effect has: the fewer, the simpler."""
    return sum(max(parameter.size, 1) for parameter in REGISTRY[site.effect].parameters)
