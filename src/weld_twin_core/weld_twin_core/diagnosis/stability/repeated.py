# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The search repeated on halves of the data: what is named must come back.

Around the final fit all candidates are linear. Products of their columns are formed once for every
part of the recordings; a half is a sum of parts, and a search on it is algebra on small matrices.
The rules are those of the search: frames are fitted along with their priors, every coordinate has
its price, the best enters first and each is held against all others in its place.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from copy import deepcopy
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...arrays import Array
from ..algebra.prior import frame_prior
from ..hypotheses.search import Search
from ..result import CameBack, Site
from ..unseen.unseen_stretches import rows_of
from .candidates import Candidate, candidates_of
from .halves import halves, parts_of
from .reselected import Prices, reselected
from .tableau import Mask, Tableau, quadratic

SHOWS = 2.0
"""Standard errors by which a cause of the size found must stand above the price of a name on a
half; on a half that shows less, nobody can ask for it."""
FEWEST = 8
"""Halves that show a cause from which on a share of them is told: one that comes back on all of
eight comes back on seven of ten with 95 %."""
FEWEST_ROWS = 8.0
"""Independent rows that a half counts as at the least."""


@dataclass(frozen=True, eq=False)
class Repeated:
    """
    What the search took on every half.

    Attributes
    ----------
    candidates : tuple of Candidate
        Those found first.
    taken : array of bool, shape (H, U)
    shows : array of bool, shape (H, K)
        Which halves would show each effect found.
    whole : array of bool, shape (U,)
        What the same search takes on all data.
    blind : array of bool, shape (H, K, U)
        Which halves would not tell each effect found from another that all data rule out.

    """

    candidates: tuple[Candidate, ...]
    taken: Mask
    shows: Mask
    whole: Mask
    blind: Mask

    def came_back(self, site: Site, alike: Collection[Site]) -> CameBack | None:
        """
        Return how often what was found came back, itself or what is told as alike.

        Parameters
        ----------
        site : Site
            Of an effect found.
        alike : collection of Site
            What counts as the same.

        Returns
        -------
        CameBack or None
            None where too few halves can tell.

        """
        sites = [own.site for own in self.candidates]
        known = sites[: self.shows.shape[1]]
        among = np.array([own == site or own in alike for own in sites])
        if site not in known or not self.whole[among].any():
            # Where the algebra would not name it even on all data, it says nothing of halves.
            return None
        k = known.index(site)
        taken = self.taken[self.shows[:, k] & ~self._undecided(k, among)]
        if len(taken) < FEWEST:
            taken = self.taken[self.shows[:, k]]
        if len(taken) < FEWEST:
            return None
        there = taken[:, among].any(axis=1)
        came = {
            own: int(taken[~there, u].sum())
            for u, own in enumerate(sites)
            if own not in known and not among[u]
        }
        instead = sorted(((own, n) for own, n in came.items() if n), key=lambda item: -item[1])
        return CameBack(int(there.sum()), len(taken), tuple(instead))

    def _undecided(self, k: int, among: Mask) -> Mask:
        """
        Return the halves that cannot tell a cause from what came in its place somewhere, (H,).

        A joint that a half hardly moves has no wave there, and a constant comes for it: this says
        nothing against a wave that all data show.
        """
        missed = ~self.taken[:, among].any(axis=1) & self.shows[:, k]
        instead = self.taken[missed].any(axis=0) & ~among
        return np.asarray((self.blind[:, k] & instead).any(axis=1))


def repeated(found: Search) -> Repeated | None:
    """
    Return the search repeated on halves; None where nothing was found one by one.

    Parameters
    ----------
    found : Search

    """
    model, problem, scale = found.small.model, found.work.problem, found.work.scale
    labels = parts_of(problem)
    drawn = halves([int(each.max()) + 1 for each in labels])
    if found.dense or not found.slots or not model.found or not len(drawn):
        return None
    frames = problem.whitened(problem.frame_columns(problem.features(model))[0], scale)
    bare = problem.whitened(problem.residuals(model.with_found(())), scale)
    candidates = tuple(candidates_of(found, frames, bare))
    rows = np.concatenate([frames, *(own.columns for own in candidates), bare[None]])
    normal = np.einsum('hb,bpq->hpq', drawn.astype(float), _products(rows, labels), optimize=True)
    size = np.sqrt(np.maximum(np.einsum('hpp->hp', normal), 1e-300))[:, len(frames) :]
    size[:, -1] = 1.0
    normal = _beside(normal, *frame_prior(problem, model))
    share = drawn @ np.concatenate([np.bincount(each) for each in labels]) / bare.size
    prices = Prices(
        np.maximum(found.effective(found.small) * share, FEWEST_ROWS),
        np.array([own.freedom for own in candidates], float),
        np.log([max(own.trials, 1.0) for own in candidates]),
        found.work.beliefs.enter_nats,
    )
    full, empty = (Tableau(normal, _parts(candidates), size) for _ in range(2))
    for k in range(len(model.found)):
        full.sweep(np.arange(len(drawn)), k)
    shows = _shows(full, prices, size, len(model.found))
    blind = _blind(full, prices, size, shows.shape[1], found.work.beliefs.rival_nats)
    taken = _better(full, empty, prices)
    return Repeated(candidates, taken[:-1], shows[:-1], taken[-1], blind[:-1])


def _better(full: Tableau, empty: Tableau, prices: Prices) -> Mask:
    """Return what a search takes from nothing, or from what was found where that is better."""
    ways = [(reselected(table, prices), table) for table in (full, empty)]
    cost = prices.each + prices.enter
    worth = [
        -0.5 * prices.counts * np.log(table.rss) - np.where(taken, cost, 0.0).sum(axis=1)
        for taken, table in ways
    ]
    return np.where((worth[0] >= worth[1])[:, None], ways[0][0], ways[1][0])


def _shows(full: Tableau, prices: Prices, size: Array, found: int) -> Mask:
    """Return which halves would show each effect if it were there as on all data, (H, found)."""
    out = []
    for k in range(found):
        part = full.parts[k]
        scaled = _as_on_all(full, size, k)
        # Swept in, a block is minus the inverse of what it was beside the others.
        mass = np.linalg.solve(full.table[:, part, part], scaled[..., None])[..., 0]
        fall = np.maximum(-(scaled * mass).sum(axis=1), 0.0)
        nats = 0.5 * prices.counts * np.log1p(fall / full.rss)
        out.append(nats - SHOWS * np.sqrt(2.0 * nats) > prices.each[:, k] + prices.enter)
    return np.stack(out, axis=1)


def _as_on_all(full: Tableau, size: Array, k: int) -> Array:
    """Return the coefficients that an effect has on all data, as every half scales them, (H, K)."""
    part = full.parts[k]
    return np.asarray(size[:, part] * (full.table[-1, part, -1] / size[-1, part]))


def _blind(full: Tableau, prices: Prices, size: Array, found: int, far: float) -> Mask:
    """
    Return which halves would not tell each effect found from another, (H, found, U).

    Only from such as all data put further behind than ``far`` nats: what comes near there is a
    rival, and is to be heard.
    """
    every, out = np.arange(len(size)), np.zeros((len(size), found, len(full.parts)), bool)
    for k in range(found):
        less = deepcopy(full)
        less.sweep(every, k)
        part, scaled = full.parts[k], _as_on_all(full, size, k)
        own = np.einsum('hi,hij,hj->h', scaled, less.table[:, part, part], scaled)
        for u in range(found, len(full.parts)):
            other, none = full.parts[u], less.taken[:, u]
            square = less.table[:, other, other]
            alike = (less.table[:, other, part] @ scaled[..., None])[..., 0]
            missed = np.maximum(own - quadratic(square, alike, none), 0.0)
            dearer = prices.each[:, k] - prices.each[:, u]
            nats = 0.5 * prices.counts * np.log1p(missed / full.rss)
            left = less.rss - quadratic(square, less.table[:, other, -1], none)
            behind = 0.5 * prices.counts * np.log(np.maximum(left / full.rss, 1.0)) - dearer
            out[:, k, u] = (nats - SHOWS * np.sqrt(2.0 * nats) <= dearer) & (behind[-1] > far)
    return out


def _products(rows: Array, labels: Sequence[Array]) -> Array:
    """Return the products of rows with each other in every part, shape (parts, P, P)."""
    spans = [span for each in labels for span in rows_of(each)]
    return np.array([rows[:, span] @ rows[:, span].T for span in spans])


def _beside(normal: Array, precision: Array, off: Array) -> Array:
    """Return products with the frames fitted and projected out, their priors included."""
    frames = precision.size
    if not frames:
        return normal
    square = normal[:, :frames, :frames] + np.diag(precision)
    size = np.sqrt(np.maximum(np.einsum('hpp->hp', square), 1e-300))
    square = square / (size[:, :, None] * size[:, None]) + 1e-11 * np.eye(frames)
    across = normal[:, :frames, frames:].copy()
    across[:, :, -1] -= precision * off
    across /= size[:, :, None]
    return np.asarray(
        normal[:, frames:, frames:] - np.swapaxes(across, 1, 2) @ np.linalg.solve(square, across)
    )


def _parts(candidates: Sequence[Candidate]) -> list[slice]:
    """Return the columns of every candidate."""
    ends = np.cumsum([len(own.columns) for own in candidates]).tolist()
    return [slice(a, b) for a, b in pairwise([0, *ends])]
