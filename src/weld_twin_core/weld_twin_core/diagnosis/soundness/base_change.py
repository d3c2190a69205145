# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a change in time of base, tool or a joint would explain, beyond everything that is constant.

Residuals of an arm follow its pose, and poses follow time, so any motion looks a little like a
change of the frame. Constant frames and a first-order model of the whole arm (geometry, springs,
play, loops of lost motion, lag of every joint) and of the instrument's scale are therefore projected
out before a change in time is tried.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from ...arrays import Array
from ...effects.hysteresis import SLIDING, Hysteresis
from ...effects.loaded_play import SHARES
from ...effects.measurement_scale import MeasurementScale
from ...effects.plausible import plausible
from ...effects.thermal_growth import ThermalGrowth
from ...twin.features import Features
from ..algebra.fit import HUBER
from ..algebra.independent_rows import effective_share
from ..algebra.problem import Model, Problem, Scale
from .lag import KEPT
from .limits import FEW, ROWS, TINY, WIDER

GEOMETRY = {
    'theta': ('joint_offset', 'offset'),
    'd': ('link_offset', 'dd'),
    'a': ('link_length', 'da'),
    'alpha': ('link_twist', 'dalpha'),
    'beta': ('axis_parallelism', 'dbeta'),
}
"""Channels of a row, and the error that displaces each."""
LOOPS = (0.02, 0.1)
"""Travels [rad] over which loops of lost motion close, between a gap and a tenth of a turn."""
FEWEST = 12.0
"""Independent rows that are counted at the least: two frames have as many numbers."""
TIED = 1e-6
"""Pull of a change to zero, in units of its columns: decides what data leave open."""
CONSTANTS = np.geomspace(0.05, 0.7, 13)
"""Time constants of settling, as shares of the recording."""


@dataclass(frozen=True, eq=False)
class Rest:
    """
    What frames and arm leave of every sample, and what may have changed while it was measured.

    Attributes
    ----------
    residual : array, shape (M, c) in units of noise
    basis : array, shape (M, c, P)
        Orthonormal over all rows: what frames and arm can explain.
    things : dict of (array, array), shapes (M, c, k) and (M, 3, k)
        What 'base', 'tool' and 'joints' do to every sample, whitened, and to its position [m].
    rows, samples : tuple of int
        Components and samples of every recording.
    noise : float
        Unit of the positions [m].

    """

    residual: Array
    basis: Array
    things: Mapping[str, tuple[Array, Array]]
    rows: tuple[int, ...]
    samples: tuple[int, ...]
    noise: float

    def left(self, k: int) -> float:
        """Return the RMS distance [m] that is left of recording k, as a lag counts it."""
        own = np.sort((self.residual[self.recording == k][:, :3] ** 2).sum(axis=1))
        return self.noise * float(np.sqrt(own[: max(int(KEPT * own.size), 1)].mean()))

    @cached_property
    def recording(self) -> NDArray[np.int_]:
        """Return the recording of every sample, shape (M,)."""
        return np.repeat(np.arange(len(self.samples)), self.samples)

    @property
    def far(self) -> float:
        """Return the sum of squares of positions that is left; turns may be nothing but noise."""
        return float((self.residual[:, :3] ** 2).sum())

    @cached_property
    def share(self) -> float:
        """Return the share of rows that count as independent."""
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
        overlap = np.matmul(np.swapaxes(self.rest.basis, 1, 2), self.columns)
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
        """Return the shape that explains most."""
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
        flat = _flat(self.columns * shape[:, None, None])
        new = _orthonormal(_projected(flat, _flat(rest.basis)))
        remaining = _projected(rest.residual.reshape(-1), new).reshape(rest.residual.shape)
        basis = np.concatenate([_flat(rest.basis), new], axis=1)
        return replace(rest, residual=remaining, basis=basis.reshape(*remaining.shape, -1))

    def nats(self, shape: Array) -> float:
        """
        Return the evidence for a change.

        Noise of positions and of turns, and how many rows are independent, are those the change
        leaves: a step by itself makes residuals that hang together.
        """
        rest, after = self.rest, self.taken_out(shape)
        # Of few stations frames and arm take most rows up; those tell nothing for a change.
        size = float(sum(c * m for c, m in zip(rest.rows, rest.samples, strict=True)))
        free = max(1.0 - after.basis.shape[2] / size, 0.0)
        total, fall = 0.0, 0.0
        for part in (slice(0, 3), slice(3, 6)):
            before, remaining = (float((c.residual[:, part] ** 2).sum()) for c in (rest, after))
            if before > 0.0:
                count = max(after.share * free * after.residual[:, part].size, FEWEST)
                fall += count * float(np.log(before / max(remaining, TINY**2 * before)))
                total += count
        return (fall - float(self.columns.shape[2] * np.log(max(total, FEWEST)))) / 2.0


def rest_of(parts: list[Array], problem: Problem, model: Model) -> Rest:
    """
    Return the residual ready to be searched for changes in time.

    ``parts`` are the residuals of the model, (c, M), one per recording.
    """
    scale, n = _scale(parts), model.robot.n
    pairs = list(zip(problem.features(model), problem.rows, strict=True))
    arms = [np.concatenate([part(*pair) for part in (_arm, _grown, _scaled)]) for pair in pairs]
    remaining, arm = (_whitened(each, scale) for each in ([part[None] for part in parts], arms))
    things = {}
    for thing, channel, count in (('base', 'base', 6), ('tool', 'tool', 6), ('joints', 'q', n)):
        moved = [_moved(maker, channel, count, rows) for maker, rows in pairs]
        metres = np.concatenate([part[:, :3].transpose(2, 1, 0) for part in moved])
        things[thing] = _whitened(moved, scale), metres
    bases = [things['base'][0]]
    if 'base' in problem.align:
        number = np.repeat(np.arange(len(parts)), problem.samples)
        bases = [bases[0] * (number == k)[:, None, None] for k in range(len(parts))]
    frames = np.concatenate([*bases, things['tool'][0]], axis=2)
    arm = arm[..., np.abs(arm).max(axis=(0, 1)) > 0.0]
    basis = _basis(arm.reshape(remaining.size, -1), frames.reshape(remaining.size, -1))
    remaining = _projected(remaining.reshape(-1, 1), basis).reshape(remaining.shape[:2])
    basis = basis.reshape(*remaining.shape, -1)
    return Rest(remaining, basis, things, problem.rows, problem.samples, scale.position)


def thinned(problem: Problem, parts: list[Array]) -> tuple[Problem, list[Array]]:
    """Return fewer measurements and their residuals, where there are too many."""
    few = problem.thinned(ROWS)
    out = []
    for whole, thin, part in zip(problem.recordings, few.recordings, parts, strict=True):
        out.append(part[:, np.isin(whole.seen.t, thin.seen.t)])
    return few, out


def _scale(parts: list[Array]) -> Scale:
    """
    Return a scale wide enough to keep both sides of a step.

    A robust fit sides with the longer part, and a median with it; nine samples in ten do not.
    """
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


def _moved(maker: Features, name: str, count: int, rows: int) -> Array:
    return np.stack([maker.column((name, j)) for j in range(count)])[:, :rows]


def _whitened(parts: Sequence[Array], scale: Scale) -> Array:
    """Return (P, c_k, M_k) columns of all recordings whitened as one array, (M, c, P)."""
    out = []
    most = max(part.shape[1] for part in parts)
    for part, weight in zip(parts, scale.weights, strict=True):
        unit = np.full(part.shape[1], 1.0 / scale.position)
        unit[3:] = 1.0 / scale.orientation
        white = (part * unit[:, None] * np.sqrt(weight)).transpose(2, 1, 0)
        # Points are filled up with empty rows.
        out.append(np.pad(white, ((0, 0), (0, most - part.shape[1]), (0, 0))))
    return np.concatenate(out)


def _arm(maker: Features, rows: int) -> Array:
    """Return columns of everything an arm does by itself, to first order, shape (P, rows, M)."""
    view, robot = maker.view, maker.twin.robot
    out = []
    for i in range(robot.n):
        name = robot.joint_names[i]
        spread = {
            key: WIDER * plausible(robot, *error, name).sd for key, error in GEOMETRY.items()
        }
        joint = maker.column(('q', i))[:rows] * spread['theta']
        out += [maker.column((key, i))[:rows] * sd for key, sd in spread.items()]
        signals = [np.sin(view.q[:, i]), np.cos(view.q[:, i]), view.q[:, i]]
        signals += [view.shift[('tau', i)], view.qd[:, i], np.sign(view.qd[:, i])]
        side = np.sign(np.gradient(view.q[:, i])) if view.static else 0.0 * view.q[:, i]
        for signal in (*signals, side, *_abrupt(maker, i)):
            # A joint that rests in one recording and moves in another has the same columns in both.
            spread = float(np.abs(signal).max())
            out.append(joint * (signal / spread if spread > TINY else 0.0 * signal))
    return np.stack(out)


def _abrupt(maker: Features, i: int) -> list[Array]:
    """
    Return what a joint does that looks like a step for a while, arrays (M,) of any size.

    Play falls over where the load changes sides, and loops of lost motion close soon after a turn.
    """
    view, name = maker.view, maker.twin.robot.joint_names[i]
    pull = view.shift[('tau', i)]
    most = max(float(np.abs(pull).max()), TINY)
    # A load that stays on one side is as good as constant, and there already.
    out = [pull / np.hypot(pull, share * most) for share in SHARES]
    if view.static:  # loops have closed
        return [*out, *(0.0 * pull for _ in LOOPS)]
    unit = SLIDING if maker.twin.robot.prismatic[i] else 1.0
    loops = [Hysteresis(name, 0.0, travel * unit) for travel in LOOPS]
    return [*out, *(np.asarray(maker.shifts(loop)[0]['q', i]) for loop in loops)]


def _grown(maker: Features, rows: int) -> Array:
    """
    Return columns of every link that grows with the temperature, shape (n, rows, M).

    Without a temperature they are zero: what grows with an unknown one is a smooth change in time.
    """
    robot, view = maker.twin.robot, maker.view
    if view.temperature is None:
        return np.zeros((robot.n, rows, view.q.shape[0]))
    growths = [ThermalGrowth(links=(name,)) for name in robot.joint_names]
    spread = WIDER * plausible(robot, 'thermal_growth', 'coefficient').sd
    return np.stack([spread * maker.columns(one, atoms=False)[0, :rows] for one in growths])


def _scaled(maker: Features, rows: int) -> Array:
    """Return the column of an instrument that reads too long, shape (1, rows, M)."""
    spread = WIDER * plausible(maker.twin.robot, 'measurement_scale', 'scale').sd
    return spread * maker.columns(MeasurementScale(), atoms=False)[:, :rows]


def _basis(arm: Array, frames: Array) -> Array:
    """Return an orthonormal basis of frames and of all arm errors strong enough to be seen."""
    frames = _orthonormal(frames)
    return np.concatenate([frames, _strong(_projected(arm, frames), 1.0)], axis=1)


def _orthonormal(columns: Array) -> Array:
    size = np.linalg.norm(columns, axis=0)
    columns = columns[:, size > 0.0] / size[size > 0.0]
    if columns.shape[1] == 0:
        return columns
    return _strong(columns, TINY)


def _strong(columns: Array, least: float) -> Array:
    """Return orthonormal directions of columns, those of at least so much strength."""
    strength, vectors = np.linalg.eigh(columns.T @ columns)
    seen = strength > least
    return np.asarray(columns @ vectors[:, seen] / np.sqrt(strength[seen]))


def _projected(columns: Array, basis: Array) -> Array:
    return np.asarray(columns - basis @ (basis.T @ columns))


def _flat(columns: Array) -> Array:
    """Return (M, c, P) columns as (rows, P)."""
    return columns.reshape(-1, columns.shape[2])


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


def smooth_shapes(age: Array) -> list[Array]:
    """Return smooth shapes over age (M,), from 0 to 1, settling among them, each (M,)."""
    return [*(np.exp(-age / constant) for constant in CONSTANTS), *other_shapes(age)]
