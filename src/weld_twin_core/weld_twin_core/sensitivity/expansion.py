# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Deviations of very many draws at once, by the second-order expansion of the chain.

Tolerances are small: a deviation is the Jacobian times the errors, plus half the Hessian times
their products, and the third order is a millionth of the first. Along a seam all columns of both
live in a space of some twenty shapes, so a run costs a few multiplications with small matrices.
The displacements that play and lag make are not polynomials of their parameters; what their linear
part leaves is run exactly, joint by joint, and carried by the Jacobian.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arm.chain import jacobian
from ..arrays import Array
from ..effects import REGISTRY, Effect, Stage
from ..twin.stages import Picker, in_series, run_all
from ..twin.twin import Twin
from .seam_study import Outcomes, Study, joined, outcomes
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


CHUNK = 30_000
"""Runs times path points worked on at once; a few of such arrays fit the processor's cache."""
_Pairs = tuple[NDArray[np.intp], NDArray[np.intp]]
_BLOCK = 2048
"""Runs whose play and lag are worked out together; larger arrays than these cost page faults."""
_RANK = 1e-6
"""Shapes weaker than this part of the strongest are left out."""


@dataclass(frozen=True, eq=False)
class Expansion:
    """The study around its nominal motion."""

    study: Study
    tolerances: tuple[Tolerance, ...]
    scale: Array
    """Errors are counted in units of these, shape (P,)."""
    products: _Pairs
    """Which two errors every quadratic feature multiplies, shape (F,)."""
    weights: Array
    """From features to strengths of the shapes, shape (P + F, R)."""
    shapes: Array
    """Along, across and normal, shape (3, R, N) [m]."""
    memory: tuple[Remembered, ...]
    moved: Array
    """How far the tool goes with each joint, shape (joints with memory, 3, N)."""

    def deviations(self, draws: Array) -> Array:
        """Return deviations along, across and normal, shape (3, D, N) [m], of draws (D, P)."""
        remaining = self._remainder(draws)
        return self._deviations(draws, remaining, slice(None))[:, :, np.argsort(remaining.order)]

    def outcomes(self, draws: Array) -> Outcomes:
        """Return what runs come to, in chunks of bounded memory."""
        rows = max(1, CHUNK // self.study.samples)
        parts = []
        for start in range(0, len(draws), _BLOCK):
            block = draws[start : start + _BLOCK]
            remaining = self._remainder(block)
            for k in range(0, len(block), rows):
                chunk = slice(k, k + rows)
                off = self._deviations(block[chunk], remaining, chunk)
                parts.append(outcomes(off, self.study.length))
        return joined(parts)

    def _remainder(self, draws: Array) -> _Remainder:
        """Return what the slopes leave, the path points where any joint has something put last."""
        result = [part.rest(draws) for part in self.memory]
        somewhere = np.zeros(self.study.samples, dtype=bool)
        for _, where in result:
            somewhere[where] = True
        order = np.argsort(somewhere, kind='stable')
        place = np.argsort(order) - (self.study.samples - int(somewhere.sum()))
        lever = np.zeros((3, sum(w.size for _, w in result), int(somewhere.sum())))
        start = 0
        for (_, where), moved in zip(result, self.moved, strict=True):
            rows = np.arange(start, start + where.size)
            lever[:, rows, place[where]] = moved[:, where]
            start += where.size
        shapes = np.ascontiguousarray(self.shapes[:, :, order])
        return _Remainder(order, shapes, [rest for rest, _ in result], lever)

    def _deviations(self, draws: Array, remaining: _Remainder, chunk: slice) -> Array:
        x = np.ascontiguousarray((draws / self.scale).T)
        first, second = self.products
        features = np.concatenate([x, x[first] * x[second]])
        out: Array = (features.T @ self.weights) @ remaining.shapes
        if remaining.lever.size:
            rests = np.concatenate([rest.of(chunk) for rest in remaining.rests], axis=1)
            out[:, :, out.shape[2] - remaining.lever.shape[2] :] += rests @ remaining.lever
        return out


class _Remainder(NamedTuple):
    """
    What the slopes leave of some draws.

    ``order`` of the path points (N,) puts those where anything is left last, K of them; ``shapes``
    are in it. ``rests`` are displacements of the joints, S columns in all, and ``lever`` (3, S,
    K) how far each moves the tool there.
    """

    order: NDArray[np.intp]
    shapes: Array
    rests: list[Rest]
    lever: Array


def expandable(tolerances: Sequence[Tolerance]) -> bool:
    """Tell whether every tolerance displaces the chain in proportion, or by memory of a joint."""
    return all(
        REGISTRY[tolerance.effect].stage in MEMORY or _is_linear(tolerance)
        for tolerance in tolerances
    )


def _is_linear(tolerance: Tolerance) -> bool:
    kind = REGISTRY[tolerance.effect]
    parameter = next(p for p in kind.parameters if p.name == tolerance.parameter)
    pointwise = kind.stage not in (Stage.CLOCK, Stage.NOISE)
    return parameter.linear and parameter.differentiable and pointwise


def expand(study: Study, tolerances: Sequence[Tolerance]) -> Expansion:
    """Return the expansion of a study by its tolerances; see `expandable`."""
    tolerances = tuple(tolerances)
    scale = np.array([abs(t.distribution.mean) + t.distribution.std for t in tolerances])
    memory = remembered(study, tolerances, scale)
    products = np.triu_indices(len(tolerances))
    columns = _columns(_Runs(study, tolerances, scale, memory), products)
    flat = columns.reshape(len(columns), -1)
    strength, remaining = np.linalg.eigh(flat @ flat.T)
    remaining = remaining[:, strength > _RANK**2 * strength[-1]]
    shapes = (remaining.T @ flat).reshape(-1, 3, study.samples).swapaxes(0, 1)
    chain = jacobian(study.robot, study.q)
    moved = [study.on_seam(chain[:, :3, part.joint]).T for part in memory]
    return Expansion(
        study,
        tolerances,
        scale,
        products,
        remaining,
        np.ascontiguousarray(shapes),
        memory,
        np.array(moved),
    )


class _Runs(NamedTuple):
    """Exact runs in which play and lag keep to their slopes."""

    study: Study
    tolerances: tuple[Tolerance, ...]
    scale: Array
    memory: tuple[Remembered, ...]

    def deviations(self, steps: Array) -> Array:
        """Return deviations, shape (D, 3, N), of errors in units of the scale, shape (D, P)."""
        rows = max(1, CHUNK // self.study.samples)
        parts = [self._some(steps[k : k + rows]) for k in range(0, len(steps), rows)]
        return np.concatenate(parts)

    def _some(self, steps: Array) -> Array:
        study, draws = self.study, steps * self.scale
        slow = {k for part in self.memory for k in part.columns}
        rest = [k for k in range(len(self.tolerances)) if k not in slow]
        effects = with_draws(study.known, [self.tolerances[k] for k in rest], draws[:, rest])
        twin = Twin(study.robot, effects)
        first = tuple(effect for effect in effects if effect.stage in (*MEMORY, Stage.CLOCK))
        view = Twin(study.robot, first).evaluate(study.recording, study.at).view
        if self.memory:
            moved = np.zeros((len(draws), *view.q.shape))
            for part in self.memory:
                moved[..., part.joint] = draws[:, part.columns] @ part.slope
            view = replace(view, q=view.q + moved)
        position = twin.pointwise(view).poses.position
        deviation = study.on_seam(position - study.nominal.position)
        wide = np.broadcast_to(deviation, (len(draws), *deviation.shape[-2:]))
        return np.asarray(wide.swapaxes(-1, -2))


def _columns(runs: _Runs, pairs: _Pairs) -> Array:
    """Return first and second derivatives by scaled errors, shape (P + F, 3, N)."""
    first, second = pairs
    unit = np.eye(len(runs.tolerances))
    off = first != second
    up, down = runs.deviations(unit), runs.deviations(-unit)
    quadratic = np.empty((len(first), *up.shape[1:]))
    # Deviations vanish without errors, so half the sum of both sides is the pure second order.
    quadratic[~off] = 0.5 * (up + down)
    quadratic[off] = runs.deviations(unit[first[off]] + unit[second[off]])
    quadratic[off] -= up[first[off]] + up[second[off]]
    return np.concatenate([0.5 * (up - down), quadratic])
