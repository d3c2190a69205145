# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Displacements that depend on the motion before: play and lag of one joint, for many draws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..effects import REGISTRY, Effect, Stage
from ..twin.memory import in_series, run_all
from ..twin.resampling import Picker
from ..twin.twin import Twin
from .seam_study import Study
from .tolerance import Tolerance, with_draws

MEMORY = (Stage.SERVO, Stage.PLAY)
_NOTHING = 1e-15
"""Below this displacement [rad or m] nothing is left to carry."""


class Rest(NamedTuple):
    """
    What the slope leaves: displacements of every different draw, shape (U, N).

    ``row`` says which of them a draw has, shape (D,).
    """

    table: Array
    row: NDArray[np.intp]

    @property
    def where(self) -> NDArray[np.bool_]:
        """Return at which path points anything is left, shape (N,)."""
        found: NDArray[np.bool_] = np.abs(self.table).max(axis=0) > _NOTHING
        return found


@dataclass(frozen=True, eq=False)
class Remembered:
    """
    The memory of one joint.

    Attributes
    ----------
    joint : int
    columns : tuple of int
        Which tolerances of the study are its own, M of them.
    tolerances : tuple of Tolerance
        These.
    slope : array, shape (M, N)
        Displacement per unit of each at its typical size.

    """

    joint: int
    columns: tuple[int, ...]
    tolerances: tuple[Tolerance, ...]
    slope: Array

    def rest(self, study: Study, draws: Array) -> Rest:
        """Return what the slope leaves of the displacements by draws, shape (D, P)."""
        own, row = _different(draws[:, self.columns])
        left = displacement(study, self.joint, self.tolerances, own)
        left -= own @ self.slope
        return Rest(left, row)


def _different(draws: Array) -> tuple[Array, NDArray[np.intp]]:
    """Return the rows that differ and which of them each is; Sobol's design repeats them often."""
    if draws.shape[1] == 1:  # sorting numbers is several times faster than sorting rows
        values, row = np.unique(draws[:, 0], return_inverse=True)
        return values[:, None], row
    values, row = np.unique(draws, axis=0, return_inverse=True)
    return values, row.ravel()


def remembered(
    study: Study, tolerances: Sequence[Tolerance], scale: Array
) -> tuple[Remembered, ...]:
    """
    Return the memory of every joint that has tolerances of it.

    Parameters
    ----------
    study : Study
    tolerances : sequence of Tolerance, length P
    scale : array, shape (P,)
        Typical size of each, in its unit; slopes are taken at it.

    """
    columns: dict[int, list[int]] = {}
    for k, tolerance in enumerate(tolerances):
        if REGISTRY[tolerance.effect].stage in MEMORY:
            columns.setdefault(study.robot.index(tolerance.site), []).append(k)
    out = []
    for joint, members in columns.items():
        own = tuple(tolerances[k] for k in members)
        size = scale[members]
        slope = displacement(study, joint, own, np.diag(size)) / size[:, None]
        out.append(Remembered(joint, tuple(members), own, slope))
    return tuple(out)


def displacement(study: Study, joint: int, tolerances: Sequence[Tolerance], draws: Array) -> Array:
    """
    Return displacements of a joint, shape (D, N) [rad or m], beyond those of the known effects.

    Parameters
    ----------
    study : Study
    joint : int
        Counted from 0.
    tolerances : sequence of Tolerance, length M
        Of effects with memory on that joint.
    draws : array, shape (D, M)
        In the units of the tolerances.

    """
    name = study.robot.joint_names[joint]
    known = tuple(e for e in study.known if e.stage in MEMORY and e.site == name)
    drawn = with_draws(known, tolerances, draws)
    return _displaced(study, joint, drawn) - _displaced(study, joint, known)


def _displaced(study: Study, joint: int, effects: Sequence[Effect]) -> Array:
    view = Twin(study.robot).joint_view(study.recording)
    alone = in_series(effects)
    if not alone:
        return np.zeros((1, 1))
    if len(alone) == 1:  # the other joints stay: all of them, for every draw, would be copied
        shift, _ = alone[0][1].run(view)
        moved = shift['q', joint][..., None]
    else:
        moved = np.asarray(run_all(effects, view, False)[0])[..., joint : joint + 1]
    if study.at is not None:
        moved = Picker(study.recording.joints, study.at).take(moved)
    return np.atleast_2d(moved[..., 0])
