# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Whitened columns of very many hypotheses, kept small.

Nearly every hypothesis moves one joint, by an amount of its own at every sample. Its column is
what that joint does to the tool, times these amounts. The two are kept apart, so that memory and
products take one number a sample and column instead of three or six.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...arm.channels import Shift
from ...arrays import Array
from ...twin.features import Features
from .definite import Index
from .problem import Problem, Scale

Rows = slice | Index
"""Some rows: a slice, or their numbers."""


def rows_of(labels: Array) -> list[Rows]:
    """Return the rows of every label, a slice each where they lie together."""
    if (np.diff(labels) >= 0).all():
        bounds = np.searchsorted(labels, np.arange(int(labels[-1]) + 2))
        return [slice(int(a), int(b)) for a, b in pairwise(bounds)]
    return [np.flatnonzero(labels == k) for k in range(int(labels.max()) + 1)]


class Columns(ABC):
    """Whitened columns, in whatever way they are kept."""

    @property
    @abstractmethod
    def count(self) -> int:
        """Return how many there are."""

    @abstractmethod
    def written_out(self) -> Array:
        """Return the columns, shape (K, rows)."""

    @abstractmethod
    def products(self, rows: Array) -> Array:
        """Return their products with other rows, shape (R, rows), as shape (K, R)."""

    @abstractmethod
    def normal(self) -> Array:
        """Return their products with each other, shape (K, K)."""

    @abstractmethod
    def peaks(self) -> Array:
        """Return the largest entry of each, by size, shape (K,)."""

    @abstractmethod
    def mixed(self, weights: Array) -> Array:
        """Return sums of them with weights, shape (..., K), as shape (..., rows)."""

    @abstractmethod
    def chosen(self, index: Index) -> Columns:
        """Return some of them."""

    @abstractmethod
    def within(self, rows: Rows) -> Columns:
        """Return them on some rows, all those of a sample or none."""

    def largest(self) -> float:
        """Return their largest entry, by size."""
        return float(self.peaks().max(initial=0.0))


@dataclass(frozen=True, eq=False)
class Whole(Columns):
    """
    Columns written out.

    Attributes
    ----------
    rows : array, shape (K, rows)

    """

    rows: Array

    @property
    def count(self) -> int:
        return int(self.rows.shape[0])

    def written_out(self) -> Array:
        return self.rows

    def products(self, rows: Array) -> Array:
        return np.asarray(self.rows @ rows.T)

    def normal(self) -> Array:
        return np.asarray(self.rows @ self.rows.T)

    def peaks(self) -> Array:
        return np.asarray(np.abs(self.rows).max(axis=1, initial=0.0))

    def mixed(self, weights: Array) -> Array:
        return np.asarray(weights @ self.rows)

    def chosen(self, index: Index) -> Whole:
        return Whole(self.rows[index])

    def within(self, rows: Rows) -> Whole:
        return Whole(self.rows[:, rows])


class MovedJoint:
    """
    What one joint does to the tool, whitened; all columns that move this joint share it.

    Parameters
    ----------
    row : array, shape (rows,)
    first : array of int, shape (samples,)
        The first row of every sample.

    """

    def __init__(self, row: Array, first: Index) -> None:
        self.row, self.first = row, first
        sizes = np.diff(np.append(first, row.size))
        self._alike = int(sizes[0]) if sizes.size and (sizes == sizes[0]).all() else None
        self.square = self.summed(row)
        self.most = np.maximum.reduceat(np.abs(row), first)

    @classmethod
    def of(
        cls, problem: Problem, features: Sequence[Features], scale: Scale, joint: int
    ) -> MovedJoint:
        """
        Take the column of a joint at the features' model.

        Parameters
        ----------
        features : sequence of Features
            Of every recording, at the model.
        scale : Scale
            What the rows are divided by.

        """
        parts = [
            maker.column(('q', joint))[:c] for maker, c in zip(features, problem.rows, strict=True)
        ]
        sizes = np.repeat(problem.rows, problem.samples)
        first = np.cumsum(sizes) - sizes
        return cls(problem.whitened(parts, scale), first)

    def summed(self, rows: Array) -> Array:
        """Return the products with other rows, shape (..., rows), sample by sample."""
        if self._alike is None:
            return np.asarray(np.add.reduceat(self.row * rows, self.first, axis=-1))
        shape = (self.first.size, self._alike)
        each = rows.reshape(*rows.shape[:-1], *shape)
        return np.asarray(np.einsum('sc,...sc->...s', self.row.reshape(shape), each))

    def moved_by(self, each: Array) -> Array:
        """Return what amounts, shape (..., samples), do to the tool, shape (..., rows)."""
        last = np.append(self.first[1:], self.row.size)
        return np.asarray(np.repeat(each, last - self.first, axis=-1) * self.row)

    def samples(self, rows: Rows) -> Rows:
        """Return the samples of some rows, all those of a sample or none."""
        if isinstance(rows, slice):
            start, stop = np.searchsorted(self.first, (rows.start, rows.stop))
            return slice(int(start), int(stop))
        return np.flatnonzero(np.isin(self.first, rows))

    def within(self, rows: Rows) -> MovedJoint:
        """Return the same on some rows, all those of a sample or none."""
        samples = self.samples(rows)
        sizes = np.diff(np.append(self.first, self.row.size))[samples]
        return MovedJoint(self.row[rows], np.cumsum(sizes) - sizes)


@dataclass(frozen=True, eq=False)
class Amounts(Columns):
    """
    Columns that move one joint.

    Attributes
    ----------
    each : array, shape (K, samples) [rad or m]
        By how much each moves it.

    """

    joint: MovedJoint
    each: Array

    @property
    def count(self) -> int:
        return int(self.each.shape[0])

    def written_out(self) -> Array:
        return self.joint.moved_by(self.each)

    def products(self, rows: Array) -> Array:
        return np.asarray(self.each @ self.joint.summed(rows).T)

    def normal(self) -> Array:
        return np.asarray((self.each * self.joint.square) @ self.each.T)

    def peaks(self) -> Array:
        return np.asarray((np.abs(self.each) * self.joint.most).max(axis=1, initial=0.0))

    def mixed(self, weights: Array) -> Array:
        return self.joint.moved_by(weights @ self.each)

    def chosen(self, index: Index) -> Amounts:
        return Amounts(self.joint, self.each[index])

    def within(self, rows: Rows) -> Amounts:
        samples = self.joint.samples(rows)
        return Amounts(self.joint.within(rows), self.each[:, samples])


def moved_joint(shifts: Sequence[Sequence[Shift]]) -> int | None:
    """
    Return the joint that is all that some features move; None where they move something else.

    Parameters
    ----------
    shifts : sequence of sequence of mapping
        The features of one effect in every recording; see `Features.shifts`.

    """
    channels = {channel for parts in shifts for shift in parts for channel in shift}
    if len(channels) != 1:
        return None
    name, joint = channels.pop()
    return joint if name == 'q' else None


def amounts(shifts: Sequence[Sequence[Shift]], joint: int, samples: Sequence[int]) -> Array:
    """
    Return by how much every feature moves a joint, over all recordings, shape (K, samples).

    Parameters
    ----------
    shifts : sequence of sequence of Shift
        Of every recording, K features each.
    samples : sequence of int
        Of every recording.

    """
    channel = ('q', joint)
    parts = [
        np.stack([np.broadcast_to(shift.get(channel, 0.0), (m,)) for shift in part])
        for part, m in zip(shifts, samples, strict=True)
    ]
    return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)


def gathered(pieces: Sequence[Columns]) -> list[Columns]:
    """Return columns in few pieces, in the same order, so that products are few and large."""
    out: list[Columns] = []
    run: list[Columns] = []
    for piece in pieces:
        if run and not _alike(run[0], piece):
            out.append(_joined(run))
            run = []
        run.append(piece)
    return [*out, _joined(run)] if run else out


def _alike(one: Columns, other: Columns) -> bool:
    if isinstance(one, Amounts) and isinstance(other, Amounts):
        return one.joint is other.joint
    return isinstance(one, Whole) and isinstance(other, Whole)


def _joined(run: Sequence[Columns]) -> Columns:
    first = run[0]
    if len(run) == 1:
        return first
    if isinstance(first, Amounts):
        return Amounts(
            first.joint, np.concatenate([p.each for p in run if isinstance(p, Amounts)])
        )
    return Whole(np.concatenate([piece.written_out() for piece in run]))
