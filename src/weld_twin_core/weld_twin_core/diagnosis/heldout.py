# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What models with more or fewer effects predict on stretches they were not fitted on.

The found effects are small, so around the final fit every smaller model is linear: the exact
contribution of each effect is put back into the residual where it is left out, and the coordinates
of those kept are fitted anew on the other stretches. Normal equations of every stretch are formed
once; a model is a choice of columns and targets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from ..arrays import Array
from .fit import Fit, design
from .problem import Model, Problem, Scale

BLOCKS = 8
TRUSTED = 0.2
"""A sample of less weight is an outlier: reported, and left out of every quoted RMS."""
TETHER = 0.3
"""A coordinate moves about this share of its size when the stretches that show it are left out."""


@dataclass(frozen=True, eq=False)
class Unseen:
    """
    Predictions of the final model and its parts on unseen stretches.

    Attributes
    ----------
    problem, scale : Problem, Scale
    labels : array, shape (rows,)
        Stretch of every row.
    columns : array, shape (P, rows)
        Frames, then the coordinates of every found effect.
    parts : tuple of slice
        Columns of every effect.
    targets : array, shape (1 + K, rows)
        The final residual, then what each effect takes off it, exactly.
    precision, pull : array, shape (P,)
        Prior precision of every column, and how hard it pulls from where the fit is now.
    normals : array, shape (blocks, P, P);  rights : array, shape (blocks, P, 1 + K)

    """

    problem: Problem
    scale: Scale
    labels: Array
    columns: Array
    parts: tuple[slice, ...]
    targets: Array
    precision: Array
    pull: Array
    normals: Array
    rights: Array

    @classmethod
    def of(cls, problem: Problem, scale: Scale, fit: Fit, precision: Array) -> Unseen:
        """Prepare the parts of a fitted model."""
        model = fit.model
        columns, _ = design(problem, model, scale)
        frames = columns.shape[0] - fit.coordinates.size
        parts, at = [], frames
        for effect in model.found:
            size = effect.coordinates().size
            parts.append(slice(at, at + size))
            at += size
        targets = [fit.residual] + [
            problem.whitened(problem.residuals(_without(model, k)), scale) - fit.residual
            for k in range(len(model.found))
        ]
        prior = np.zeros(columns.shape[0])
        if precision.size:
            prior[frames:] = precision
        x = np.concatenate([np.zeros(frames), fit.coordinates])
        tether = np.concatenate([np.zeros(frames), _tether(model)])
        labels = problem.block_labels(BLOCKS)
        stacked = np.array(targets)
        bounds = np.searchsorted(labels, np.arange(int(labels[-1]) + 2))
        spans = list(zip(bounds[:-1], bounds[1:], strict=True))
        normals = np.array([columns[:, a:b] @ columns[:, a:b].T for a, b in spans])
        rights = np.array([columns[:, a:b] @ stacked[:, a:b].T for a, b in spans])
        return cls(
            problem, scale, labels, columns, tuple(parts), stacked, prior + tether, prior * x,
            normals, rights,
        )  # fmt: skip

    @property
    def frames(self) -> int:
        """Return the number of nuisance columns."""
        return self.parts[0].start if self.parts else self.columns.shape[0]

    def predict(self, kept: Sequence[int]) -> Array:
        """Return the residual on every stretch of the model fitted on the others, (rows,)."""
        return self.base(kept).residual

    def base(self, kept: Sequence[int]) -> Base:
        """Return a model of some effects, fitted with each stretch left out in turn."""
        index = np.concatenate(
            [np.arange(self.frames), *(np.arange(self.parts[k].start, self.parts[k].stop)
                                       for k in kept)]
        ).astype(int)  # fmt: skip
        mix = np.ones(self.targets.shape[0])
        mix[[1 + k for k in kept]] = 0.0
        target = mix @ self.targets
        normal = self.normals[:, index][:, :, index]
        right = self.rights[:, index] @ mix
        factors, residual = [], target.copy()
        if index.size:
            total, total_right = normal.sum(axis=0), right.sum(axis=0)
            for b in range(normal.shape[0]):
                system = total - normal[b] + np.diag(self.precision[index])
                size = np.sqrt(np.maximum(np.diag(system), 1e-300))
                scaled = system / np.outer(size, size)
                scaled[np.diag_indices_from(scaled)] += 1e-11
                factor = cho_factor(scaled)
                wanted = (total_right - right[b] - self.pull[index]) / size
                step = cho_solve(factor, wanted) / size
                low, high = np.searchsorted(self.labels, [b, b + 1])
                residual[low:high] -= step @ self.columns[index, low:high]
                factors.append((factor, size))
        return Base(self, index, target, factors, residual)

    def squares(self, residual: Array) -> Array:
        """Return the squared position error of every trusted sample, shape (samples,) [m^2]."""
        out, at = [], 0
        for c, m, weight in zip(
            self.problem.rows, self.problem.samples, self.scale.weights, strict=True
        ):
            part = residual[at : at + c * m].reshape(m, c)[:, :3] * self.scale.position
            at += c * m
            out.append(((part**2).sum(axis=1) / weight)[weight >= TRUSTED])
        return np.concatenate(out)

    def rms(self, residual: Array) -> float:
        """Return the RMS position error over trusted samples, [m]."""
        return float(np.sqrt(self.squares(residual).mean()))

    def trusted_labels(self) -> Array:
        """Return the stretch of every trusted sample."""
        out, at = [], 0
        for c, m, weight in zip(
            self.problem.rows, self.problem.samples, self.scale.weights, strict=True
        ):
            out.append(self.labels[at : at + c * m : c][weight >= TRUSTED])
            at += c * m
        return np.concatenate(out)


@dataclass(frozen=True, eq=False)
class Base:
    """A model fitted with each stretch left out in turn, ready to be given further columns."""

    unseen: Unseen
    index: Array
    target: Array
    factors: list[tuple[tuple[Array, bool], Array]]
    residual: Array

    def extended(self, extra: Array, ridges: Sequence[float]) -> list[Array]:
        """
        Return the unseen residual with further columns, one array (rows,) for every ridge.

        Parameters
        ----------
        extra : array, shape (E, rows)
        ridges : sequence of float
            Prior precision of the further columns.

        """
        labels, own = self.unseen.labels, self.unseen.columns[self.index]
        cross_all, square_all = own @ extra.T, extra @ extra.T
        pull_all = extra @ self.target
        right_all = own @ self.target
        outs = [self.target.copy() for _ in ridges]
        for b in range(int(labels[-1]) + 1):
            low, high = np.searchsorted(labels, [b, b + 1])
            here, mine, aim = extra[:, low:high], own[:, low:high], self.target[low:high]
            cross, square = cross_all - mine @ here.T, square_all - here @ here.T
            pull, right = pull_all - here @ aim, right_all - mine @ aim
            right = right - self.unseen.pull[self.index]
            if self.index.size:
                factor, size = self.factors[b]
                solved = cho_solve(factor, np.column_stack([cross, right]) / size[:, None])
                solved /= size[:, None]
                square = square - cross.T @ solved[:, :-1]
                pull = pull - cross.T @ solved[:, -1]
            for out, ridge in zip(outs, ridges, strict=True):
                more = np.linalg.solve(square + (ridge + 1e-9) * np.eye(here.shape[0]), pull)
                out[low:high] -= more @ here
                if self.index.size:
                    out[low:high] -= (solved[:, -1] - solved[:, :-1] @ more) @ mine
        return outs


def _tether(model: Model) -> Array:
    """
    Return a weak prior precision, shape (K,), that keeps what a few stretches cannot show.

    A vibration that only the first stretch excites has no frequency in the others.
    """
    sizes = [np.maximum(np.abs(e.coordinates()), e.coordinate_scales()) for e in model.found]
    return 1.0 / (TETHER * np.concatenate([np.zeros(0), *sizes])) ** 2


def _without(model: Model, k: int) -> Model:
    return model.with_found(model.found[:k] + model.found[k + 1 :])


def ratio_interval(before: Array, after: Array, labels: Array) -> tuple[float, tuple[float, float]]:
    """
    Return RMS after over before and its 95 % interval, by leaving out one stretch at a time.

    Jackknife over stretches, so that neighbouring samples do not count as independent.

    Parameters
    ----------
    before, after : array, shape (samples,)
        Squared errors on unseen data.
    labels : array of int, shape (samples,)

    """
    ratio = float(np.sqrt(after.mean() / max(before.mean(), 1e-300)))
    names = np.unique(labels)
    if names.size < 3:
        spread = ratio / np.sqrt(2.0 * max(before.size, 2))
        return ratio, (max(ratio - 2.0 * spread, 0.0), ratio + 2.0 * spread)
    logs = []
    for name in names:
        keep = labels != name
        logs.append(0.5 * np.log(max(after[keep].mean(), 1e-300) / max(before[keep].mean(), 1e-300)))
    k = names.size
    error = float(np.sqrt((k - 1) / k * ((np.array(logs) - np.mean(logs)) ** 2).sum()))
    reach = 2.36 * error  # Student t, 7 degrees of freedom
    return ratio, (ratio * float(np.exp(-reach)), ratio * float(np.exp(reach)))
