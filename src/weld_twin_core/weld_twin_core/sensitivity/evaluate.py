# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""From draws of the tolerances to what the runs come to, exactly or by the expansion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Array, readonly
from ..errors import ModelError
from .dh_draws import DhDraws, SeamDraws
from .expansion import CHUNK, Expansion, expand, expandable
from .outcome import Outcomes, joined, outcomes
from .seam_study import Study
from .tolerance import Tolerance, with_draws

_VALUES = {
    ('joint_offset', 'offset'): 'theta',
    ('link_offset', 'dd'): 'd',
    ('link_length', 'da'): 'a',
    ('link_twist', 'dalpha'): 'alpha',
}
"""Effect and parameter, and the DH value that it adds to; an offset of a joint turns its row."""


@dataclass(frozen=True, eq=False)
class _DhStudy:
    """A study whose tolerances are all of DH values."""

    study: Study
    tolerances: tuple[Tolerance, ...]
    seam: SeamDraws
    """The nominal robot at the samples of the study."""

    def deviations(self, draws: Array) -> Array:
        """Return the deviations of draws (D, P) in seam axes, shape (3, D, N) [m]."""
        robot = self.study.robot
        values = {
            key: np.repeat(getattr(robot, key)[None], len(draws), axis=0)
            for key in DhDraws._fields
        }
        for column, tolerance in zip(draws.T, self.tolerances, strict=True):
            key = _VALUES[tolerance.effect, tolerance.parameter]
            values[key][:, robot.index(str(tolerance.joint))] += column
        away = self.seam.deviations(DhDraws(**values))
        return np.moveaxis(self.study.on_seam(away), -1, 0)


def _dh_study(study: Study, tolerances: Sequence[Tolerance]) -> _DhStudy | None:
    """Return the fast form of a study, or None where something else than DH values counts."""
    if study.known or any((t.effect, t.parameter) not in _VALUES for t in tolerances):
        return None
    joints = study.recording.joints
    q = joints.q if study.at is None else joints.at(study.at)[0]
    try:
        return _DhStudy(study, tuple(tolerances), SeamDraws(study.robot, q))
    except ModelError:  # modified rows, or joints that slide
        return None


_CHECKED = 32
"""Runs on which the expansion is compared with the exact twin."""
_AGREED = 1e-3
"""Difference, relative to the largest deviation of a run, at which the expansion is not used."""


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
    fast: _DhStudy | None = None
    """Runs draws of nothing but DH values exactly."""

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
        if self.fast is not None:
            return self.fast.deviations(draws)
        return np.moveaxis(exact_deviations(self.study, self.tolerances, draws), -1, 0)

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
        Run every draw exactly: those of nothing but DH values by `dh_draws`, all others
        through the twin.
    seed : int
        Chooses the runs on which the expansion is compared.

    Raises
    ------
    ModelError
        There are no tolerances.

    """
    if not tolerances:
        raise ModelError('a study needs at least one tolerance')
    if exact or not expandable(tolerances):
        return Model(study, tuple(tolerances), None, 0.0, _dh_study(study, tolerances))
    expansion = expand(study, tolerances)
    error = _disagreement(expansion, np.random.default_rng(seed))
    if error > _AGREED:
        return Model(study, tuple(tolerances), None, 0.0, _dh_study(study, tolerances))
    return Model(study, tuple(tolerances), expansion, error)


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
    """
    Return the exact twin's deviations in seam axes, shape (D, N, 3) [m].

    Parameters
    ----------
    study : Study
    tolerances : sequence of Tolerance, length P
    draws : array, shape (D, P)
        In the units of the tolerances.

    """
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
