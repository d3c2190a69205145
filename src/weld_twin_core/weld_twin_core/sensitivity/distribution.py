# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How an error scatters: the distribution of one uncertain parameter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from ..arrays import Array
from ..errors import ModelError

_KINDS: dict[str, tuple[str, ...]] = {
    'normal': ('mean', 'std'),
    'uniform': ('low', 'high'),
    'triangular': ('low', 'mode', 'high'),
    'lognormal': ('median', 'spread'),
}
"""Distributions and their numbers; the spread of a lognormal is the std of the logarithm."""
_DEFAULTS = {'mean': 0.0}
"""Parameters that may be left out."""


@dataclass(frozen=True)
class Distribution:
    """A distribution, cut off at the bounds of the parameter."""

    kind: str
    """One of `_KINDS`."""
    numbers: tuple[float, ...]
    """In the order of `_KINDS`, in the unit of the parameter."""
    lower: float = -np.inf
    upper: float = np.inf
    """Values outside have no probability."""

    def __post_init__(self) -> None:
        if self.kind not in _KINDS:
            raise ModelError(
                f'a distribution must be one of {", ".join(_KINDS)}, got {self.kind!r}'
            )
        names = _KINDS[self.kind]
        if len(self.numbers) != len(names) or not np.isfinite(self.numbers).all():
            raise ModelError(
                f'a {self.kind} distribution needs {", ".join(names)}, got {self.numbers}'
            )
        if not self._spread() > 0.0:
            raise ModelError(f'a {self.kind} distribution of {self._text()} does not scatter')
        if not self._mass()[0] < self._mass()[1]:
            raise ModelError(
                f'a {self.kind} distribution of {self._text()} lies outside the bounds '
                f'[{self.lower:g}, {self.upper:g}] of its parameter'
            )

    def _spread(self) -> float:
        first, last = self.numbers[0], self.numbers[-1]
        if self.kind == 'lognormal':
            return last if first > 0.0 else 0.0
        if self.kind == 'triangular' and not first <= self.numbers[1] <= last:
            return 0.0
        return last if self.kind == 'normal' else last - first

    def _text(self) -> str:
        return ', '.join(
            f'{k} {v:g}' for k, v in zip(_KINDS[self.kind], self.numbers, strict=True)
        )

    def _below(self, value: float) -> float:
        """Return the probability below a value."""
        v = self.numbers
        match self.kind:
            case 'normal':
                return float(ndtr((value - v[0]) / v[1]))
            case 'uniform':
                return float(np.clip((value - v[0]) / (v[1] - v[0]), 0.0, 1.0))
            case 'lognormal':
                return float(ndtr(np.log(value / v[0]) / v[1])) if value > 0.0 else 0.0
        return _below_triangle(value, *v)

    def _mass(self) -> tuple[float, float]:
        """Return the probability below the lower and below the upper bound."""
        return self._below(self.lower), self._below(self.upper)

    def values(self, unit: ArrayLike) -> Array:
        """Return the values at probabilities (...) from 0 to 1, in the parameter's unit."""
        low, high = self._mass()
        p = low + (high - low) * np.asarray(unit, dtype=np.float64)
        # The ends of an unbounded distribution are at infinity; no sample may land there.
        p = np.clip(p, 1e-12, 1.0 - 1e-12)
        v = self.numbers
        match self.kind:
            case 'normal':
                return np.asarray(v[0] + v[1] * ndtri(p))
            case 'uniform':
                return np.asarray(v[0] + (v[1] - v[0]) * p)
            case 'lognormal':
                return np.asarray(v[0] * np.exp(v[1] * ndtri(p)))
        rise, fall = (v[1] - v[0]) * (v[2] - v[0]), (v[2] - v[1]) * (v[2] - v[0])
        return np.where(
            p * (v[2] - v[0]) < v[1] - v[0],
            v[0] + np.sqrt(p * rise),
            v[2] - np.sqrt((1.0 - p) * fall),
        )

    @property
    def mean(self) -> float:
        """Return the mean within the bounds."""
        return _moments(self)[0]

    @property
    def std(self) -> float:
        """Return the standard deviation within the bounds."""
        return _moments(self)[1]

    def to_mapping(self) -> dict[str, Any]:
        """Return the keys of a tolerance file."""
        numbers = dict(zip(_KINDS[self.kind], map(float, self.numbers), strict=True))
        return {'distribution': self.kind, **numbers}

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any], lower: float, upper: float) -> Distribution:
        """Build one from a tolerance file's keys, within bounds; ModelError where a key is wrong."""
        kind = str(data.get('distribution', 'normal'))
        if kind not in _KINDS:
            raise ModelError(f'a distribution must be one of {", ".join(_KINDS)}, got {kind!r}')
        unknown = sorted(set(map(str, data)) - {'distribution', *_KINDS[kind]})
        if unknown:
            raise ModelError(
                f'a {kind} distribution takes {", ".join(_KINDS[kind])}, not {unknown[0]!r}'
            )
        values = {**{k: v for k, v in _DEFAULTS.items() if k in _KINDS[kind]}, **data}
        try:
            numbers = tuple(float(values[key]) for key in _KINDS[kind])
        except KeyError as error:
            raise ModelError(f'a {kind} distribution needs the key {error}') from None
        except (TypeError, ValueError):
            raise ModelError(f'the numbers of a {kind} distribution must be numbers') from None
        return cls(kind, numbers, lower, upper)


def _below_triangle(value: float, low: float, mode: float, high: float) -> float:
    if value <= low or value >= high:
        return float(value >= high)
    if value < mode:
        return (value - low) ** 2 / ((high - low) * (mode - low))
    return 1.0 - (high - value) ** 2 / ((high - low) * (high - mode))


_MIDPOINTS = (np.arange(2000) + 0.5) / 2000.0
"""Probabilities at which mean and deviation are summed."""


@lru_cache(maxsize=1024)
def _moments(one: Distribution) -> tuple[float, float]:
    """Return mean and standard deviation; a study asks for those of its tolerances at every step."""
    values = one.values(_MIDPOINTS)
    return float(values.mean()), float(values.std())
