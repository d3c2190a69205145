# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What one diagnosis says of an arm, as numbers that can be added to those of the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, readonly
from ..errors import DataError

_SHOWN = 1e-6
"""Share of the variance before the data that counts as taken away by them: less is a file's rounding."""
_ABSENT = 3.0
"""Standard errors of the diagnoses that name an effect, within which it is taken to be zero in those
that do not name it: it would have been named beyond."""


@dataclass(frozen=True, eq=False)
class Observation:
    """One diagnosis: values of coordinates, and how sure they are; DataError where they do not agree."""

    day: float
    """When it was recorded [days]; the zero is the same for all."""
    names: tuple[str, ...]
    """Of the coordinates, such as 'joint_offset elbow_joint 0'; unique."""
    value: Array
    """SI units, counted from the model that was given, shape (P,)."""
    covariance: Array
    """Shape (P, P)."""
    prior_std: Array
    """What was believed of each before the data, about zero, shape (P,)."""
    steady: frozenset[str] = frozenset()
    """
    Those that stay as they are, such as the unevenness of gears; no change of them is looked for.
    That they are the same in all diagnoses is what makes these comparable: left open in each, a
    curve of a gear takes the place of a zero that was moved.
    """

    def __post_init__(self) -> None:
        count = len(self.names)
        if len(set(self.names)) != count:
            raise DataError('a coordinate comes twice in one diagnosis')
        for name, shape in (
            ('value', (count,)),
            ('covariance', (count,) * 2),
            ('prior_std', (count,)),
        ):
            object.__setattr__(self, name, readonly(getattr(self, name), shape, name))

    def information(self) -> tuple[Array, Array]:
        """Return the data's precision (P, P), and that times value (P,), without the prior."""
        return self._information

    @cached_property
    def _information(self) -> tuple[Array, Array]:
        variance, axes, shown = self._shown
        width = self.prior_std
        # value = variance * (precision of the data) * (what the data say), along each axis
        along = axes.T @ (self.value / width)
        values = np.where(shown > 0.0, along / variance, 0.0)
        precision = (axes * shown) @ axes.T / np.outer(width, width)
        return precision, (axes @ values) / width

    @cached_property
    def _shown(self) -> tuple[Array, Array, Array]:
        """Variances at unit prior, (P,), their axes in columns, and the precision of the data, (P,)."""
        width = self.prior_std
        # At unit prior the posterior variance along a direction is 1 less what the data showed.
        scaled = self.covariance / np.outer(width, width)
        variance, axes = np.linalg.eigh(0.5 * (scaled + scaled.T))
        variance = np.clip(variance, 1e-300, 1.0)
        return variance, axes, np.where(variance < 1.0 - _SHOWN, 1.0 / variance - 1.0, 0.0)

    @cached_property
    def whitening(self) -> Array:
        """Return independent directions (P, L) that data show beyond the prior, precision 1."""
        _, axes, shown = self._shown
        live = shown > 1.0
        return np.asarray(axes[:, live] / np.sqrt(shown[live]) * self.prior_std[:, None])


@dataclass(frozen=True, eq=False)
class Series:
    """Observations over the same coordinates, in the order of time."""

    days: Array
    """Shape (W,)."""
    names: tuple[str, ...]
    precision: Array
    """Shape (W, P, P)."""
    weighted: Array
    """Precision times value, shape (W, P)."""
    prior: Array
    """Precision of what was believed before any of them, shape (P,)."""
    changing: NDArray[np.int_]
    """Places of the coordinates that may change, shape (C,)."""
    whitening: tuple[tuple[NDArray[np.int_], Array], ...]
    """Of every observation, the places of its coordinates and its `Observation.whitening`."""
    shapes: dict[tuple[str, int], tuple[Array, Array, Array]] = field(default_factory=dict)
    """Sums over the observations of every shape that was tried: the same whatever was found."""


def series_of(observations: Sequence[Observation]) -> Series:
    """
    Return observations over all their coordinates.

    An effect that only some diagnoses name is taken to be zero in the others, as surely as three
    standard errors of those that name it. Of what is steady, one that lacks it says nothing.

    Raises DataError: there are none, or two are of the same instant.
    """
    if not observations:
        raise DataError('there is no diagnosis yet; add some first')
    ordered = sorted(observations, key=lambda each: each.day)
    days = np.array([each.day for each in ordered])
    if (np.diff(days) <= 0.0).any():
        raise DataError('two diagnoses are of the same instant; give each its own date')
    names = tuple(dict.fromkeys(name for each in ordered for name in each.names))
    place = {name: k for k, name in enumerate(names)}
    width = np.zeros(len(names))
    error: list[list[float]] = [[] for _ in names]
    precision = np.zeros((days.size, len(names), len(names)))
    products = np.zeros((days.size, len(names)))
    whitening = []
    for w, each in enumerate(ordered):
        at = np.array([place[name] for name in each.names], int)
        precision[w][np.ix_(at, at)], products[w, at] = each.information()
        whitening.append((at, each.whitening))
        width[at] = np.maximum(width[at], each.prior_std)
        for k, std in zip(at, np.sqrt(np.diag(each.covariance)), strict=True):
            error[k].append(float(std))
    steady = frozenset().union(*(each.steady for each in ordered))
    changing = [k for k, name in enumerate(names) if name not in steady]
    for k in changing:
        for w, each in enumerate(ordered):
            if names[k] not in each.names:
                precision[w, k, k] += 1.0 / (_ABSENT * float(np.median(error[k]))) ** 2
    return Series(
        days,
        names,
        precision,
        products,
        1.0 / width**2,
        np.array(changing, dtype=int),
        tuple(whitening),
    )
