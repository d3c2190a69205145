# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Whitened columns of effects and frames, kept small.

Nearly every effect moves one joint, by an amount of its own at every sample. Its column is what that
joint does to the tool, times these amounts. The two are kept apart, so that memory and products take
one number a sample and column instead of three or six. Other columns are written out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby, pairwise

import numpy as np

from ...arm.channels import Shift
from ...arrays import Array
from ...effects.effect import Effect
from ...twin.features import Features
from ..negligible import EMPTY, ROUNDING
from .definite import Index, inverted, unit_diagonal, well_conditioned
from .problem import Model, Problem, Scale

Rows = slice | Index
"""Some rows: a slice, or their numbers."""
MANY = 200
"""Columns from which on it pays to keep them as amounts, and an inverse of them all for every choice."""
SHOWN = 1e-2
"""A coordinate a thousand times its typical size must move some row by this much noise to be seen."""
BLOCKS = 24
"""Folds whose scores are kept apart: enough to estimate a variance to a third."""


def rows_of(labels: Array) -> list[Rows]:
    """Return the rows of every label, a slice each where they lie together."""
    if (np.diff(labels) >= 0).all():
        bounds = np.searchsorted(labels, np.arange(int(labels[-1]) + 2))
        return [slice(int(a), int(b)) for a, b in pairwise(bounds)]
    return [np.flatnonzero(labels == k) for k in range(int(labels.max()) + 1)]


class MovedJoint:
    """What one joint does to the tool, whitened, (rows,); ``first`` row of every sample, (samples,)."""

    def __init__(self, row: Array, first: Index) -> None:
        self.row, self.first = row, first
        self.sizes = np.diff(np.append(first, row.size))
        self._alike = int(self.sizes[0]) if np.unique(self.sizes).size == 1 else None

    def summed(self, rows: Array) -> Array:
        """Return the products with other rows, shape (..., rows), sample by sample."""
        if self._alike is None:
            return np.asarray(np.add.reduceat(self.row * rows, self.first, axis=-1))
        shape = (self.first.size, self._alike)
        each = rows.reshape(*rows.shape[:-1], *shape)
        return np.asarray(np.einsum('sc,...sc->...s', self.row.reshape(shape), each))

    def spread_out(self, each: Array) -> Array:
        """Return what amounts, shape (..., samples), do to the tool, shape (..., rows)."""
        return np.asarray(np.repeat(each, self.sizes, axis=-1) * self.row)

    @cached_property
    def square(self) -> Array:
        """Return the squared length of the joint's column at every sample, shape (samples,)."""
        return self.summed(self.row)

    @cached_property
    def most(self) -> Array:
        """Return the largest entry of the joint's column at every sample, shape (samples,)."""
        return np.maximum.reduceat(np.abs(self.row), self.first)

    def within(self, rows: Rows) -> tuple[MovedJoint, Rows]:
        """Return the same on some rows, all those of a sample or none, and their samples."""
        samples: Rows
        if isinstance(rows, slice):
            start, stop = np.searchsorted(self.first, (rows.start, rows.stop))
            samples = slice(int(start), int(stop))
        else:
            samples = np.flatnonzero(np.isin(self.first, rows))
        sizes = self.sizes[samples]
        return MovedJoint(self.row[rows], np.cumsum(sizes) - sizes), samples


@dataclass(frozen=True, eq=False)
class Piece:
    """Some columns that are kept alike."""

    each: Array
    """By how much each moves the joint at every sample, shape (K, samples) [rad or m], or (K,
    rows); whitened and written out without one."""
    joint: MovedJoint | None = None  # the joint that all of them move

    @property
    def count(self) -> int:
        return len(self.each)

    def written_out(self) -> Array:
        return self.each if self.joint is None else self.joint.spread_out(self.each)

    def products(self, rows: Array) -> Array:
        """Return their products with other rows, shape (R, rows), as shape (K, R)."""
        return np.asarray(self.each @ (rows if self.joint is None else self.joint.summed(rows)).T)

    def normal(self) -> Array:
        """Return their products with each other, shape (K, K)."""
        one = self.each if self.joint is None else self.each * self.joint.square
        return np.asarray(one @ self.each.T)

    def across(self, other: Piece) -> Array:
        """Return their products with those of another piece, shape (K, L)."""
        if other.joint is None:
            return self.products(other.each)
        if self.joint is None:
            return np.asarray(other.products(self.each).T)
        return np.asarray((self.each * self.joint.summed(other.joint.row)) @ other.each.T)

    def peaks(self) -> Array:
        """Return the largest entry of each, by size, shape (K,)."""
        size = np.abs(self.each) * (1.0 if self.joint is None else self.joint.most)
        return np.asarray(size.max(axis=1, initial=0.0))

    def mixed(self, weights: Array) -> Array:
        """Return sums of them with weights (..., K), as shape (..., rows)."""
        out = weights @ self.each
        return np.asarray(out if self.joint is None else self.joint.spread_out(out))

    def within(self, rows: Rows) -> Piece:
        """Return them on some rows, all those of a sample or none."""
        if self.joint is None:
            return Piece(self.each[:, rows])
        joint, samples = self.joint.within(rows)
        return Piece(self.each[:, samples], joint)


@dataclass(frozen=True, eq=False)
class Columns:
    """Whitened columns in pieces, in order; at least one piece, which may be empty."""

    pieces: tuple[Piece, ...]

    @classmethod
    def joined(cls, pieces: Sequence[Piece]) -> Columns:
        """Return columns in few pieces, in the same order, so that products are few and large."""
        out = []
        for _, alike in groupby(pieces, key=lambda piece: id(piece.joint)):
            first, *more = alike
            each = [first.each, *(one.each for one in more)]
            out.append(Piece(np.concatenate(each) if more else first.each, first.joint))
        return cls(tuple(out))

    @cached_property
    def places(self) -> tuple[slice, ...]:
        ends = np.cumsum([0, *(piece.count for piece in self.pieces)]).tolist()
        return tuple(slice(a, b) for a, b in pairwise(ends))

    @property
    def count(self) -> int:
        return int(self.places[-1].stop)

    def written_out(self) -> Array:
        return np.concatenate([piece.written_out() for piece in self.pieces])

    def normal(self) -> Array:
        out = np.empty((self.count, self.count))
        for k, (piece, here) in enumerate(zip(self.pieces, self.places, strict=True)):
            out[here, here] = piece.normal()
            for other, there in zip(self.pieces[:k], self.places[:k], strict=True):
                out[here, there] = piece.across(other)
                out[there, here] = out[here, there].T
        return out

    def products(self, rows: Array) -> Array:
        return np.concatenate([piece.products(rows) for piece in self.pieces])

    def times(self, row: Array) -> Array:
        return self.products(row[None])[:, 0]

    def mixed(self, weights: Array) -> Array:
        parts = zip(self.pieces, self.places, strict=True)
        out = [piece.mixed(weights[..., here]) for piece, here in parts]
        return np.asarray(sum(out[1:], start=out[0]))

    def peaks(self) -> Array:
        return np.concatenate([piece.peaks() for piece in self.pieces])

    def chosen(self, index: Index) -> Columns:
        """Return some of the columns, their numbers in ascending order."""
        if index.size == self.count:
            return self
        own = [index[(index >= s.start) & (index < s.stop)] - s.start for s in self.places]
        parts = list(zip(self.pieces, own, strict=True))
        some = [(piece, mine) for piece, mine in parts if mine.size] or parts[:1]
        return Columns(tuple(Piece(piece.each[mine], piece.joint) for piece, mine in some))

    def within(self, rows: Rows) -> Columns:
        return Columns(tuple(piece.within(rows) for piece in self.pieces))


class Maker:
    """Makes columns of effects by the features of every recording at a model, divided by a scale."""

    def __init__(self, problem: Problem, features: list[Features], scale: Scale) -> None:
        self.problem, self.features, self.scale = problem, features, scale
        self._joints: dict[int, MovedJoint] = {}

    def piece(self, effect: Effect, *, atoms: bool = True) -> Piece:
        """Return the linear features of an effect; else its derivatives by its fit coordinates."""
        shifts = [maker.shifts(effect, atoms) for maker in self.features]
        joint = None if self.problem.touched else moved_joint(shifts)
        if joint is not None and (atoms or len(shifts[0]) >= MANY):
            # By how much every feature moves the joint, over all recordings.
            each = [
                np.stack([np.broadcast_to(shift.get(('q', joint), 0.0), (m,)) for shift in part])
                for part, m in zip(shifts, self.problem.samples, strict=True)
            ]
            amounts = each[0] if len(each) == 1 else np.concatenate(each, axis=1)
            return Piece(amounts, self.moved(joint))
        changes = [m.changes(own) for m, own in zip(self.features, shifts, strict=True)]
        parts = [self.problem.seen(k, change) for k, change in enumerate(changes)]
        return Piece(self.problem.whitened(parts, self.scale))

    def moved(self, joint: int) -> MovedJoint:
        if joint not in self._joints:
            columns = enumerate(maker.column(('q', joint)) for maker in self.features)
            parts = [self.problem.seen(k, column) for k, column in columns]
            sizes = np.repeat(self.problem.rows, self.problem.samples)
            row = self.problem.whitened(parts, self.scale)
            self._joints[joint] = MovedJoint(row, np.cumsum(sizes) - sizes)
        return self._joints[joint]


def moved_joint(shifts: Sequence[Sequence[Shift]]) -> int | None:
    """Return the joint that one effect's features, of every recording, all move; None if any other."""
    channels = {channel for parts in shifts for shift in parts for channel in shift}
    if len(channels) != 1:
        return None
    name, joint = channels.pop()
    return joint if name == 'q' else None


def designed(problem: Problem, model: Model, scale: Scale, framed: Model | None = None) -> Columns:
    """Return the whitened columns of frames (at another model, if one is given) and found effects."""
    features = problem.features(model)
    around = features if framed is None else problem.features(framed)
    frames = Piece(problem.whitened(problem.frame_columns(around)[0], scale))
    maker = Maker(problem, features, scale)
    each = (maker.piece(effect, atoms=False) for effect in model.found)
    return Columns.joined([frames, *each])


def columns_covariance(
    columns: Columns, ridge: Array, residual: Array, labels: Array, share: float
) -> Array:
    """
    Return the covariance of all columns' coefficients, shape (P, P).

    It holds where the model is not quite the arm: as wide as the noise makes it, or as scores do that
    hang together within a fold or differ between folds [1]_, each coefficient by the
    larger; they hang together as their columns do.

    ridge, residual: prior precision, (P,), and what the fit leaves, whitened, (rows,).
    labels, share: fold of every row, some `BLOCKS`; of the rows that count as independent.

    References
    ----------
    .. [1] H. White, "Maximum likelihood estimation of misspecified models", Econometrica 50, 1982.

    """
    inverse, size = unit_inverse(columns, ridge)
    folds = rows_of(np.unique(labels, return_inverse=True)[1].astype(float))
    each = [columns.within(rows).times(residual[rows]) / size for rows in folds]
    scores = inverse @ np.stack(each, axis=1)
    blocks = max(len(each), 2)
    together = (scores**2).sum(axis=1) * blocks / (blocks - 1)
    own = np.diag(inverse)
    wider = np.sqrt(np.maximum(own / share, together) / np.maximum(own, EMPTY)) / size
    return np.asarray(inverse * np.outer(wider, wider))


def unit_inverse(columns: Columns, ridge: Array) -> tuple[Array, Array]:
    """Return the inverse of the normal matrix, ridge (P,) added, at unit diagonal; norms of columns."""
    normal = columns.normal()
    normal[np.diag_indices_from(normal)] += ridge
    scaled, size = unit_diagonal(normal)
    if not size.size:
        return scaled, size  # LAPACK complains of a matrix of no columns.
    if well_conditioned(scaled, ROUNDING):
        return inverted(scaled), size
    return np.asarray(np.linalg.pinv(scaled, rcond=ROUNDING, hermitian=True)), size
