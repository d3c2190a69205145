# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What models with more or fewer effects predict on stretches they were not fitted on.

The found effects are small, so around the final fit every smaller model is linear: the exact
contribution of each effect is put back into the residual where it is left out, and the coordinates
of those kept are fitted anew on the other stretches.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from .fit import Fit, design
from .gram import Gram
from .problem import Model, Problem, Scale

BLOCKS = 8


@dataclass(frozen=True, eq=False)
class Unseen:
    """
    Predictions of the final model and its parts on unseen stretches.

    Attributes
    ----------
    labels : array, shape (rows,)
        Stretch of every row.
    residual : array, shape (rows,)
        Of the final fit.
    columns : array, shape (P, rows)
        Frames, then the coordinates of every found effect.
    parts : tuple of slice
        Columns of every effect.
    contributions : array, shape (K, rows)
        What each effect takes off the residual, exactly.
    precision, offset : array, shape (P,)
        Prior of every column and where the fit is now, in units of the coordinates.
    scale : Scale
    problem : Problem

    """

    problem: Problem
    scale: Scale
    labels: Array
    residual: Array
    columns: Array
    parts: tuple[slice, ...]
    contributions: Array
    precision: Array
    offset: Array

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
        contributions = [
            problem.whitened(problem.residuals(_without(model, k)), scale) - fit.residual
            for k in range(len(model.found))
        ]
        zero = np.zeros(frames)
        prior = np.zeros(fit.coordinates.size) if precision.size == 0 else precision
        return cls(
            problem, scale, problem.block_labels(BLOCKS), fit.residual, columns, tuple(parts),
            np.array(contributions).reshape(len(parts), fit.residual.size),
            np.concatenate([zero, prior]), np.concatenate([zero, fit.coordinates]),
        )  # fmt: skip

    @property
    def frames(self) -> int:
        """Return the number of nuisance columns."""
        return self.parts[0].start if self.parts else self.columns.shape[0]

    def predict(self, kept: Sequence[int], extra: Array | None = None, ridge: float = 0.0) -> Array:
        """
        Return the residual on every stretch of the model fitted on the others, shape (rows,).

        Parameters
        ----------
        kept : sequence of int
            Effects in the model.
        extra : array, shape (E, rows), optional
            Further columns, with prior precision ``ridge``.

        """
        left_out = [k for k in range(len(self.parts)) if k not in kept]
        target = self.residual + self.contributions[left_out].sum(axis=0)
        index = np.concatenate(
            [np.arange(self.frames), *(np.arange(p.start, p.stop) for p in map(self._part, kept))]
        ).astype(int)
        columns, precision = self.columns[index], self.precision[index]
        offset = self.offset[index]
        if extra is not None:
            columns = np.concatenate([columns, extra])
            precision = np.concatenate([precision, np.full(extra.shape[0], ridge)])
            offset = np.concatenate([offset, np.zeros(extra.shape[0])])
        if columns.shape[0] == 0:
            return target
        total = Gram.of(columns, target)
        everything = np.arange(columns.shape[0])
        out = np.empty_like(target)
        for label in range(int(self.labels[-1]) + 1):
            low, high = np.searchsorted(self.labels, [label, label + 1])
            train = total - Gram.of(columns[:, low:high], target[low:high])
            shifted = Gram(
                train.normal, train.right - precision * offset, train.rss, train.rows, train.size
            )
            step = shifted.solve(everything, precision)
            out[low:high] = target[low:high] - step @ columns[:, low:high]
        return out

    def _part(self, k: int) -> slice:
        return self.parts[k]

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


TRUSTED = 0.2
"""A sample of less weight is an outlier: reported, and left out of every quoted RMS."""


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
