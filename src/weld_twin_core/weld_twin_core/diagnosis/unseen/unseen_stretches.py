# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What models with more or fewer effects predict on stretches they were not fitted on.

The found effects are small, so around the final fit every smaller model is linear: the exact
contribution of each effect is put back into the residual where it is left out, and the coordinates of
those kept are fitted anew on the other stretches. What a search alone chooses is chosen anew there,
too: of thousands of staircases one fits anything it is chosen by. Normal equations of every stretch
are formed once; a model is a choice of columns and targets.

Where a seam or a SCARA hardly tells base from tool, fitted frames can be a metre off, and a metre
times the turn of an effect that is left out would take its place. So frames have the columns of the
bare arm.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ..algebra.columns import MANY, Columns, Piece, Rows, designed, rows_of
from ..algebra.definite import Index, factored, inverted, unit_diagonal
from ..algebra.fit import Fit, frame_prior, trusted
from ..algebra.problem import Model, Problem, Scale
from ..algebra.starts import chosen_anew
from ..negligible import EMPTY, FLAT, REPEATED, ROUNDING
from .folds import STRETCHES, Gain, gain, growth, parts_of, ways_to_divide

RIDGES = (1e-2, 1.0, 1e2, 1e4)
"""Prior precisions tried on columns of unit mean square, in units of noise: from free to still."""
MOST_STEPS = 1e6
"""A squared step counts so many times its variance at the most: far beyond any chance."""
Solver = Callable[[Array], Array]
"""Solves normal equations for one right-hand side or several."""
TETHER = 0.3
"""A coordinate moves about this share of its size when the stretches that show it are left out."""


@dataclass(frozen=True, eq=False)
class Unseen:
    """Predictions of the final model and its parts on unseen stretches."""

    problem: Problem
    scale: Scale
    labels: Array  # stretch of every row, shape (rows,)
    columns: Columns  # P columns: places, frames, then the coordinates of every found effect
    parts: tuple[slice, ...]  # columns of every effect
    residual: Array  # the final residual, shape (rows,)
    taken: Callable[[], Array]
    """Returns what each effect takes off the residual, exactly, shape (K, rows): a run of the twin
    for each, which a model of all effects does not need."""
    precision: Array
    pull: Array
    """Prior precision of every column, and how hard it pulls from where the fit is now, shape
    (P,)."""
    searched: Callable[[bytes], Mapping[int, Array]] = lambda labels: {}
    """Returns what each effect that a search alone chooses takes off beyond what it takes off now
    if it is chosen without each stretch, (stretches, rows) by its number; asked with the labels."""

    @classmethod
    def of(cls, problem: Problem, scale: Scale, fit: Fit, precision: Array) -> Unseen:
        """Prepare the parts of a fitted model, coordinates with a prior precision (K,), once."""
        made: Unseen
        for given, made in fit.prepared:
            same = made.problem is problem and made.scale is scale
            if same and np.array_equal(given, precision):
                return made
        columns = designed(problem, fit.model, scale, fit.model.with_found(()))
        places = problem.place_columns(scale)
        if len(places):
            columns = Columns((Piece(places), *columns.pieces))
        frames = columns.count - fit.coordinates.size
        sizes = (effect.fit.coordinates().size for effect in fit.model.found)
        ends = np.cumsum([frames, *sizes]).tolist()
        prior = np.zeros(columns.count)
        prior[len(places) : frames], off = frame_prior(problem, fit.model)
        off = np.concatenate([np.zeros(len(places)), off])
        if precision.size:
            prior[frames:] = precision
        # A learned prior holds a coordinate already; a tether would tell it of unseen stretches.
        tether = np.concatenate([np.zeros(frames), _tether(fit.model)])
        made = cls(
            problem=problem,
            scale=scale,
            labels=problem.block_labels(STRETCHES),
            columns=columns,
            parts=tuple(slice(a, b) for a, b in pairwise(ends)),
            residual=fit.residual,
            taken=cache(partial(_taken, problem, scale, fit)),
            precision=prior + np.where(prior > 0.0, 0.0, tether),
            pull=prior * np.concatenate([off, fit.coordinates]),
            searched=cache(partial(_searched, problem, scale, fit.model)),
        )
        fit.prepared[:] = [(precision, made)]
        return made

    def by(self, labels: Array) -> Unseen:
        key = labels.tobytes()
        if key not in self._others:
            self._others[key] = replace(self, labels=labels)
        return self._others[key]

    def along(self, columns: Array) -> Unseen:
        """Return the same with something fitted along at zero, as large as believed, (E, rows)."""
        count, more = self.columns.count, len(columns)
        return replace(
            self,
            columns=Columns((*self.columns.pieces, Piece(columns))),
            parts=(*self.parts, slice(count, count + more)),
            taken=cache(lambda: np.pad(self.taken(), ((0, 1), (0, 0)))),
            precision=np.concatenate([self.precision, np.ones(more)]),
            pull=np.concatenate([self.pull, np.zeros(more)]),
        )

    def held(self, precision: Array, coordinates: Array) -> Unseen:
        """Return the same under another prior precision about zero, (K,), coordinates (K,) as fitted."""
        frames = self.frames
        return replace(
            self,
            precision=np.concatenate([self.precision[:frames], precision]),
            pull=np.concatenate([self.pull[:frames], precision * coordinates]),
        )

    @cached_property
    def bare(self) -> Array:
        return self.predict([])

    @cached_property
    def whole(self) -> Array:
        return self.predict(range(len(self.parts)))

    def every_way(self) -> list[Unseen]:
        return [self, *(self.by(labels) for labels in ways_to_divide(self.problem)[1:])]

    def forget_other_parts(self) -> None:
        """Let go of what was worked out for other parts: with many columns it is a hundred MB."""
        self._others.clear()

    @cached_property
    def _others(self) -> dict[bytes, Unseen]:
        return {}

    @cached_property
    def targets(self) -> Array:
        """Return the final residual, then what each effect takes off it, shape (1 + K, rows)."""
        return np.concatenate([self.residual[None], self.taken()])

    @property
    def frames(self) -> int:
        return int(self.parts[0].start if self.parts else self.columns.count)

    def beside_frames(self, fields: Array) -> Array:
        """Return what fields of the tool, (K, rows), leave once the frames are fitted to them, too."""
        if not self.frames:
            return fields
        columns = self.columns.chosen(np.arange(self.frames)).written_out()
        normal = columns @ columns.T + np.diag(self.precision[: self.frames])
        step = np.linalg.lstsq(normal, columns @ fields.T, rcond=None)[0]
        return np.asarray(fields - step.T @ columns)

    def predict(self, kept: Sequence[int]) -> Array:
        """Return the residual on every stretch of the model fitted on the others, (rows,)."""
        if self.columns.count <= MANY:
            return self.base(kept).residual
        # With hundreds of columns an inverse per stretch serves every choice of effects.
        index, mix, target = self._asked(kept)
        gone = np.setdiff1d(np.arange(self.columns.count), index)
        if gone.size > index.size:
            return self.base(kept).residual
        residual: Array = np.array(target)
        for b, rows in enumerate(self.spans):
            inverse = self._inverses[b]
            step = inverse @ self._right(b, mix, kept)
            if gone.size:
                step -= inverse[:, gone] @ np.linalg.solve(inverse[np.ix_(gone, gone)], step[gone])
            residual[rows] -= self.stretches[b].mixed(step)
            if (moved := self.anew(b, kept)) is not None:
                residual[rows] -= moved[rows]
        return residual

    @cached_property
    def _inverses(self) -> list[Array]:
        out = []
        for b in range(len(self.spans)):
            system, size = unit_diagonal(self._system(b, np.arange(self.columns.count)), REPEATED)
            # A base that only one stretch shows has columns of zeros without it; it stays put.
            unit = np.where(size > np.sqrt(EMPTY), 1.0 / size, 0.0)
            out.append(inverted(system) * unit[:, None] * unit)
        return out

    def base(self, kept: Sequence[int]) -> Base:
        index, mix, target = self._asked(kept)
        solvers, residual = list[Solver](), target.copy()
        for b, rows in enumerate(self.spans):
            if (moved := self.anew(b, kept)) is not None:
                residual[rows] -= moved[rows]
            if not index.size:
                continue
            solver = self._solver(b, index)
            whole = np.zeros(self.columns.count)
            whole[index] = solver(self._right(b, mix, kept)[index])
            residual[rows] -= self.stretches[b].mixed(whole)
            solvers.append(solver)
        return Base(self, kept, index, target, solvers, residual)

    def anew(self, b: int, kept: Iterable[int]) -> Array | None:
        """Return what the effects that a search alone chooses take off beyond now, (rows,), if any."""
        moved = [self._anew[k][b] for k in kept if k in self._anew]
        return np.sum(moved, axis=0) if moved else None

    @cached_property
    def _anew(self) -> Mapping[int, Array]:
        return self.searched(self.labels.astype(int).tobytes())

    def _solver(self, b: int, index: Index) -> Solver:
        """Return what solves the normal equations of some columns without one stretch."""
        if index.size == self.columns.count > MANY:
            return partial(np.matmul, self._inverses[b])
        system, size = unit_diagonal(self._system(b, index), REPEATED)
        solve = factored(system)

        def solved(right: Array) -> Array:
            unit = size if right.ndim == 1 else size[:, None]
            return solve(right / unit) / unit

        return solved

    def _asked(self, kept: Sequence[int]) -> tuple[Index, Array, Array]:
        """Return the columns of frames and some effects, the targets they explain, and the sum."""
        parts = [np.arange(self.parts[k].start, self.parts[k].stop) for k in sorted(kept)]
        index = np.concatenate([np.arange(self.frames), *parts]).astype(int)
        mix = np.ones(1 + len(self.parts))
        mix[[1 + k for k in kept]] = 0.0
        target = mix @ self.targets if mix[1:].any() else self.residual
        return index, mix, np.asarray(target)

    @cached_property
    def spans(self) -> list[Rows]:
        return rows_of(self.labels)

    @cached_property
    def stretches(self) -> list[Columns]:
        return [self.columns.within(rows) for rows in self.spans]

    @cached_property
    def normals(self) -> list[Array]:
        """Return the normal matrix of every stretch, where there are few columns."""
        return [part.normal() for part in self.stretches]

    @cached_property
    def _rights(self) -> list[Array]:
        """Return the products with all targets on all stretches but each, (P, 1 + K)."""
        return self._products(self.targets)

    @cached_property
    def rights_of_residual(self) -> list[Array]:
        """Return the same with the final residual alone, (P, 1)."""
        return self._products(self.residual[None])

    def _products(self, targets: Array) -> list[Array]:
        parts = zip(self.stretches, self.spans, strict=True)
        each = [part.products(targets[:, rows]) for part, rows in parts]
        whole = np.asarray(sum(each))
        return [whole - own for own in each]

    @cached_property
    def _total(self) -> Array:
        """Return the normal matrix of all columns on all stretches, with the priors."""
        few = self.columns.count <= MANY
        total = np.sum(self.normals, axis=0) if few else self.columns.normal()
        total[np.diag_indices_from(total)] += self.precision
        return np.asarray(total)

    def _system(self, b: int, index: Index) -> Array:
        """Return the normal matrix of some columns on all stretches but one."""
        total, many = self._total, self.columns.count > MANY
        own = self.stretches[b].chosen(index).normal() if many else self.normals[b]
        if index.size < self.columns.count:
            some = np.ix_(index, index)
            total, own = total[some], own if many else own[some]
        remaining = total - own
        remaining[np.diag_indices_from(remaining)] += ROUNDING * np.diag(total)
        return np.asarray(remaining)

    def _right(self, b: int, mix: Array, kept: Iterable[int]) -> Array:
        """Return the right-hand side of every column on all stretches but one."""
        right = self._rights[b] @ mix if mix[1:].any() else self.rights_of_residual[b][:, 0]
        if (moved := self.anew(b, kept)) is not None:
            right = right - self.columns.times(self.but_for(b, moved))
        return np.asarray(right - self.pull)

    def but_for(self, b: int, row: Array) -> Array:
        out = np.array(row)
        out[self.spans[b]] = 0.0
        return out

    def wandered(self) -> Array:
        """
        Return how far every effect's coordinates move as stretches are left out, shape (K,).

        Mean of the squared steps over what noise alone makes them; a formula that does not hold
        wants other parameters on every stretch. What a search alone chooses counts as a coordinate
        that moves the tool as its choices do: of a coordinate fitted without one of B stretches
        noise alone makes 1 / (B - 1) of a squared step, in noise.
        """
        every, mix = np.arange(self.columns.count), np.eye(1 + len(self.parts))[0]
        whole = _spread(self._total)
        ratios = np.zeros((len(self.spans), every.size))
        for b in range(len(self.spans)):
            remaining = self._system(b, every)
            system, size = unit_diagonal(remaining.copy(), REPEATED)
            step = factored(system)(self._right(b, mix, range(len(self.parts))) / size) / size
            more = np.maximum(_spread(remaining) - whole, ROUNDING * whole)
            ratios[b] = step**2 / np.maximum(more, EMPTY)
        reported = np.minimum(ratios, MOST_STEPS).mean(axis=0)
        out = np.array([reported[part].max(initial=0.0) for part in self.parts])
        for k, moved in self._anew.items():
            out[k] = min((len(moved) - 1) * self._beside(moved).mean(), MOST_STEPS)
        return out

    def missed(self) -> Array:
        """Return by what share errors grow without each effect, (K, parts of all ways to divide)."""
        ways, every = self.every_way(), range(len(self.parts))
        parts = parts_of([each.trusted_labels() for each in ways])

        def left(kept: Sequence[int]) -> Array:
            return np.concatenate([each.squares(each.predict(kept)) for each in ways])

        whole, less = left(every), ([k for k in every if k != out] for out in every)
        return np.array([growth(whole, left(kept), parts) for kept in less])

    def _beside(self, rows: Array) -> Array:
        """Return the squares of rows, (R, rows), that no column of the model can take up, (R,)."""
        system, size = unit_diagonal(self._total.copy(), REPEATED)
        along = self.columns.products(rows) / size[:, None]
        taken = (along * factored(system)(along)).sum(axis=0)
        return np.asarray(np.maximum((rows**2).sum(axis=1) - taken, 0.0))

    def squares(self, residual: Array) -> Array:
        """
        Return the squared position error of every trusted sample, shape (samples,) [m^2].

        Where an instrument tells how sure its poses are, a pose counts in each direction by that:
        the error of three coordinates that are as sure as the usual one.
        """
        out = []
        for root, part in zip(self.problem.roots, self.problem.by_sample(residual), strict=True):
            rows = part[:, :3] if root is None else part * np.sqrt(3 / part.shape[1])
            out.append((rows**2).sum(axis=1) * self.scale.position**2)
        weights = self._trusted(list(self.scale.weights))
        return np.concatenate(self._trusted(out)) / np.concatenate(weights)

    def rms(self, residual: Array) -> float:
        return float(np.sqrt(self.squares(residual).mean()))

    def turn_rms(self, residual: Array) -> float | None:
        """Return the RMS orientation error over trusted samples [rad], None without any."""
        rows = self.problem.measured_rows(residual, self.scale)
        parts = [part[:, 3:] for part in self._trusted(rows) if part.shape[1] > 3]
        return float(np.sqrt((np.concatenate(parts) ** 2).sum(axis=1).mean())) if parts else None

    def trusted_labels(self) -> Array:
        rows = self.problem.by_sample(self.labels)
        return np.concatenate([part[:, 0] for part in self._trusted(rows)])

    @cached_property
    def _good(self) -> list[NDArray[np.bool_]]:
        return trusted(self.scale.weights)

    def _trusted(self, parts: list[Array]) -> list[Array]:
        return [part[good] for part, good in zip(parts, self._good, strict=True)]


@dataclass(frozen=True, eq=False)
class Base:
    """A model fitted with each stretch left out in turn, ready to be given further columns."""

    unseen: Unseen
    kept: Sequence[int]
    index: Index
    target: Array
    solvers: list[Solver]
    residual: Array

    def gain(self, extra: Array) -> Gain:
        """Return what columns of unit mean square, (E, rows), take off at the best of a few ridges."""
        labels, before = self._known
        tried = self.extended(extra, RIDGES)
        return max(gain(before, self.unseen.squares(after), labels) for after in tried)

    def errors(self, residual: Array) -> Array:
        """Return the square of a residual, (rows,), in units of noise on every stretch."""
        return np.bincount(self.unseen.labels, residual**2).astype(float)

    @cached_property
    def _known(self) -> tuple[Array, Array]:
        return self.unseen.trusted_labels(), self.unseen.squares(self.residual)

    def extended(self, extra: Array, ridges: Sequence[float]) -> list[Array]:
        """Return the unseen residual with further columns (E, rows), (rows,) for every ridge."""
        spans = self.unseen.spans
        both = np.concatenate([extra, self.target[None]])
        crosses = [own.products(both[:, rows]) for own, rows in zip(self._own, spans, strict=True)]
        squares = [extra[:, rows] @ both[:, rows].T for rows in spans]
        cross_all, square_all = sum(crosses), sum(squares)
        outs = np.tile(self.target, (len(ridges), 1))
        for b, rows in enumerate(spans):
            here, mine = extra[:, rows], self._own[b]
            cross, right = np.split(cross_all - crosses[b], [extra.shape[0]], axis=1)
            square, pull = np.split(square_all - squares[b], [extra.shape[0]], axis=1)
            right, pull = right[:, 0] - self.unseen.pull[self.index], pull[:, 0]
            if (moved := self.unseen.anew(b, self.kept)) is not None:
                others = self.unseen.but_for(b, moved)
                right = right - self.unseen.columns.times(others)[self.index]
                pull = pull - extra @ others
                outs[:, rows] -= moved[rows]
            if self.index.size:
                solved = self.solvers[b](np.column_stack([cross, right]))
                square = square - cross.T @ solved[:, :-1]
                pull = pull - cross.T @ solved[:, -1]
            held = square + (np.array(ridges)[:, None, None] + FLAT) * np.eye(here.shape[0])
            more = np.linalg.solve(held, pull[:, None])[..., 0]
            outs[:, rows] -= more @ here
            if self.index.size:
                outs[:, rows] -= mine.mixed(solved[:, -1] - more @ solved[:, :-1].T)
        return list(outs)

    @cached_property
    def _own(self) -> list[Columns]:
        return [part.chosen(self.index) for part in self.unseen.stretches]


def _taken(problem: Problem, scale: Scale, fit: Fit) -> Array:
    """Return what each effect takes off the final residual, exactly, shape (K, rows)."""
    without = (fit.model.without(k) for k in range(len(fit.model.found)))
    remaining = [problem.whitened(problem.residuals(model), scale) for model in without]
    return np.array(remaining).reshape(-1, fit.residual.size) - fit.residual


def _searched(problem: Problem, scale: Scale, model: Model, labels: bytes) -> dict[int, Array]:
    """Return what each effect that a search alone chooses takes off beyond now, by its number."""
    parts = np.frombuffer(labels, dtype=int)
    chosen = (k for k, effect in enumerate(model.found) if effect.fit.chosen)
    return {k: chosen_anew(problem, model, scale, k, parts) for k in chosen}


def _spread(normal: Array) -> Array:
    """Return the variance of every coordinate, (P,), in units of noise."""
    system, size = unit_diagonal(normal.copy(), REPEATED)
    return np.asarray(np.diag(factored(system)(np.eye(size.size))) / size**2)


def _tether(model: Model) -> Array:
    """Return a weak prior precision, (K,), that keeps what a few stretches cannot show."""
    fits = (effect.fit for effect in model.found)
    sizes = [np.maximum(np.abs(own.coordinates()), own.coordinate_scales()) for own in fits]
    return 1.0 / (TETHER * np.concatenate([np.zeros(0), *sizes])) ** 2
