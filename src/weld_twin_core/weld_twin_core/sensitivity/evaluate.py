# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
From draws of the tolerances to what the runs come to, exactly or by the expansion.

Whatever constant errors an arm has, a few samples of a motion may determine all others. Products of
what the joints do, (1, cos, sin) of one that turns and (1, q) of one that slides, are the *features*
of a sample. Rows and frames of an arm are constant factors between the joints, so that positions of
any arm are linear in them. Along a smooth seam the features are nearly dependent: as functions of the
sample they span some two dozen dimensions to rounding. Then positions are known from as many samples
by one matrix product. Those samples and that matrix come from a pivoted QR factorisation of the
features [1]_, whose remainder bounds the error.

References
----------
.. [1] H. Cheng et al., "On the compression of low rank matrices", SIAM J. Sci. Comput. 26, 2005
   (the interpolative decomposition); of random mixtures: P.-G. Martinsson, V. Rokhlin, M. Tygert,
   "A randomized algorithm for the decomposition of matrices", ACHA 30, 2011.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr, solve_triangular

from ..arm.robot import Robot
from ..arrays import Array, readonly
from ..effects import REGISTRY, Effect
from ..effects.geometry import ChannelError, FrameError
from ..errors import ModelError
from ..twin.twin import Twin
from .expansion import CHUNK, Expansion, expand, expandable
from .seam_study import Outcomes, Study, joined, outcomes
from .tolerance import Tolerance, with_draws

_CHECKED = 32
"""Runs on which the expansion is compared with the exact twin."""
_AGREED = 1e-3
"""Difference, relative to the largest deviation of a run, at which the expansion is not used."""


class _Few(NamedTuple):
    """
    Samples that determine all others.

    ``spread`` (3, 3 S, N) makes deviations at all samples along, across and normal to the seam
    from those at the ``samples`` (S,) in the world.
    """

    samples: NDArray[np.int_]
    spread: Array


@dataclass(frozen=True, eq=False)
class Model:
    """A study as a function of draws; see `model`."""

    study: Study
    tolerances: tuple[Tolerance, ...]
    expansion: Expansion | None
    """None where every run is exact."""
    error: float
    """Largest difference of a deviation to the exact twin, relative to the largest deviation of
    its run, over the runs compared; 0 for exact runs."""
    few: _Few | None = None
    """Samples at which exact runs are made; None for all."""

    def __call__(self, draws: Array) -> Outcomes:
        """Return what runs come to, draws shape (D, P)."""
        wanted = readonly(draws, (None, len(self.tolerances)), 'draws of the tolerances')
        if self.expansion is not None:
            return self.expansion.outcomes(wanted)
        rows = max(1, CHUNK // self.study.samples)
        parts = []
        for start in range(0, len(wanted), rows):
            parts.append(outcomes(self._exact(wanted[start : start + rows]), self.study.length))
        return joined(parts)

    def _exact(self, draws: Array) -> Array:
        """Return deviations, components first, shape (3, D, N) [m]."""
        if self.few is None:
            return np.moveaxis(exact_deviations(self.study, self.tolerances, draws), -1, 0)
        study, at = self.study, self.few.samples
        twin = Twin(study.robot, with_draws(study.known, self.tolerances, draws))
        away = twin.poses(study.recording, study.t[at]).position - study.nominal.position[at]
        return np.asarray(away.reshape(len(draws), -1) @ self.few.spread)

    def at_probabilities(self, unit: Array) -> Outcomes:
        """Return what runs come to at probabilities of every tolerance, shape (D, P)."""
        return self(draws_at(self.tolerances, unit))


def model(
    study: Study, tolerances: Sequence[Tolerance], *, exact: bool = False, seed: int = 0
) -> Model:
    """
    Return the fastest model of a study that agrees with the exact twin.

    Parameters
    ----------
    study : Study
    tolerances : sequence of Tolerance
    exact : bool
        Run every draw exactly.
    seed : int
        Chooses the runs on which the expansion is compared.

    Raises
    ------
    ModelError
        There are no tolerances.

    """
    if not tolerances:
        raise ModelError('a study needs at least one tolerance')
    if not exact and expandable(tolerances):
        expansion = expand(study, tolerances)
        error = _disagreement(expansion, np.random.default_rng(seed))
        if error <= _AGREED:
            return Model(study, tuple(tolerances), expansion, error)
    return Model(study, tuple(tolerances), None, 0.0, _few(study, tolerances))


def _few(study: Study, tolerances: Sequence[Tolerance]) -> _Few | None:
    """Return the samples that determine all others; None where more than constants is at work."""
    kinds: list[type[Effect]] = [type(effect) for effect in study.known]
    kinds += [REGISTRY[tolerance.effect] for tolerance in tolerances]
    if any(kind.needs or not issubclass(kind, (ChannelError, FrameError)) for kind in kinds):
        return None
    result = _determining(study.robot, study.q)
    if result is None:
        return None
    samples, spread = result
    onto_seam = np.einsum('ns,nij->isjn', spread, study.axes)
    return _Few(samples, onto_seam.reshape(3, -1, study.samples))


def draws_at(tolerances: Sequence[Tolerance], unit: Array) -> Array:
    """
    Return draws at probabilities of every tolerance, shape (D, P), each in its own unit.

    Parameters
    ----------
    tolerances : sequence of Tolerance, length P
    unit : array, shape (D, P)
        Probabilities between 0 and 1.

    """
    columns = [t.distribution.values(unit[:, k]) for k, t in enumerate(tolerances)]
    return np.stack(columns, axis=1)


def exact_deviations(study: Study, tolerances: Sequence[Tolerance], draws: Array) -> Array:
    """Return the exact twin's deviations in seam axes, (D, N, 3) [m], of draws (D, P) in their units."""
    return study.deviations(with_draws(study.known, tolerances, draws))


def _disagreement(expansion: Expansion, rng: np.random.Generator) -> float:
    study, tolerances = expansion.study, expansion.tolerances
    draws = draws_at(tolerances, rng.random((_CHECKED, len(tolerances))))
    exact = np.moveaxis(exact_deviations(study, tolerances, draws), -1, 0)
    off = np.abs(expansion.deviations(draws) - exact).max(axis=(0, 2))
    size = np.abs(exact).max(axis=(0, 2))
    return float((off / np.where(size > 0.0, size, 1.0)).max())


Function = Callable[[Array], Array]
"""A model as a study sees it: probabilities (D, P) in, one number per run (D,) out."""


_ROUNDING = 1e-14
"""Remainder of the features, relative to the strongest, that counts as none."""
_NEGLIGIBLE = 1e-13
"""What features may differ from those determined by a few samples, relative to the largest."""
_MIXTURES = 48
"""Mixtures that stand for all features; a motion with more independent ones is worked on whole."""
_MOST_JOINTS = 8
"""Joints beyond which the features, three times as many for each, are too many."""


def _determining(robot: Robot, q: Array) -> tuple[NDArray[np.int_], Array] | None:
    """
    Return samples, and the matrix (N, S) from values there to values at all of q (N, n).

    The factorisation is of random mixtures of the features, which depend on each other as the
    features do. None if the samples are half of all or more, or if the features themselves differ
    from those so determined by more than rounding.
    """
    if robot.n > _MOST_JOINTS:
        return None
    features = _features(q, robot.prismatic)
    mixing = np.random.default_rng(0).random((_MIXTURES, len(features))) - 0.5
    upper, order = qr(mixing @ features, mode='r', pivoting=True, check_finite=False)
    strength = np.abs(np.diagonal(upper))
    rank = int((strength > _ROUNDING * strength[0]).sum())
    if 2 * rank >= len(q):
        return None
    spread = np.empty((rank, len(q)))
    spread[:, order[:rank]] = np.eye(rank)
    spread[:, order[rank:]] = solve_triangular(upper[:rank, :rank], upper[:rank, rank:])
    off = np.abs(features[:, order[:rank]] @ spread - features).max()
    if off > _NEGLIGIBLE * np.abs(features).max():
        return None
    return order[:rank], np.ascontiguousarray(spread.T)


def _features(q: Array, slides: NDArray[np.bool_]) -> Array:
    """Return the features, shape (F, N), those of the last joint varying fastest."""
    out = np.ones((1, len(q)))
    for x, slide in zip(q.T[::-1], slides[::-1], strict=True):
        own = np.stack([np.ones_like(x), x] if slide else [np.ones_like(x), np.cos(x), np.sin(x)])
        out = (own[:, None] * out[None]).reshape(-1, len(q))
    return out
