# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What the steps hand on to each other: what a search found, and what a verdict is drawn from.

A row of the table of answers is an effect that the search found, with every other that was fitted in
its place and what share of the evidence each has. What these data cannot tell apart shares its row.
Name, place and dependence are sums over a row, so a place may be certain where several names at it are
not.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeVar

import numpy as np

from ..arrays import Array
from ..effects.effect import Effect
from ..effects.plausible import beyond
from ..effects.registry import REGISTRY
from .algebra.fit import Fit, without_strays
from .algebra.problem import Problem, Scale, Site
from .algebra.workspace import Library, Role, Workspace
from .beliefs import Beliefs
from .negligible import NANOMETRE, ROUNDING
from .result import Family, Structure

NAMED = 3
"""Things that a sentence names at the most: more are no place to begin at."""
LIKELIER = 0.5
"""Probability from which on a cause counts as named: it is likelier right than wrong."""


@dataclass(frozen=True, eq=False)
class Alternative:
    """A unit in the place of a found effect: its evidence, and the fit with it."""

    site: Site
    log_bayes: float
    fit: Fit
    probability: float = 0.0
    """Its share of the evidence in this place."""
    behind: float = 0.0
    """By how much a family that was taken out is ahead in this place; 0 of none."""
    role: Role = Role.FOUND
    """Whether it may be in the model."""
    ahead: float = 0.0
    """By how much evidence it is ahead of all that may be in the model, where it may not."""

    @property
    def place(self) -> str:
        """Return where it is at work."""
        effect = self._fitted
        return str(self.site.joint) if effect is None else effect.at

    @property
    def dependence(self) -> str:
        """Return what it depends on."""
        effect = self._fitted
        return REGISTRY[self.site.effect].traits.depends_on if effect is None else effect.on

    @property
    def orders(self) -> Array:
        """Return the orders of the waves that it is a sum of, shape (K,) [1/rev]; none of others."""
        effect = self._fitted
        return np.zeros(0) if effect is None else np.asarray(effect.search.orders())

    @property
    def _fitted(self) -> Effect | None:
        return next((e for e in self.fit.model.found if Site.of(e) == self.site), None)


CandidateSet = tuple[Alternative, ...]
"""An effect found and its alternatives, most probable first; their weights add up to one."""


@dataclass(frozen=True, eq=False)
class Search:
    """What a search found."""

    problem: Problem
    scale: Scale
    """All measurements, with the final noise and weights."""
    baseline: Fit
    """Frames and known effects only."""
    final: Fit
    precision: Array
    """Prior precision of the final fit's coordinates, shape (K,)."""
    work: Workspace
    """The library that alternatives are drawn from."""
    small: Fit
    """The final fit on the workspace's measurements."""
    candidate_sets: tuple[CandidateSet, ...]
    """For every found effect itself and its alternatives; empty when many were fitted together."""
    crowded: bool = False
    """Whether so many units came one by one that the selection among them was not finished."""
    dense: bool = False
    """Whether many small errors were fitted together."""
    refused: tuple[Effect, ...] = ()
    """What would explain the rest best, but no machine has."""
    other_way: Search | None = None
    """Of a few effects and many small errors the way that was not chosen, where it may be told: the few
    where the many name no cause; the many where the few leave the cause unknown."""

    @property
    def library(self) -> Library:
        """Return the library searched."""
        return self.work.library

    @property
    def lacking(self) -> tuple[Effect, ...]:
        """Return what was taken out of the library and fits clearly better than what was found."""
        robot = self.final.model.robot
        return tuple(effect for effect in self.refused if not beyond(robot, effect))

    def apart_from_strays(self) -> Search:
        """Return the same with no weight for readings that stray by themselves; itself without any."""
        scale = without_strays(self.scale)
        if scale is self.scale:
            return self
        left = self.problem.whitened(self.problem.residuals(self.final.model), scale)
        return replace(self, scale=scale, final=replace(self.final, residual=left))

    def effective(self, result: Fit) -> float:
        """Return the number of independent rows of a fit on the workspace's measurements."""
        return self.work.effective(result)


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
    shown: tuple[float, ...] = ()
    """How many standard errors every effect is from nothing beside all small errors of an arm."""
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

    @property
    def noise(self) -> float:
        """Return the floor, or what little it is divided by where there is none [m]."""
        return max(self.floor, ROUNDING)


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


@dataclass(frozen=True)
class Verdict:
    """
    Status, one set of sites per reported effect, families of many small ones, and how sure it is.

    An effect that counts as named is reported whatever the status: 'unknown' says that beside it
    something is at work that has no name. ``confidence`` is the probability that the whole answer
    is right, ``sure`` says whether it keeps the promise of being wrong hardly ever, and
    ``complete`` is the probability that no cause of any size is missing; all three are told by the
    calibration.
    """

    status: str
    sets: tuple[tuple[Site, ...], ...] = ()
    reasons: tuple[str, ...] = ()
    families: tuple[Family, ...] = ()
    confidence: float = 0.0
    sure: bool = False
    complete: float = 0.0


def beyond_doubt(structure: Structure, beliefs: Beliefs) -> bool:
    """Return whether what generic columns find is there beyond doubt."""
    gain, sure = structure.gain, structure.sure
    usual = gain > beliefs.structure_gain and sure > beliefs.structure_sure
    blatant = gain > beliefs.beaten_share and sure > beliefs.blatant_sure
    return (usual or blatant) and gain > structure.chance


@dataclass(frozen=True, eq=False)
class Left:
    """Evidence, and the numbers from which on what it leaves is more than noise."""

    evidence: Evidence
    beliefs: Beliefs

    @property
    def structured(self) -> bool:
        """Return whether generic columns find something beyond doubt."""
        return beyond_doubt(self.evidence.structure, self.beliefs)

    @property
    def high(self) -> bool:
        """Return whether what remains rises above a floor that was measured apart."""
        evidence = self.evidence
        return evidence.independent and self.rises(self.beliefs.above)

    @property
    def wide(self) -> bool:
        """Return whether what remains is far wider than a floor that only the fit shows."""
        evidence = self.evidence
        return not evidence.independent and self.rises(self.beliefs.above**2)

    def rises(self, times: float) -> bool:
        """Return whether what remains is so many times the floor, and more than chance makes it."""
        evidence = self.evidence
        return evidence.after > max(times, evidence.leverage) * evidence.floor

    @property
    def above_noise(self) -> bool:
        """Return whether what remains is more than noise."""
        return self.structured or self.high

    @property
    def share(self) -> float:
        """Return the share of the squared gap above noise that is not explained."""
        evidence = self.evidence
        structured = evidence.structure.gain * evidence.after**2 if self.structured else 0.0
        over = evidence.after**2 - evidence.floor**2 if self.high else 0.0
        if self.wide:
            # Such a floor may be too low by that factor; what is beyond is left all the same.
            over = evidence.after**2 - (self.beliefs.above**2 * evidence.floor) ** 2
        return float(np.clip(max(structured, over) / self._excess, 0.0, 1.0))

    @property
    def scattered(self) -> float:
        """Return what noise that comes from joints is of the squared gap above noise."""
        part = sum(one.share for one in self.evidence.scattered)
        return float(np.clip(part * self.evidence.after**2 / self._excess, 0.0, 1.0))

    @property
    def explained(self) -> float:
        """Return the share of the squared gap above noise that the model takes off unseen data."""
        evidence = self.evidence
        return float(np.clip((evidence.gap**2 - evidence.after**2) / self._excess, 0.0, 1.0))

    @property
    def _excess(self) -> float:
        evidence = self.evidence
        least = self.beliefs.unexplained * evidence.floor**2
        return max(evidence.gap**2 - evidence.floor**2, least, NANOMETRE**2)
