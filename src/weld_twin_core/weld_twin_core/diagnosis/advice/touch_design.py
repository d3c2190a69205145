# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What further touches would tell: postures chosen one by one, each the one that tells most.

Around what was found everything is linear: errors of the arm, the tool point where it is not
known, and where each contact is. The touch taken next is the one that most lowers the variance of
what is asked for [1]_: of predicted tool points, or of the sizes that part explanations.

References
----------
.. [1] V. V. Fedorov, "Theory of optimal experiments", Academic Press 1972.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Array
from ...contacts import Places, places
from ...effects.effect import Effect
from ...recording import Recording
from ...twin.features import Features
from ..algebra.prior import effect_precision, frame_prior
from ..algebra.problem import Model, Problem, Scale

ANYWHERE = 0.1
"""Spread [m] of where a contact may be: as good as not known."""
SLACK = 5e-6
"""Noise [m] of a touch at the least: a few touches may be fitted without any rest, and no ball rests
better than that."""
DETERMINED = 1e-14
"""Share of the strongest direction below which information is rounding."""


@dataclass(frozen=True, eq=False)
class Touchable:
    """
    Touches that could be made, whitened.

    Attributes
    ----------
    recording : Recording
    rows : array, shape (N, 3, P)
        What each sees of all unknowns; rows that a kind of contact does not have are zero.

    """

    recording: Recording
    rows: Array


@dataclass(frozen=True, eq=False)
class Design:
    """
    What is known of the unknowns: errors of the arm first, then places.

    Attributes
    ----------
    model : Model
        With every error that takes part.
    tool : bool
        Whether the tool point is among the unknowns.
    sigma : float [m]
        Noise of a touch.
    errors : int
        Number of unknowns that are no place.
    starts : tuple of int
        First unknown of every place.
    surfaces : tuple of Places
        Where contacts are.
    root : array, shape (P, P)
        Its product with its transpose is the covariance of the unknowns. Kept instead of it: with
        errors of micrometres and places that may be anywhere, rounding would make it negative.

    """

    model: Model
    tool: bool
    sigma: float
    errors: int
    starts: tuple[int, ...]
    surfaces: tuple[Places, ...]
    root: Array

    @property
    def covariance(self) -> Array:
        """Return the covariance of the unknowns, shape (P, P)."""
        return np.asarray(self.root @ self.root.T)

    @classmethod
    def of(cls, problem: Problem, model: Model, effects: Sequence[Effect], scale: Scale) -> Design:
        """
        Return what the touches at hand tell.

        Parameters
        ----------
        problem : Problem
            Of contacts.
        model : Model
            With its frames as found.
        effects : sequence of Effect
            The errors that take part, as large as they were found.
        scale : Scale
            The noise, and the weight of every touch.

        """
        # A base that is fitted along counts as known: another touch tells more of it anyway.
        problem = replace(problem, align=problem.align & {'tool'})
        model, tool = model.with_found(tuple(effects)), 'tool' in problem.align
        taken = [unknown for unknown in problem.touched if unknown is not None]
        sigma = max(scale.position, SLACK)
        prior = np.concatenate([frame_prior(problem, model)[0], effect_precision(model)])
        freedom = [unknown.freedom for unknown in taken]
        starts = prior.size + np.cumsum([0, *freedom])
        information = np.diag(np.append(prior, np.full(sum(freedom), ANYWHERE**-2.0)))
        surfaces = []
        for k, recording in enumerate(problem.recordings):
            assert recording.contacts is not None
            points = model.twin(k).poses(recording, recording.joints.t).position
            surfaces.append(places(recording.contacts, points))
            rows = _rows(model, k, recording, surfaces[k], points, tool) / sigma
            rows = rows * np.sqrt(scale.weights[k])[:, None, None]
            own = np.concatenate([np.arange(prior.size), np.arange(starts[k], starts[k + 1])])
            information[np.ix_(own, own)] += np.einsum('mcp,mcq->pq', rows, rows)
            ties, at = taken[k].ties, slice(starts[k], starts[k + 1])
            information[at, at] += ties.T @ ties
        return cls(
            model,
            tool,
            sigma,
            prior.size,
            tuple(starts[:-1].tolist()),
            tuple(surfaces),
            _root(information),
        )

    def with_place(self) -> Design:
        """Return the same with one more point somewhere."""
        size = len(self.root)
        wider = np.zeros((size + 3, size + 3))
        wider[:size, :size] = self.root
        wider[size:, size:] = ANYWHERE * np.eye(3)
        return replace(self, starts=(*self.starts, size), root=wider)

    def touchable(self, k: int, recording: Recording) -> Touchable:
        """
        Return touches of place k, or of a new one, as this design sees them.

        Parameters
        ----------
        k : int
            Which place, counted from 0; the last one where it is new.
        recording : Recording
            With contacts.

        """
        assert recording.contacts is not None
        twin = min(k, len(self.surfaces) - 1)
        points = self.model.twin(twin).poses(recording, recording.joints.t).position
        if k < len(self.surfaces):
            where = Places(recording.contacts, self.surfaces[k].surfaces)
        else:
            where = places(recording.contacts, points)
        own = _rows(self.model, twin, recording, where, points, self.tool) / self.sigma
        rows = np.zeros((len(points), 3, len(self.root)))
        count, at = own.shape[1], self.starts[k]
        rows[:, :count, : self.errors] = own[..., : self.errors]
        rows[:, :count, at : at + own.shape[2] - self.errors] = own[..., self.errors :]
        return Touchable(recording, rows)

    def after(self, rows: Array) -> Design:
        """Return what is known after one more touch, rows of shape (3, P)."""
        _, size, ways = np.linalg.svd(rows @ self.root, full_matrices=False)
        less = 1.0 - 1.0 / np.sqrt(1.0 + size**2)
        return replace(self, root=self.root - (self.root @ ways.T) * less @ ways)

    def open(self, weight: Array) -> float:
        """Return how much of what is asked for is not known: the weighed sum of variances."""
        own = self.root[: self.errors]
        return float(np.einsum('pi,pi->', own, weight @ own))

    def told(self, rows: Array, weight: Array) -> Array:
        """Return by how much each touch, (N, 3, P), lowers what is `open`, shape (N,)."""
        half = rows @ self.root
        seen = np.eye(3) + half @ np.swapaxes(half, 1, 2)
        own = half @ self.root[: self.errors].T
        wanted = own @ weight @ np.swapaxes(own, 1, 2)
        return np.asarray(np.trace(np.linalg.solve(seen, wanted), axis1=1, axis2=2))


def scatter(touches: Sequence[Touchable], errors: int) -> Array:
    """
    Return the weight of errors in how far tool points scatter about their places, squared.

    In units of the noise; shape (errors, errors).

    Parameters
    ----------
    touches : sequence of Touchable
    errors : int
        Number of unknowns that are no place.

    """
    each = [t.rows[..., :errors] - t.rows[..., :errors].mean(axis=0) for t in touches]
    count = sum(len(rows) for rows in each)
    return np.asarray(sum(np.einsum('mcp,mcq->pq', rows, rows) for rows in each) / count)


def chosen(
    design: Design, rows: Array, weight: Array, count: int
) -> tuple[list[int], list[Design]]:
    """
    Return which touches to make, in order, and what is known after each.

    Parameters
    ----------
    design : Design
    rows : array, shape (N, 3, P)
        Of every touch that could be made.
    weight : array, shape (E, E)
        How much the errors' variances and covariances count.
    count : int

    """
    free = np.ones(len(rows), dtype=bool)
    order: list[int] = []
    after: list[Design] = []
    for _ in range(min(count, len(rows))):
        told = np.where(free, design.told(rows, weight), -np.inf)
        best = int(np.argmax(told))
        free[best] = False
        design = design.after(rows[best])
        order.append(best)
        after.append(design)
    return order, after


def _rows(
    model: Model, k: int, recording: Recording, where: Places, points: Array, tool: bool
) -> Array:
    """Return what touches see of the errors and of their own place, shape (M, c, E + Z)."""
    maker = Features(model.twin(k), recording, recording.joints.t)
    columns = [maker.columns(effect, False) for effect in model.found]
    if tool:
        columns.insert(0, np.stack([maker.column(('tool', j)) for j in range(6)]))
    _, seen, free = where.rows(points)
    moved = np.einsum('mci,pim->mcp', seen, np.concatenate(columns)[:, :3])
    return np.concatenate([-moved, free], axis=2)


def _root(information: Array) -> Array:
    """Return a root of the inverse of a normal matrix."""
    size = np.sqrt(np.diag(information))
    strength, ways = np.linalg.eigh(information / np.outer(size, size))
    strength = np.maximum(strength, DETERMINED * strength[-1])
    return np.asarray(ways / np.sqrt(strength) / size[:, None])
