# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
r"""
The paper's local study: what one small error does, by the analytic derivative and by differences.

The paper's coefficient is :math:`S_p = \partial D / \partial p` with :math:`D = \|\Delta x\|`
(V.i). Without errors D is the tip of a cone and has no derivative, only a slope to either side,
equal to :math:`\|\partial x / \partial p\|`; that slope is what ``analytic`` and
``forward`` compare. At an error of typical size D is smooth, and its two-sided derivative is
compared there as well.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arm.chain import jacobian
from ..arrays import Array
from ..effects import REGISTRY
from ..twin.twin import Twin
from .evaluate import exact_deviations
from .expansion import MEMORY
from .seam_study import Study
from .tolerance import Tolerance, places, with_draws

_FORWARD = 1e-4
"""Step of the difference at no error, in parts of the tolerance."""
_FORWARD_OF_MEMORY = 1e-6
"""The same for play and lag, which must be crossed within the first sample of the motion."""
_CENTRAL = 1e-3
"""Step of the two-sided differences, in parts of the tolerance."""
_KINK = 1e-2
"""One-sided slopes that differ by this part of the largest belong to a kink."""


@dataclass(frozen=True, eq=False)
class LocalSensitivity:
    """Sensitivities of P parameters at N path points."""

    tolerances: tuple[Tolerance, ...]
    weights: Array
    """Arc length that belongs to each path point, as a part of all, shape (N,)."""
    length: float
    """[m]"""
    vectors: Array
    """Analytic d position / d parameter in seam axes, shape (P, N, 3) [m per unit]."""
    turns: Array
    """Size of the analytic d orientation / d parameter, shape (P, N) [rad per unit]."""
    forward: Array
    """D of a small error over the error, as the paper has it, shape (P, N) [m per unit]."""
    offset_analytic: Array
    offset_difference: Array
    """dD/dp at an error of typical size, and its two-sided difference, shape (P, N) [m per unit];
    NaN where D has a kink there, as it has at the path point where a gap of that width is just
    crossed."""

    @property
    def analytic(self) -> Array:
        """Return the slope of D at no error, shape (P, N) [m per unit]."""
        return np.asarray(np.linalg.norm(self.vectors, axis=-1))

    @property
    def peak(self) -> Array:
        """Return the slope of the largest D of the seam, shape (P,) [m per unit]."""
        return np.asarray(self.analytic.max(axis=1))

    @property
    def normalized(self) -> Array:
        """Return the slope of D_norm, shape (P,) [per unit]."""
        return self.peak / self.length

    @property
    def rms(self) -> Array:
        """Return the rms of the slope over the arc length, shape (P,) [m per unit]."""
        return np.asarray(np.sqrt((self.analytic**2 * self.weights).sum(axis=1)))

    @property
    def disagreement(self) -> Array:
        """Return the largest difference of the two slopes over the peak, shape (P,)."""
        return _relative(self.forward - self.analytic, self.peak)

    @property
    def offset_disagreement(self) -> Array:
        """Return the same at an error of typical size, shape (P,)."""
        return _relative(self.offset_difference - self.offset_analytic, self.peak)

    @property
    def contribution(self) -> Array:
        """Return the rms deviation that the scatter of each parameter makes, shape (P,) [m]."""
        size = np.array(
            [np.hypot(t.distribution.mean, t.distribution.std) for t in self.tolerances]
        )
        return np.asarray(self.rms * size)

    def groups(self, by: str = 'effect') -> dict[str, float]:
        """Return contributions by 'effect' or 'site', root sum of squares, largest first [m]."""
        square: dict[str, float] = {}
        for tolerance, value in zip(self.tolerances, self.contribution, strict=True):
            key = getattr(tolerance, by)
            square[key] = square.get(key, 0.0) + float(value) ** 2
        return dict(sorted(((k, v**0.5) for k, v in square.items()), key=lambda kv: -kv[1]))

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers, the strongest contribution first."""
        order = np.argsort(-self.contribution, kind='stable')
        rows = [self._row(int(k)) for k in order]
        return {
            'compared': 'slope of D at no error (right-hand); dD/dp at one tolerance',
            'parameters': rows,
            'by_effect_m': self.groups('effect'),
            'by_joint_m': self.groups('site'),
        }

    def _row(self, k: int) -> Mapping[str, Any]:
        tolerance = self.tolerances[k]
        return {
            'name': tolerance.name,
            'unit': tolerance.unit,
            'S_analytic_peak_m': float(self.peak[k]),
            'S_difference_peak_m': float(self.forward[k].max()),
            'S_rms_m': float(self.rms[k]),
            'S_norm': float(self.normalized[k]),
            'disagreement': float(self.disagreement[k]),
            'disagreement_at_tolerance': float(self.offset_disagreement[k]),
            'S_turn_peak_rad': float(self.turns[k].max()),
            'tolerance': tolerance.distribution.to_mapping(),
            'contribution_m': float(self.contribution[k]),
        }


def _relative(difference: Array, scale: Array) -> Array:
    # A joint whose axis runs through the tool point does not move it; rounding is no slope.
    return np.asarray(np.nanmax(np.abs(difference), axis=1) / np.maximum(scale, 1e-9))


def arc_weights(s: Array) -> Array:
    """Return the part of the way, of arc lengths (N,) [m], that belongs to each path point, (N,)."""
    steps = np.abs(np.diff(s))
    if not steps.sum() > 0.0:
        return np.full(len(s), 1.0 / len(s))
    each = np.zeros(len(s))
    each[:-1] += 0.5 * steps
    each[1:] += 0.5 * steps
    return np.asarray(each / each.sum())


def local_sensitivity(study: Study, tolerances: Sequence[Tolerance]) -> LocalSensitivity:
    """
    Return how much the tool moves for each unit of every uncertain number.

    Parameters
    ----------
    study : Study
    tolerances : sequence of Tolerance
        Slopes are taken at no error; the forward difference uses the typical size.

    """
    tolerances = tuple(tolerances)
    size = np.array([abs(t.distribution.mean) + t.distribution.std for t in tolerances])
    vectors, turns = _linearised(study, tolerances, np.zeros(len(tolerances)))
    slow = np.array([REGISTRY[t.effect].stage in MEMORY for t in tolerances])
    step = np.where(slow, _FORWARD_OF_MEMORY, _FORWARD) * size
    forward = np.linalg.norm(exact_deviations(study, tolerances, np.diag(step)), axis=-1)
    analytic, difference = _at_tolerance(study, tolerances, size)
    return LocalSensitivity(
        tolerances,
        arc_weights(study.s),
        study.length,
        vectors,
        turns,
        forward / step[:, None],
        analytic,
        difference,
    )


def _linearised(
    study: Study, tolerances: tuple[Tolerance, ...], draws: Array
) -> tuple[Array, Array]:
    """Return d position / d parameter (P, N, 3) in seam axes, and |d orientation| (P, N)."""
    twin = Twin(study.robot, with_draws(study.known, tolerances, draws))
    _, change = twin.linearise(study.recording, study.at)
    place = places(twin.effects, tolerances)
    out = np.zeros((len(tolerances), study.samples, 6))
    out[list(place)] = np.moveaxis(change[:, :, list(place.values())], -1, 0)
    return study.on_seam(out[..., :3]), np.linalg.norm(out[..., 3:], axis=-1)


def _at_tolerance(
    study: Study, tolerances: tuple[Tolerance, ...], size: Array
) -> tuple[Array, Array]:
    """Return dD/dp at an error of typical size, analytic and by differences, (P, N) each."""
    step, at = _CENTRAL * size, np.diag(size)
    here = exact_deviations(study, tolerances, at)
    distance, high, low = (
        np.linalg.norm(exact_deviations(study, tolerances, at + k * np.diag(step)), axis=-1)
        for k in (0.0, 1.0, -1.0)
    )
    slopes = np.zeros(distance.shape)
    for k, tolerance in enumerate(tolerances):
        vectors, _ = _linearised(study, (tolerance,), size[k : k + 1])
        along = (vectors[0] * here[k]).sum(axis=-1)
        np.divide(along, distance[k], out=slopes[k], where=distance[k] > 0.0)
    after, before = (high - distance) / step[:, None], (distance - low) / step[:, None]
    largest = np.abs(slopes).max(axis=1, keepdims=True)
    kink = np.abs(after - before) > _KINK * largest + 1e-9
    return slopes, np.where(kink, np.nan, 0.5 * (after + before))


@dataclass(frozen=True, eq=False)
class _Posture:
    """
    How the arm stands along a seam, shape (N,) each.

    ``condition`` and ``manipulability`` are of the translational Jacobian, whose rows share one
    unit; ``amplification`` is its largest singular value [m/rad].
    """

    condition: Array
    manipulability: Array
    amplification: Array


def posture(study: Study) -> _Posture:
    """Return condition number, manipulability and largest gain along a seam."""
    strength = np.linalg.svd(jacobian(study.robot, study.q)[..., :3, :], compute_uv=False)
    smallest = np.maximum(strength[..., -1], np.finfo(float).tiny)
    gain = np.asarray(strength[..., 0], dtype=np.float64)
    return _Posture(gain / smallest, strength.prod(axis=-1), gain)
