# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The columns of a whole model, kept small.

Waves of all orders are hundreds of columns that move one joint each. Kept as `atoms` keeps them,
they take a sixth of the memory, and their products a sixth of the time.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ...twin.features import Features
from .atoms import Amounts, Columns, MovedJoint, Rows, Whole, amounts, gathered, moved_joint
from .definite import Index
from .problem import Model, Problem, Scale

MANY = 32
"""Coordinates of one effect from which on they are kept apart from what its joint does to the
tool: products of fewer are as quick written out."""


@dataclass(frozen=True, eq=False)
class Design:
    """Whitened columns in pieces, in order."""

    pieces: tuple[Columns, ...]

    @classmethod
    def of(cls, rows: Array) -> Design:
        """Return columns that are written out, shape (P, rows)."""
        return cls((Whole(rows),))

    @property
    def count(self) -> int:
        """Return how many columns there are."""
        return sum(piece.count for piece in self.pieces)

    @cached_property
    def places(self) -> tuple[slice, ...]:
        """Return where the columns of every piece are."""
        ends = np.cumsum([0, *(piece.count for piece in self.pieces)]).tolist()
        return tuple(slice(a, b) for a, b in pairwise(ends))

    def written_out(self) -> Array:
        """Return the columns, shape (P, rows)."""
        return np.concatenate([piece.written_out() for piece in self.pieces])

    def normal(self) -> Array:
        """Return the products of all columns with each other, shape (P, P)."""
        out = np.empty((self.count, self.count))
        for k, (piece, here) in enumerate(zip(self.pieces, self.places, strict=True)):
            out[here, here] = piece.normal()
            for other, there in zip(self.pieces[:k], self.places[:k], strict=True):
                out[here, there] = _across(piece, other)
                out[there, here] = out[here, there].T
        return out

    def products(self, rows: Array) -> Array:
        """Return the products with other rows, shape (R, rows), as shape (P, R)."""
        return np.concatenate([piece.products(rows) for piece in self.pieces])

    def times(self, row: Array) -> Array:
        """Return the products with one row, shape (rows,), as shape (P,)."""
        return self.products(row[None])[:, 0]

    def mixed(self, weights: Array) -> Array:
        """Return sums of the columns with weights, shape (..., P), as shape (..., rows)."""
        parts = zip(self.pieces, self.places, strict=True)
        out = [piece.mixed(weights[..., here]) for piece, here in parts]
        return np.asarray(sum(out[1:], start=out[0]))

    def peaks(self) -> Array:
        """Return the largest entry of every column, by size, shape (P,)."""
        return np.concatenate([piece.peaks() for piece in self.pieces])

    def chosen(self, index: Index) -> Design:
        """Return some of the columns, their numbers in ascending order."""
        if index.size == self.count:
            return self
        own = [index[(index >= s.start) & (index < s.stop)] - s.start for s in self.places]
        parts = list(zip(self.pieces, own, strict=True))
        some = [(piece, mine) for piece, mine in parts if mine.size] or parts[:1]
        return Design(tuple(piece.chosen(mine) for piece, mine in some))

    def within(self, rows: Rows) -> Design:
        """Return the columns on some rows, all those of a sample or none."""
        return Design(tuple(piece.within(rows) for piece in self.pieces))


def _across(one: Columns, other: Columns) -> Array:
    """Return the products of the columns of two pieces, shape (K, L)."""
    if isinstance(other, Whole):
        return one.products(other.rows)
    if isinstance(one, Amounts) and isinstance(other, Amounts):
        return np.asarray((one.each * one.joint.summed(other.joint.row)) @ other.each.T)
    return np.asarray(other.products(one.written_out()).T)


def designed(problem: Problem, model: Model, scale: Scale) -> tuple[Design, list[str]]:
    """Return the whitened columns of frames and found effects, and their names."""
    features = problem.features(model)
    parts, names = problem.frame_columns(features)
    pieces: list[Columns] = [Whole(problem.whitened(parts, scale))]
    for k, effect in enumerate(model.found):
        pieces.append(_piece(problem, features, scale, effect))
        names = names + [f'{k}.{j}' for j in range(pieces[-1].count)]
    return Design(tuple(gathered(pieces))), names


def _piece(problem: Problem, features: list[Features], scale: Scale, effect: Effect) -> Columns:
    """Return the columns of one effect."""
    if effect.fit.coordinates().size >= MANY and not problem.touched:
        shifts = [maker.shifts(effect, atoms=False) for maker in features]
        joint = moved_joint(shifts)
        if joint is not None:
            moved = MovedJoint.of(problem, features, scale, joint)
            return Amounts(moved, amounts(shifts, joint, problem.samples))
    columns = problem.effect_columns(features, effect, atoms=False)
    return Whole(problem.whitened(columns, scale))
