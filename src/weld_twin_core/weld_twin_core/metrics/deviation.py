# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
r"""
How far the tool is off: the paper's deviation metrics and those a weld shop asks for.

The paper defines :math:`D_{norm}` twice: as the deviation of every instant over the path length
(eq. II.vi, here `normalized_deviation`) and as the largest deviation over the path length (eq.
III.iv, here `DeviationMetrics.d_norm`, the one meant wherever a single number is given).
:math:`D_{cum}` is a sum over samples (eq. III.iv): it grows with the sample rate and compares only
runs sampled alike; `DeviationMetrics.d_time_m_s`, the integral over time, does not.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike

from ..arm.rotation import angle_between
from ..arrays import Array, increasing, readonly
from ..errors import DataError
from ..motion.seam_frame import path_length, seam_components
from ..twin.poses import Poses


@dataclass(frozen=True)
class DeviationMetrics:
    """
    Deviation of one run; entries are None where the data do not allow them.

    Examples
    --------
    `deviation_metrics` makes it.

    >>> import weld_twin_core as wt
    >>> found = wt.deviation_metrics([[0.0, 0.0, 1e-3]], [[0.0, 0.0, 0.0]])
    >>> found.as_dict()['max_m']
    0.001

    """

    samples: int
    rms_m: float
    mean_m: float
    p95_m: float
    max_m: float
    """Of the length of the deviation, D(t) [m]."""
    d_norm: float | None
    """Largest deviation over path length [-]; None for a path without length."""
    d_cum_m: float
    """Sum of D over the samples [m]."""
    d_time_m_s: float | None
    """Integral of D over time, by trapezoids [m s]; None without stamps."""
    path_length_m: float | None
    """[m]"""
    orientation_rms_rad: float | None
    orientation_max_rad: float | None
    """Of the angle between measured and nominal orientation [rad]."""
    along_rms_m: float | None
    across_rms_m: float | None
    normal_rms_m: float | None
    """Of the components on the seam axes [m]."""

    def as_dict(self) -> dict[str, float | int | None]:
        """Return the fields as plain numbers."""
        return asdict(self)


def deviation(deviations: ArrayLike) -> Array:
    """Return how far the tool is off, shape (...) [m], of deviations (..., 3) from nominal."""
    size: Array = np.linalg.norm(np.asarray(deviations, dtype=np.float64), axis=-1)
    return size


def normalized_deviation(deviations: ArrayLike, path_length_m: float) -> Array:
    """
    Return D(t) over the path length (paper, eq. II.vi), shape (...).

    Parameters
    ----------
    deviations : array_like, shape (..., 3) [m]
        Actual minus nominal position.
    path_length_m : float [m]

    Raises
    ------
    DataError
        The path has no length.

    """
    if not path_length_m > 0.0:
        raise DataError(f'a path of length {path_length_m} m cannot normalise a deviation')
    return deviation(deviations) / path_length_m


def orientation_error(actual: Array, nominal: Array) -> Array:
    """
    Return the angles between orientations, shape (...) [rad].

    Parameters
    ----------
    actual, nominal : array, shape (..., 3, 3)
        Rotation matrices.

    """
    angle: Array = np.linalg.norm(angle_between(actual, nominal), axis=-1)
    return angle


def root_mean_square(values: ArrayLike) -> float:
    """
    Return the root of the mean square of all values, in their unit.

    Parameters
    ----------
    values : array_like, any shape

    """
    return float(np.sqrt(np.mean(np.square(values))))


def deviation_metrics(
    actual: Poses | ArrayLike,
    nominal: Poses | ArrayLike,
    *,
    t: ArrayLike | None = None,
    path_length_m: float | None = None,
    tangent: ArrayLike | None = None,
    normal: ArrayLike | None = None,
) -> DeviationMetrics:
    """
    Return the deviation metrics of one run.

    Parameters
    ----------
    actual, nominal : Poses, or array_like of positions, shape (N, 3) [m]
        Orientation is compared where both have it.
    t : array_like, shape (N,), optional [s]
    path_length_m : float, optional
        Length of the seam; left out, that of the polyline through the nominal positions.
    tangent, normal : array_like, shape (3,) or (N, 3), optional
        Directions of the seam; both or none.

    Raises
    ------
    DataError
        No samples, samples that do not pair, or one seam direction without the other.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> nominal = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]
    >>> actual = [[0.0, 0.0003, 0.0], [0.1, 0.0, 0.0004]]
    >>> found = wt.deviation_metrics(
    ...     actual, nominal, tangent=[1.0, 0.0, 0.0], normal=[0.0, 0.0, 1.0]
    ... )
    >>> print(f'{found.rms_m * 1e6:.0f} um RMS, {found.across_rms_m * 1e6:.0f} um of it across')
    354 um RMS, 212 um of it across

    """
    positions = [p.position if isinstance(p, Poses) else p for p in (actual, nominal)]
    expected = readonly(positions[1], (None, 3), 'nominal positions')
    if len(expected) == 0:
        raise DataError('there are no samples to measure a deviation on')
    off = readonly(positions[0], expected.shape, 'actual positions') - expected
    size = deviation(off)
    length = path_length(expected) if path_length_m is None else float(path_length_m)
    turn = None
    if isinstance(actual, Poses) and isinstance(nominal, Poses):
        turn = orientation_error(actual.rotation, nominal.rotation)
    return DeviationMetrics(
        len(size),
        root_mean_square(size),
        float(size.mean()),
        float(np.percentile(size, 95.0)),
        float(size.max()),
        float(size.max()) / length if length > 0.0 else None,
        float(size.sum()),
        None if t is None else _over_time(size, t),
        length,
        None if turn is None else root_mean_square(turn),
        None if turn is None else float(turn.max()),
        *_on_seam(off, tangent, normal),
    )


def _over_time(size: Array, t: ArrayLike) -> float:
    stamps = increasing(t, 'stamps of the deviation')
    if stamps.shape != size.shape:
        raise DataError(f'{size.size} deviations need as many stamps, got {stamps.size}')
    return float((0.5 * (size[1:] + size[:-1]) * np.diff(stamps)).sum())


def _on_seam(
    off: Array, tangent: ArrayLike | None, normal: ArrayLike | None
) -> tuple[float | None, float | None, float | None]:
    if tangent is None and normal is None:
        return None, None, None
    if tangent is None or normal is None:
        raise DataError('seam components need both the tangent and the normal of the seam')
    along, across, out = seam_components(off, tangent, normal).T
    return root_mean_square(along), root_mean_square(across), root_mean_square(out)


class RunningMetrics:
    """
    D(t), D_norm, D_cum, RMS, mean and max of the pairs so far.

    Parameters
    ----------
    path_length : float [m]
        Length of the seam, for D_norm; 0 takes the way the twin has gone so far.

    """

    def __init__(self, path_length: float = 0.0) -> None:
        self._given = path_length
        self._gone = 0.0
        self._before: Array | None = None
        self._now = 0.0
        self._squares = 0.0
        self._sum = 0.0
        self._largest = 0.0
        self.samples = 0

    def add(self, deviation: Array, twin: Array) -> None:
        """Take a deviation, measured minus twin, and where the twin has the tool, (3,) [m] each."""
        if self._before is not None:
            self._gone += float(np.linalg.norm(twin - self._before))
        self._before = twin
        self._now = float(np.linalg.norm(deviation))
        self._squares += self._now**2
        self._sum += self._now
        self._largest = max(self._largest, self._now)
        self.samples += 1

    def as_dict(self) -> dict[str, float | int]:
        """Return the metrics by the names they have on `/deviation/metrics` [m; D_norm 1]."""
        count = max(self.samples, 1)
        length = self._given or self._gone
        return {
            'D(t)': self._now,
            'D_norm': self._largest / length if length > 0.0 else float('nan'),
            'D_cum': self._sum,
            'RMS': sqrt(self._squares / count),
            'mean': self._sum / count,
            'max': self._largest,
            'path_length': length,
            'samples': self.samples,
        }
