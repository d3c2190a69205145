# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How an error scatters: the distribution of one uncertain parameter."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from ..arrays import Array
from ..errors import ModelError


def _below_triangle(value: float, low: float, mode: float, high: float) -> float:
    if value <= low or value >= high:
        return float(value >= high)
    if value < mode:
        return (value - low) ** 2 / ((high - low) * (mode - low))
    return 1.0 - (high - value) ** 2 / ((high - low) * (high - mode))


def _in_triangle(p: Array, low: float, mode: float, high: float) -> Array:
    rise, fall = (mode - low) * (high - low), (high - mode) * (high - low)
    rising, falling = low + np.sqrt(p * rise), high - np.sqrt((1.0 - p) * fall)
    return np.where(p * (high - low) < mode - low, rising, falling)


class _Law(NamedTuple):
    """A kind of distribution, by the names of its numbers."""

    names: tuple[str, ...]
    below: Callable[..., Any]
    """From a value and the numbers to the probability below it."""
    at: Callable[..., Array]
    """From probabilities (...) and the numbers to values."""


_LAWS = {
    'normal': _Law(
        ('mean', 'std'), lambda x, m, s: ndtr((x - m) / s), lambda p, m, s: m + s * ndtri(p)
    ),
    'uniform': _Law(
        ('low', 'high'),
        lambda x, a, b: np.clip((x - a) / (b - a), 0.0, 1.0),
        lambda p, a, b: a + (b - a) * p,
    ),
    'triangular': _Law(('low', 'mode', 'high'), _below_triangle, _in_triangle),
    'lognormal': _Law(
        ('median', 'spread'),
        lambda x, m, s: ndtr(np.log(x / m) / s) if x > 0.0 else 0.0,
        lambda p, m, s: m * np.exp(s * ndtri(p)),
    ),
}
"""Distributions; the spread of a lognormal is the std of the logarithm."""
_DEFAULTS = {'mean': 0.0}
"""Parameters that may be left out."""


@dataclass(frozen=True)
class Distribution:
    """A distribution, cut off at the bounds of the parameter."""

    kind: str
    """One of `_LAWS`."""
    numbers: tuple[float, ...]
    """In the order of its law, in the unit of the parameter."""
    lower: float = -np.inf
    upper: float = np.inf
    """Values outside have no probability."""

    def __post_init__(self) -> None:
        names = _law(self.kind).names
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
            f'{k} {v:g}' for k, v in zip(_law(self.kind).names, self.numbers, strict=True)
        )

    def _mass(self) -> tuple[float, float]:
        """Return the probability below the lower and below the upper bound."""
        low, high = (
            float(_law(self.kind).below(end, *self.numbers)) for end in (self.lower, self.upper)
        )
        return low, high

    def values(self, unit: ArrayLike) -> Array:
        """Return the values at probabilities (...) from 0 to 1, in the parameter's unit."""
        low, high = self._mass()
        p = low + (high - low) * np.asarray(unit, dtype=np.float64)
        # The ends of an unbounded distribution are at infinity; no sample may land there.
        p = np.clip(p, 1e-12, 1.0 - 1e-12)
        return np.asarray(_law(self.kind).at(p, *self.numbers))

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
        numbers = dict(zip(_law(self.kind).names, map(float, self.numbers), strict=True))
        return {'distribution': self.kind, **numbers}

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any], lower: float, upper: float) -> Distribution:
        """Build one from a tolerance file's keys, within bounds; ModelError where a key is wrong."""
        kind = str(data.get('distribution', 'normal'))
        names = _law(kind).names
        unknown = sorted(set(map(str, data)) - {'distribution', *names})
        if unknown:
            raise ModelError(f'a {kind} distribution takes {", ".join(names)}, not {unknown[0]!r}')
        try:
            numbers = tuple(float({**_DEFAULTS, **data}[key]) for key in names)
        except KeyError as error:
            raise ModelError(f'a {kind} distribution needs the key {error}') from None
        except (TypeError, ValueError):
            raise ModelError(f'the numbers of a {kind} distribution must be numbers') from None
        return cls(kind, numbers, lower, upper)


def _law(kind: str) -> _Law:
    if kind not in _LAWS:
        raise ModelError(f'a distribution must be one of {", ".join(_LAWS)}, got {kind!r}')
    return _LAWS[kind]


_MIDPOINTS = (np.arange(2000) + 0.5) / 2000.0
"""Probabilities at which mean and deviation are summed."""


@lru_cache(maxsize=1024)
def _moments(one: Distribution) -> tuple[float, float]:
    """Return mean and standard deviation; a study asks for those of its tolerances at every step."""
    values = one.values(_MIDPOINTS)
    return float(values.mean()), float(values.std())
