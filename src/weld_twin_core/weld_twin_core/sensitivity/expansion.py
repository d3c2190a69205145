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

from collections.abc import Sequence
from dataclasses import dataclass, replace
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

    def rest(self, draws: Array) -> tuple[Array, NDArray[np.intp], NDArray[np.intp]]:
        """
        Return what the slope leaves of draws (D, P) at the path points (K,) where it leaves anything.

        Rows (B, K) of the draws that differ, which of them each draw is (D,), and the points.
        """
        different, row = _different(draws[:, self.columns])
        remaining = _displacement(self.study, self.joint, self.tolerances, different)
        remaining -= different @ self.slope
        where = np.flatnonzero(np.abs(remaining).max(axis=0) > _NOTHING)
        return remaining[:, where], row, where


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
        places = [where for _, _, where in result]
        somewhere = np.zeros(self.study.samples, dtype=bool)
        for where in places:
            somewhere[where] = True
        order = np.argsort(somewhere, kind='stable')
        place = np.argsort(order) - (self.study.samples - int(somewhere.sum()))
        lever = np.zeros((3, sum(w.size for w in places), int(somewhere.sum())))
        start = 0
        for where, moved in zip(places, self.moved, strict=True):
            rows = np.arange(start, start + where.size)
            lever[:, rows, place[where]] = moved[:, where]
            start += where.size
        shapes = np.ascontiguousarray(self.shapes[:, :, order])
        return _Remainder(order, shapes, [(rest, row) for rest, row, _ in result], lever)

    def _deviations(self, draws: Array, remaining: _Remainder, chunk: slice) -> Array:
        x = np.ascontiguousarray((draws / self.scale).T)
        first, second = self.products
        features = np.concatenate([x, x[first] * x[second]])
        out: Array = (features.T @ self.weights) @ remaining.shapes
        if remaining.lever.size:
            rests = np.concatenate([rest[row[chunk]] for rest, row in remaining.rests], axis=1)
            out[:, :, out.shape[2] - remaining.lever.shape[2] :] += rests @ remaining.lever
        return out


class _Remainder(NamedTuple):
    """
    What the slopes leave of some draws.

    ``order`` of the path points (N,) puts those where anything is left last, K of them; ``shapes``
    are in it. ``rests`` are rows of displacements of a joint, and which of them each draw has; S columns
    in all. ``lever`` (3, S, K) is how far each moves the tool there.
    """

    order: NDArray[np.intp]
    shapes: Array
    rests: list[tuple[Array, NDArray[np.intp]]]
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
