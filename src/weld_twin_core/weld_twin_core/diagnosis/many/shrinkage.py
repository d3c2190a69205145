# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Many small errors at once: each kind's usual size is learned, and each member is held to it.

Fitted freely, dozens of small geometric errors or hundreds of ripple orders chase the noise. Here
every group of like coordinates (a family; a joint's ripple within a band of orders) has a prior
whose variance maximises the evidence; a group that the data do not need shrinks to nothing.

References
----------
.. [1] D. J. C. MacKay, "Bayesian interpolation", Neural Computation 4, 1992.
.. [2] M. E. Tipping, "Sparse Bayesian learning and the relevance vector machine", JMLR 1, 2001.

"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ..algebra.columns import designed
from ..algebra.fit import Fit, coordinates, fit, robust_scale, solve_scaled, stepped
from ..algebra.learned_sizes import learned_precision, projected
from ..algebra.prior import effect_precision, frame_prior
from ..algebra.problem import Model, Problem, Scale
from ..beliefs import Beliefs
from ..unseen.unseen_stretches import Unseen


def groups(result: tuple[Effect, ...], beliefs: Beliefs) -> tuple[Array, Array]:
    """
    Return the group number and the typical size of every fit coordinate, shapes (K,).

    Number -1 marks coordinates that are fitted freely.
    """
    labels = [label for effect in result for label in effect.fit.alike()]
    scales = [effect.fit.coordinate_scales() for effect in result]
    names = {label: k for k, label in enumerate(dict.fromkeys(labels))}
    numbers = np.array([names[label] for label in labels], dtype=int)
    counts = np.bincount(numbers, minlength=len(names)) if numbers.size else np.zeros(0, int)
    free = counts[numbers] < beliefs.tied_from if numbers.size else np.zeros(0, bool)
    return np.where(free, -1, numbers), np.concatenate([np.zeros(0), *scales])


def shrunk_step(
    problem: Problem, model: Model, scale: Scale, beliefs: Beliefs
) -> tuple[Model, Scale]:
    """Return the model after one linear step with learned priors, and the noise it leaves."""
    model, _, freedom = _learned(problem, model, scale, beliefs)
    return model, robust_scale(problem, problem.residuals(model), freedom=freedom)


def shrunk_fit(
    problem: Problem, model: Model, scale: Scale, beliefs: Beliefs
) -> tuple[Fit, Array]:
    """Return the fit with learned priors, and their precision, shape (K,)."""
    model, precision, _ = _learned(problem, model, scale, beliefs)
    return fit(problem, model, scale, precision, iterations=1), precision


def _learned(
    problem: Problem, model: Model, scale: Scale, beliefs: Beliefs
) -> tuple[Model, Array, float]:
    """Return the model after one linear step, the prior precision learned, and its freedom."""
    residual = problem.whitened(problem.residuals(model), scale)
    columns = designed(problem, model, scale)
    frame_ridge, off = frame_prior(problem, model)
    frames = frame_ridge.size
    normal, right = columns.normal(), columns.times(residual)
    normal[:frames, :frames] += np.diag(frame_ridge)
    right[:frames] -= frame_ridge * off
    sizes, rss = Sizes.of(model, beliefs), float(residual @ residual)
    precision, freedom, step = sizes.learned(normal, right, rss, residual.size)
    trial = stepped(problem, model, step)
    moved, x_moved = problem.whitened(problem.residuals(trial), scale), coordinates(trial)
    if moved @ moved + precision @ x_moved**2 > rss + precision @ sizes.now**2:
        trial = fit(problem, model, scale, precision, iterations=2).model
    return trial, precision, freedom + frames


@dataclass(frozen=True, eq=False)
class Sizes:
    """What is known of the sizes of a model's coordinates before they are learned, shapes (K,)."""

    now: Array
    """The coordinates."""
    labels: Array
    scales: Array
    """As `groups` returns them."""
    believed: Array
    """Prior precision; see `believed`."""

    @classmethod
    def of(cls, model: Model, beliefs: Beliefs) -> Sizes:
        """Return what is known of a model's coordinates."""
        return cls(coordinates(model), *groups(model.found, beliefs), believed(model))

    def learned(
        self, normal: Array, right: Array, rss: float, rows: int
    ) -> tuple[Array, float, Array]:
        """
        Return the prior precision learned, the freedom that it leaves, and the step to where it leads.

        normal, right, rss, rows: normal equations of the frames, with what is believed of these,
        and of all coordinates.
        """
        frames = len(right) - self.now.size
        # What the coordinates explain already is put back.
        now = np.concatenate([np.zeros(frames), self.now])
        shift = normal @ now
        explained = float(2.0 * now @ right + now @ shift)
        precision, freedom = learned_precision(
            *projected(normal, right + shift, rss + explained, frames),
            rows - frames,
            self.labels,
            self.scales,
            self.believed,
        )
        ridge = np.concatenate([np.zeros(frames), precision])
        step = solve_scaled(normal + np.diag(ridge), right - ridge * now, 1e-9)
        return precision, freedom, step


def predicted(unseen: Unseen, model: Model, beliefs: Beliefs) -> Array:
    """
    Return what is left on every part by a model fitted on the others, shape (rows,), whitened.

    The sizes of its groups are learned on the others as well: learned on all, they know what was
    left out, and on a dozen stations dozens of errors predict pure noise.
    """
    frames, residual = unseen.frames, unseen.residual
    whole = np.sum(unseen.normals, axis=0)
    whole[:frames, :frames] += np.diag(unseen.precision[:frames])
    sizes, out = Sizes.of(model, beliefs), np.array(residual)
    for b, rows in enumerate(unseen.spans):
        right, here = unseen.rights_of_residual[b][:, 0].copy(), residual[rows]
        right[:frames] -= unseen.pull[:frames]
        rss, count = float(residual @ residual - here @ here), residual.size - here.size
        *_, step = sizes.learned(whole - unseen.normals[b], right, rss, count)
        out[rows] -= unseen.stretches[b].mixed(step)
    return out


def believed(model: Model) -> Array:
    """Return the prior precision of every coordinate; curves are as high as ripple usually is."""
    parts = [effect_precision(model.with_found((effect,))) for effect in model.found]
    for effect, part in zip(model.found, parts, strict=True):
        if not (effect.traits.cause or effect.traits.of_setup):
            unknown = part == 0.0
            part[unknown] = effect.fit.coordinate_scales()[unknown] ** -2.0
    return np.concatenate([np.zeros(0), *parts])
