# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Displacements that depend on the motion before: play and lag of one joint, for many draws."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..effects import REGISTRY, Effect, Stage
from ..twin.memory import Picker, in_series, run_all
from ..twin.twin import Twin
from .seam_study import Study
from .tolerance import Tolerance, with_draws

MEMORY = (Stage.SERVO, Stage.PLAY)
_NOTHING = 1e-15
"""Below this displacement [rad or m] nothing is left to carry."""
_STRAIGHT = 1e-10
"""How far [rad or m] a displacement may be from the straight line between two knots: at the end of
an arm of a metre that is a tenth of a nanometre, a millionth of what play does there."""
_COARSE = 64
"""Even steps that a table begins with; each is halved where the displacement bends."""
_HALVINGS = 24
"""Halvings after which steps are below what is left of the numbers' precision."""
_KNOTS = 4096
"""Knots beyond which a table costs more than the draws it is for: a long recording of a joint
that turns often bends at very many widths."""


class Rest(NamedTuple):
    """
    What the slope leaves of the displacements by some draws, at the path points where it does.

    ``table`` (B, K) holds it at some values, ``rise`` (B, K) how much the next value adds, or
    None; a draw (D,) is the ``row`` and its ``part`` of the way to the next.
    """

    table: Array
    rise: Array | None
    row: NDArray[np.intp]
    part: Array | None

    def of(self, draws: slice) -> Array:
        """Return the displacements of some of the draws, shape (D, K)."""
        row = self.row[draws]
        out = self.table[row]
        if self.rise is not None and self.part is not None:
            more = self.rise[row]
            more *= self.part[draws, None]
            out += more
        return out


@dataclass(frozen=True, eq=False)
class Remembered:
    """The memory of one joint."""

    study: Study
    joint: int
    columns: tuple[int, ...]
    """Which tolerances of the study are its own, M of them."""
    tolerances: tuple[Tolerance, ...]
    slope: Array
    """Displacement per unit of each at its typical size, shape (M, N)."""

    def remainder(self, own: Array) -> Array:
        """Return what the slope leaves of the displacements by draws (D, M), shape (D, N)."""
        out = _displacement(self.study, self.joint, self.tolerances, own)
        out -= own @ self.slope
        return out

    @cached_property
    def table(self) -> tuple[Array, Array] | None:
        """Return the one tolerance's values (B,) and rests (B, N), straight between, if few bends do."""
        if len(self.columns) != 1:
            return None
        ends = self.tolerances[0].distribution.values([0.0, 1.0])
        return _straight_between(lambda x: self.remainder(x[:, None]), *ends)

    def rest(self, draws: Array) -> tuple[Rest, NDArray[np.intp]]:
        """Return what the slope leaves of draws (D, P), and at which path points (K,)."""
        own = draws[:, self.columns]
        if self.table is not None:
            knots, one = self.table[0], own[:, 0]
            if np.all((knots[0] <= one) & (one <= knots[-1])):
                row = np.clip(np.searchsorted(knots, one, 'right') - 1, 0, knots.size - 2)
                part = (one - knots[row]) / (knots[row + 1] - knots[row])
                where, table, rise = self._where_any
                return Rest(table, rise, row, part), where
        different, row = _different(own)
        remaining = self.remainder(different)
        where = _somewhere(remaining)
        return Rest(remaining[:, where], None, row, None), where

    @cached_property
    def _where_any(self) -> tuple[NDArray[np.intp], Array, Array]:
        """Return the path points where the table has anything, and the table and its rise there."""
        assert self.table is not None
        values = self.table[1]
        where = _somewhere(values)
        table = np.ascontiguousarray(values[:, where])
        return where, table[:-1], np.diff(table, axis=0)


def _somewhere(values: Array) -> NDArray[np.intp]:
    """Return the columns of (B, N) that hold anything."""
    return np.flatnonzero(np.abs(values).max(axis=0) > _NOTHING)


def _straight_between(
    function: Callable[[Array], Array], low: float, high: float
) -> tuple[Array, Array] | None:
    """Return knots (B,) and values (B, N), straight between to `_STRAIGHT`; None for too many."""
    knots = np.linspace(low, high, _COARSE + 1)
    values = function(knots)
    first = np.arange(_COARSE)
    for _ in range(_HALVINGS):
        middle = 0.5 * (knots[first] + knots[first + 1])
        between = function(middle)
        off = np.abs(between - 0.5 * (values[first] + values[first + 1])).max(axis=1)
        bent = off > _STRAIGHT
        if not bent.any():
            break
        if knots.size + bent.sum() > _KNOTS:
            return None
        at = first[bent] + 1
        knots = np.insert(knots, at, middle[bent])
        values = np.insert(values, at, between[bent], axis=0)
        # Both halves of a step that was halved are looked at again; all others are straight.
        place = at - 1 + np.arange(at.size)
        first = np.stack([place, place + 1], axis=1).ravel()
    return _needed(knots, values)


def _needed(knots: Array, values: Array) -> tuple[Array, Array]:
    """Return the knots where something bends, and the two ends."""
    inner = knots[1:-1]
    part = ((inner - knots[:-2]) / (knots[2:] - knots[:-2]))[:, None]
    line = values[:-2] + part * (values[2:] - values[:-2])
    bends = np.abs(values[1:-1] - line).max(axis=1) > 0.01 * _STRAIGHT
    keep = np.concatenate([[True], bends, [True]])
    return knots[keep], values[keep]


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
    """Return the memory of every joint that has tolerances of it, slopes at their sizes (P,)."""
    columns: dict[int, list[int]] = {}
    for k, tolerance in enumerate(tolerances):
        if REGISTRY[tolerance.effect].stage in MEMORY:
            columns.setdefault(study.robot.index(tolerance.site), []).append(k)
    out = []
    for joint, members in columns.items():
        own = tuple(tolerances[k] for k in members)
        size = scale[members]
        slope = _displacement(study, joint, own, np.diag(size)) / size[:, None]
        out.append(Remembered(study, joint, tuple(members), own, slope))
    return tuple(out)


def _displacement(
    study: Study, joint: int, tolerances: Sequence[Tolerance], draws: Array
) -> Array:
    """Return displacements (D, N) of a joint by draws (D, M) beyond those of the known effects."""
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
