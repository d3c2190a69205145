# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The library of hypotheses: every family on every joint it can sit on, as columns."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from ...arm.robot import Robot
from ...arrays import Array
from ...effects.effect import Effect
from ...effects.registry import REGISTRY
from ...effects.view import View
from ...twin.features import Features, joints_of
from ..algebra.atoms import Amounts, Columns, MovedJoint, Whole, amounts, gathered, moved_joint
from ..algebra.problem import Model, Problem, Scale
from .seed_systems import SeedSystems, Unit
from .still_joints import REASON, hardly_moves, moved_most, orders_told

EXCLUDED = 'excluded by the user'


@dataclass(frozen=True, eq=False)
class Library:
    """
    Columns of every unit.

    Attributes
    ----------
    pieces : tuple of Columns
        All columns, whitened, in the order of their numbers.
    systems : SeedSystems
        The normal matrix of every seed.
    absent : dict
        Why a family is not considered, by name.

    """

    pieces: tuple[Columns, ...]
    systems: SeedSystems
    units: tuple[Unit, ...]
    absent: dict[str, str]

    def products(self, rows: Array) -> Array:
        """Return the products of all columns with rows, shape (R, rows), as shape (P, R)."""
        result = [piece.products(rows) for piece in self.pieces]
        return np.concatenate([np.zeros((0, rows.shape[0])), *result])

    def column(self, number: int) -> Array:
        """Return one column, whitened, shape (rows,)."""
        ends = np.cumsum([piece.count for piece in self.pieces])
        k = int(np.searchsorted(ends, number, side='right'))
        return np.asarray(self.pieces[k].written_out()[number - int(ends[k])])

    def unit(self, family: str, joint: str | None) -> Unit | None:
        """Return a unit by name, or None."""
        for unit in self.units:
            if unit.site == (family, joint):
                return unit
        return None


def candidate_kinds(exclude: Sequence[str], align: frozenset[str]) -> list[type[Effect]]:
    """Return the kinds of effect that may be a cause, in the order of their stages."""
    kinds = [
        kind
        for kind in REGISTRY.values()
        if kind.traits.cause
        and not kind.traits.dated
        and kind.name not in exclude
        and kind.traits.fitted_with not in align
    ]
    return sorted(kinds, key=lambda kind: (kind.stage, kind.name))


def build(problem: Problem, model: Model, scale: Scale, exclude: Sequence[str] = ()) -> Library:
    """Return the library at a model: one set of columns that all hypotheses share."""
    features = problem.features(model)
    pulls = _pulls(problem, model, scale)
    shelf = _Shelf(problem, scale, features, pulls, dict.fromkeys(exclude, EXCLUDED))
    for kind in candidate_kinds(exclude, problem.align):
        for joint in joints_of(kind, model.robot):
            shelf.add(kind, joint)
    for sudden in problem.dated:
        if sudden.name not in exclude:
            shelf.add_dated(sudden)
    columns = [index for unit in shelf.units for index in unit.columns]
    systems = SeedSystems.of(columns, [piece.normal() for piece in shelf.pieces])
    return Library(tuple(gathered(shelf.pieces)), systems, tuple(shelf.units), shelf.absent)


def _pulls(problem: Problem, model: Model, scale: Scale) -> list[Array]:
    """Return how strongly what is left pulls at the tool of every recording, (3 or 6, M) each."""
    known = (problem.informed(k, r, scale) for k, r in enumerate(problem.residuals(model)))
    return [problem.pulled(k, rows) for k, rows in enumerate(known)]


def _applicable(kind: type[Effect], joint: str | None, features: list[Features]) -> str | None:
    reasons = [kind.applicable(maker.view, joint) for maker in features]
    return None if None in reasons else reasons[0]


class _Shelf:
    """A library in the making: its columns so far, one piece for every seed, and its units."""

    def __init__(
        self,
        problem: Problem,
        scale: Scale,
        features: list[Features],
        pulls: Sequence[Array],
        absent: dict[str, str],
    ) -> None:
        self.problem, self.scale, self.features = problem, scale, features
        self.pulls, self.absent = pulls, absent
        self.pieces: list[Columns] = []
        self.units: list[Unit] = []
        self._count = 0
        self._joints: dict[int, MovedJoint] = {}

    def add(self, kind: type[Effect], joint: str | None) -> None:
        """Add a family on a joint, or tell why it is absent."""
        reason = _applicable(kind, joint, self.features)
        if reason is not None:
            self.absent[kind.name] = reason
            return
        result, trials = self._seeds(kind, joint)
        seeds = [seed for seed in result if not hardly_moves(self.features, seed)]
        if len(seeds) < len(result):
            self._leave_out(kind.name, str(joint))
        self._place(kind.name, joint, seeds, trials)

    def _seeds(self, kind: type[Effect], joint: str | None) -> tuple[list[Effect], float]:
        """Return the instances that are looked for, and among how many they were chosen."""
        if kind.traits.waves is not None and joint is not None:
            most = min(kind.traits.waves.dense, orders_told(self.features, joint))
            lines = kind.search.lines(joint, np.arange(1.0, most + 1.0))
            return lines, float(len(lines))
        k = moved_most(self.features, joint)
        return self.features[k].seeds(kind, joint, self.pulls[k])

    def _leave_out(self, family: str, joint: str) -> None:
        """Tell that a joint, too, hardly moves."""
        reported = self.absent.get(family, '')
        others = (
            reported.removeprefix(f'{REASON} (').rstrip(')') if reported.startswith(REASON) else ''
        )
        joints = [*filter(None, others.split(', ')), joint]
        self.absent[family] = f'{REASON} ({", ".join(dict.fromkeys(joints))})'

    def add_dated(self, sudden: Effect) -> None:
        """Add what gave way at an instant that the data checks found."""
        self._place(sudden.name, sudden.site, [sudden], float(sum(self.problem.samples)))

    def _place(
        self, family: str, joint: str | None, seeds: Sequence[Effect], trials: float
    ) -> None:
        """Add the unit of those seeds that the data show."""
        shown = [(seed, piece) for seed in seeds if (piece := self._columns(seed)) is not None]
        columns = []
        for _, piece in shown:
            self.pieces.append(piece)
            columns.append(np.arange(self._count, self._count + piece.count))
            self._count += piece.count
        if shown:
            kept = tuple(seed for seed, _ in shown)
            self.units.append(Unit(family, joint, kept, tuple(columns), trials))

    def _columns(self, seed: Effect) -> Columns | None:
        """Return a seed's whitened columns, or None when the data do not show it."""
        shifts = [maker.shifts(seed) for maker in self.features]
        joint = moved_joint(shifts)
        piece: Columns
        if joint is None or self.problem.touched:
            changes = [m.changes(own) for m, own in zip(self.features, shifts, strict=True)]
            parts = [self.problem.seen(k, change) for k, change in enumerate(changes)]
            piece = Whole(self.problem.whitened(parts, self.scale))
        else:
            piece = Amounts(self._moved(joint), amounts(shifts, joint, self.problem.samples))
        # Even a thousand times the typical effect would stay far below the noise.
        scales = seed.fit.coordinate_scales()
        reach = 1e3 * float(scales.max()) if scales.size else 1.0
        return piece if piece.largest() * reach > 1e-2 else None

    def _moved(self, joint: int) -> MovedJoint:
        if joint not in self._joints:
            made = MovedJoint.of(self.problem, self.features, self.scale, joint)
            self._joints[joint] = made
        return self._joints[joint]


def plain_causes(robot: Robot, view: View, on: Collection[str]) -> list[Effect]:
    """
    Return causes in joints and links that depend on nothing but some quantities, at zero.

    Parameters
    ----------
    view : View
        The samples that reach them.
    on : collection of str
        What they may depend on: 'constant', 'load'.

    """
    out: dict[tuple[str, ...], Effect] = {}
    for kind in REGISTRY.values():
        if kind.of not in ('joint', 'link') or not kind.traits.cause or kind.traits.dated:
            continue
        for joint in joints_of(kind, robot):
            if kind.applicable(view, joint) is None:
                out |= {e.key: e for e in kind.search.small(view, joint, 1) if e.on in on}
    return list(out.values())
