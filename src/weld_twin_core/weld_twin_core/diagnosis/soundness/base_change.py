# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a change in time of base, tool or a joint would explain, beyond everything that is constant.

Residuals of an arm follow its pose, and poses follow time, so any motion looks a little like a
change of the frame. Constant frames, all that the library has of joints and links but changes in time,
and the instrument's scale are therefore projected out, to first order, before a change is tried.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from ...arrays import Array
from ...effects.measurement import MeasurementScale
from ...effects.plausible import spreads
from ...twin.features import Features
from ..algebra.definite import outside, span_of
from ..algebra.fit import HUBER
from ..algebra.independent_rows import effective_share
from ..algebra.motions import moved_most, plain_causes
from ..algebra.problem import Model, Problem, Scale
from .lag import KEPT
from .limits import FEW, TINY, WIDER

LASTING = ('constant', 'angle', 'direction', 'speed', 'acceleration', 'load', 'temperature')
"""What errors of an arm depend on that are no change in time."""
FEWEST = 12.0
"""Independent rows that are counted at the least: two frames have as many numbers."""
TIED = 1e-6
"""Pull of a change to zero, in units of its columns: decides what data leave open."""
CONSTANTS = np.geomspace(0.05, 0.7, 13)
"""Time constants of settling, as shares of the recording."""


@dataclass(frozen=True, eq=False)
class Rest:
    """What frames and arm leave of every sample, and what may have changed while it was measured."""

    residual: Array  # shape (M, c) in units of noise
    basis: Array  # orthonormal: what frames and arm can explain, shape (P, M c)
    things: Mapping[str, tuple[Array, Array]]
    """What 'base', 'tool' and 'joints' do to every sample, whitened, and to its position [m]."""
    rows: tuple[int, ...]  # components of a sample, by recording
    samples: tuple[int, ...]  # by recording
    noise: float  # unit of the positions [m]

    def rms(self, k: int) -> float:
        """Return the RMS distance [m] that is left of recording k, as a lag counts it."""
        own = np.sort((self.residual[self.recording == k][:, :3] ** 2).sum(axis=1))
        return self.noise * float(np.sqrt(own[: max(int(KEPT * own.size), 1)].mean()))

    @cached_property
    def recording(self) -> NDArray[np.int_]:
        return np.repeat(np.arange(len(self.samples)), self.samples)

    @property
    def far(self) -> float:
        """Return the sum of squares of positions that is left; turns may be nothing but noise."""
        return float((self.residual[:, :3] ** 2).sum())

    @cached_property
    def share(self) -> float:
        own = [self.residual[self.recording == k][:, :c].ravel() for k, c in enumerate(self.rows)]
        return effective_share(np.concatenate(own), self.rows, self.samples)

    def change(self, thing: str, some: slice = slice(None)) -> Change:
        """Return a change of base, tool or joints, or of some of their columns."""
        columns, metres = self.things[thing]
        return Change(self, columns[:, :, some], metres[:, :, some])


@dataclass(frozen=True, eq=False)
class Change:
    """One thing that may have changed in some shape of time, (M,), against what is left."""

    rest: Rest
    columns: Array
    metres: Array

    @cached_property
    def _terms(self) -> tuple[Array, Array, Array]:
        """Return every sample's share of right hand side (M, i), overlap (M, p, i), normal."""
        turned = np.swapaxes(self.columns, 1, 2)
        right = np.matmul(turned, self.rest.residual[:, :, None])[:, :, 0]
        basis = self.rest.basis.reshape(-1, *self.rest.residual.shape).transpose(1, 0, 2)
        overlap = np.matmul(basis, self.columns)
        return right, overlap, np.matmul(turned, self.columns)

    def _summed(self, shapes: Array) -> tuple[Array, Array]:
        """Return right hand sides (S, i) and normal matrices (S, i, i) of shapes, (S, M)."""
        right, overlap, normal = self._terms
        count, size = shapes.shape[0], right.shape[1]
        across = (shapes @ overlap.reshape(len(overlap), -1)).reshape(count, -1, size)
        own = (shapes**2 @ normal.reshape(len(normal), -1)).reshape(count, size, size)
        return shapes @ right, own - np.matmul(np.swapaxes(across, 1, 2), across)

    def gains(self, shapes: Array) -> Array:
        """Return the sum of squares that each of several shapes, (S, M), explains, (S,)."""
        right, normal = self._summed(shapes)
        return np.asarray((right * _solved(right, normal)).sum(axis=1))

    def best(self, shapes: Sequence[Array]) -> Array:
        return shapes[int(self.gains(np.array(shapes)).argmax())]

    def step_gains(self, k: int) -> Array:
        """Return the gain of a step before every sample of recording k, shape (M_k,)."""
        mine = self.rest.recording == k
        # Sums over each sample and all later ones.
        right, overlap, normal = (np.cumsum(t[mine][::-1], axis=0)[::-1] for t in self._terms)
        normal = normal - np.matmul(np.swapaxes(overlap, 1, 2), overlap)
        return np.asarray((right * _solved(right, normal)).sum(axis=1))

    def size(self, shape: Array) -> float:
        """Return the RMS motion [m] of the measured points for the fitted change."""
        active = 2.0 * np.abs(shape) > FEW * np.abs(shape).max()
        moved = self.metres[active] @ _solved(*self._summed(shape[None]))[0]
        return float(np.sqrt((moved**2).sum(axis=1).mean()))

    def taken_out(self, shape: Array) -> Rest:
        """Return what is left once the change is fitted, too."""
        rest = self.rest
        new = span_of(outside(_rows(self.columns * shape[:, None, None]), rest.basis))
        remaining = outside(rest.residual.reshape(1, -1), new).reshape(rest.residual.shape)
        return replace(rest, residual=remaining, basis=np.concatenate([rest.basis, new]))

    def log_bayes_factor(self, shape: Array) -> float:
        """
        Return the evidence for a change.

        Noise of positions and of turns, strays among them, and how many rows are independent, are
        those the change leaves: a step makes residuals that hang together, and hides strays.
        """
        rest, after = self.rest, self.taken_out(shape)
        # Of few stations frames and arm take most rows up; those tell nothing for a change.
        size = float(sum(c * m for c, m in zip(rest.rows, rest.samples, strict=True)))
        free = max(1.0 - len(after.basis) / size, 0.0)
        total, fall = 0.0, 0.0
        for part in (slice(0, 3), slice(3, 6)):
            weight = _of_strays(after.residual[:, part])
            each = ((c.residual[:, part] ** 2).sum(axis=1) for c in (rest, after))
            before, remaining = (float(weight @ square) for square in each)
            if before > 0.0:
                count = max(after.share * free * after.residual[:, part].size, FEWEST)
                fall += count * float(np.log(before / max(remaining, TINY**2 * before)))
                total += count
        return (fall - float(self.columns.shape[2] * np.log(max(total, FEWEST)))) / 2.0


def rest_of(parts: list[Array], problem: Problem, model: Model) -> Rest:
    """Return the residual of a model, (c, M) parts, ready to be searched for changes in time."""
    scale, n, features = _scale(parts), model.robot.n, problem.features(model)
    remaining = _whitened(problem, [part[None] for part in parts], scale)
    arm = _whitened(problem, _of_arm(problem, model, features), scale)
    things = {}
    for thing, channel, count in (('base', 'base', 6), ('tool', 'tool', 6), ('joints', 'q', n)):
        moved = [np.stack([f.column((channel, j)) for j in range(count)]) for f in features]
        metres = np.concatenate([part[:, :3].transpose(2, 1, 0) for part in moved])
        own = [problem.seen(k, part) for k, part in enumerate(moved)]
        things[thing] = _whitened(problem, own, scale), metres
    bases = [things['base'][0]]
    if 'base' in problem.align:
        number = np.repeat(np.arange(len(parts)), problem.samples)
        bases = [bases[0] * (number == k)[:, None, None] for k in range(len(parts))]
    frames = span_of(_rows(np.concatenate([*bases, things['tool'][0]], axis=2)))
    # Of the arm only what is strong enough to be seen.
    basis = np.concatenate([frames, _strong(outside(_rows(arm), frames))])
    remaining = outside(_rows(remaining), basis).reshape(remaining.shape[:2])
    return Rest(remaining, basis, things, problem.rows, problem.samples, scale.position)


def _of_arm(problem: Problem, model: Model, features: list[Features]) -> list[Array]:
    """Return columns of all that an arm and the scale of its instrument do, (P, c, M) per recording."""
    view = features[moved_most(features, None)].view
    out: list[list[Array]] = [[] for _ in features]
    for effect in (*plain_causes(model.robot, view, LASTING), MeasurementScale()):
        size = WIDER * spreads(model.robot, effect)
        known = np.isfinite(size)
        for own, part in zip(
            out, problem.effect_columns(features, effect, atoms=False), strict=True
        ):
            own.append(part[known] * size[known, None, None])
    return [np.concatenate(own) for own in out]


def _scale(parts: list[Array]) -> Scale:
    """Return a scale wide enough for both sides of a step: a robust one sides with the longer."""
    size = [
        float(np.quantile(np.abs(np.concatenate([p[rows].ravel() for p in parts])), 1.0 - FEW))
        / ndtri(1.0 - FEW / 2.0)
        if any(p[rows].size for p in parts)
        else 1.0
        for rows in (slice(0, 3), slice(3, 6))
    ]
    position, turn = (max(s, TINY) for s in size)
    off = [np.linalg.norm(p[:3], axis=0) / (np.sqrt(3) * position) for p in parts]
    weights = tuple(np.minimum(1.0, (HUBER / np.maximum(o, TINY)) ** 2) for o in off)
    return Scale(position, turn, weights)


def _of_strays(residual: Array) -> Array:
    """Return the weight of every sample (M, c) beside the size of most, (M,)."""
    off = np.maximum(np.linalg.norm(residual, axis=1), TINY)
    return np.asarray(np.minimum(1.0, (HUBER * np.median(off) / off) ** 2))


def _whitened(problem: Problem, parts: Sequence[Array], scale: Scale) -> Array:
    """Return (P, c_k, M_k) columns of all recordings whitened as one array, (M, c, P)."""
    most = max(problem.rows)
    each = [problem.in_noise(k, part, scale).transpose(1, 2, 0) for k, part in enumerate(parts)]
    # Points are filled up with empty rows.
    return np.concatenate([np.pad(p, ((0, 0), (0, most - p.shape[1]), (0, 0))) for p in each])


def _rows(columns: Array) -> Array:
    return np.asarray(columns.reshape(columns.shape[0] * columns.shape[1], -1).T)


def _strong(columns: Array) -> Array:
    """Return orthonormal directions of columns, (P, rows), that are stronger than the noise."""
    strength, ways = np.linalg.eigh(columns @ columns.T)
    seen = strength > 1.0
    return np.asarray((ways[:, seen] / np.sqrt(strength[seen])).T @ columns)


def _solved(right: Array, normal: Array) -> Array:
    """Return the change of each of several systems, (S, i), zero where nothing moves."""
    mass = np.diagonal(normal, axis1=1, axis2=2)
    live = mass > TINY**2 * float(mass.max(initial=TINY))
    size = np.where(live, np.sqrt(np.maximum(mass, 0.0)), np.inf)
    scaled = normal / (size[:, :, None] * size[:, None, :]) + TIED * np.eye(mass.shape[1])
    unit = (right / size)[:, :, None]
    return np.asarray(np.linalg.solve(scaled, unit)[:, :, 0] / size)


def other_shapes(age: Array) -> list[Array]:
    """Return smooth shapes over age (M,), from 0 to 1, that are no settling, each (M,)."""
    waves = [wave(n * np.pi * age) for n in (1, 2) for wave in (np.sin, np.cos)]
    late = [np.exp(-(1.0 - age) / constant) for constant in CONSTANTS]
    return [age, age**2, *late, *waves]
