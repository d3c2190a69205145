# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The library of hypotheses: every family on every joint it can sit on, as columns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arm.robot import Robot
from ...arrays import Array
from ...effects.effect import Effect, Stage
from ...effects.plausible import ranges
from ...twin.features import joints_of
from ..algebra.columns import SHOWN, Columns, Maker, Piece
from ..algebra.motions import (
    REASON,
    candidate_kinds,
    hardly_moves,
    lacking,
    moved_most,
    order_alone,
    set_instead,
    together,
)
from ..algebra.problem import Model, Problem, Scale
from ..algebra.workspace import Library, Role, SeedSystems, Unit
from ..result import Site

EXCLUDED = 'excluded by the user'
FEW = 2
"""Instances of a kind that are tried on a joint at rest: what leaks in from either side; of waves
one does, as all stand still."""


def build(problem: Problem, model: Model, scale: Scale, exclude: Sequence[str] = ()) -> Library:
    """Return the library at a model; what is excluded, or not to be found, is in it to be compared."""
    shelf = _Shelf(problem, model, scale, exclude)
    for kind in candidate_kinds(problem.align):
        for joint in joints_of(kind, model.robot):
            shelf.add(kind, joint)
    for sudden in problem.dated:
        if sudden.name not in exclude:
            shelf.place(Site.of(sudden), [sudden], float(sum(problem.samples)))
    index = [own for unit in shelf.units for own in unit.columns]
    systems = SeedSystems.of(index, shelf.normals)
    columns = Columns.joined(shelf.pieces or [Piece(np.zeros((0, problem.size)))])
    return Library(columns, systems, tuple(shelf.units), shelf.absent)


class _Shelf:
    """A library in the making: its columns so far, one piece for every seed, and its units."""

    def __init__(
        self, problem: Problem, model: Model, scale: Scale, exclude: Sequence[str]
    ) -> None:
        self.robot, self.features = model.robot, problem.features(model)
        self.excluded = frozenset(exclude)
        self.alike = set_instead(model.robot, problem.align, self.excluded)
        self.absent = dict.fromkeys(exclude, EXCLUDED)
        self.pieces: list[Piece] = []
        self.normals: list[Array] = []
        self.units: list[Unit] = []
        self._count = 0
        self._still: dict[str, dict[str, None]] = {}
        self._maker = Maker(problem, self.features, scale)
        self._residual = problem.whitened(problem.residuals(model), scale)
        self._ends = np.cumsum(problem.samples)

    def add(self, kind: type[Effect], joint: str | None) -> None:
        """Add a family on a joint, or tell why it is absent."""
        if (reason := lacking(self.features, kind, joint)) is not None:
            self.absent.setdefault(kind.name, reason)
            return
        result, trials = self._seeds(kind, joint)
        seeds = [seed for seed in result if not hardly_moves(self.features, seed)]
        site = Site(kind.name, joint)
        role = Role.ALIKE if site in self.alike else Role.FOUND
        if kind.name in self.excluded:
            role = Role.TAKEN_OUT
        elif len(seeds) < len(result):
            self._leave_out(kind.name, str(joint))
        self.place(site, seeds, trials, role)
        if not seeds:
            self.place(site, self._constants(kind, joint), 1.0, Role.ALIKE)

    def _seeds(self, kind: type[Effect], joint: str | None) -> tuple[list[Effect], float]:
        """Return the instances that are looked for, and among how many they were chosen."""
        if kind.traits.waves is not None and joint is not None:
            most = min(kind.traits.waves.dense, order_alone(self.features, joint))
            lines = kind.search.lines(joint, np.arange(1.0, most + 1.0))
            return lines, float(len(lines))
        k, pull, own = moved_most(self.features, joint), None, None
        if joint is not None:
            moved = self._maker.moved(self.features[k].twin.robot.index(joint))
            pull = moved.summed(self._residual)
            own = np.split(pull, self._ends[:-1])[k]
        result, trials = self.features[k].seeds(kind, joint, own)
        if result or len(self.features) == 1 or kind.stage in (Stage.SERVO, Stage.PLAY):
            return result, trials
        # A load that lies on one side in each recording may lie on the other in the next.
        view = together(self.features)
        result = list(kind.seeds(view, joint, pull))
        return result, kind.search.trials(view, joint) or float(len(result))

    def _constants(self, kind: type[Effect], joint: str | None) -> list[Effect]:
        """Return instances that are no more than a constant of a joint on these motions."""
        if kind.of != 'joint':
            return []
        view = self.features[moved_most(self.features, joint)].view
        out = list(kind.search.constants(view, joint))
        if kind.traits.by_motion and kind.stage not in (Stage.SERVO, Stage.PLAY):
            seeds = list(kind.seeds(view, joint))[:FEW]
            out += [seed for seed in seeds if hardly_moves(self.features, seed)]
        return out

    def _leave_out(self, family: str, joint: str) -> None:
        still = self._still.setdefault(family, {})
        still[joint] = None
        self.absent[family] = f'{REASON} ({", ".join(still)})'

    def place(
        self, site: Site, seeds: Sequence[Effect], trials: float, role: Role = Role.FOUND
    ) -> None:
        every = ((seed, self._maker.piece(seed)) for seed in seeds)
        shown = [(seed, piece) for seed, piece in every if _shown(seed, piece)]
        if not shown:
            return
        # Seeds of a kind on a joint differ in what bends them alone, and are believed alike.
        alike = {piece.count: seed for seed, piece in shown}
        prior = {count: _prior_precision(self.robot, seed, count) for count, seed in alike.items()}
        columns = []
        for _, piece in shown:
            self.pieces.append(piece)
            self.normals.append(piece.normal() + prior[piece.count])
            columns.append(np.arange(self._count, self._count + piece.count))
            self._count += piece.count
        kept = tuple(seed for seed, _ in shown)
        surprise = tuple(seed.search.surprise(trials) for seed in kept)
        self.units.append(Unit(site, kept, tuple(columns), surprise, role))


def _shown(seed: Effect, piece: Piece) -> bool:
    """Return whether the data show a seed: even a thousand times the typical effect may be no noise."""
    scales = seed.fit.coordinate_scales()
    reach = 1e3 * float(scales.max()) if scales.size else 1.0
    return bool(piece.peaks().max(initial=0.0) * reach > SHOWN)


def _prior_precision(robot: Robot, seed: Effect, count: int) -> Array:
    """
    Return the prior precision of a seed's columns, shape (K, K): no machine has more than its range.

    The range and not the spread: the noise that a search begins with is what all causes leave.
    """
    reach = np.max(np.abs(ranges(robot, seed)), axis=0)
    straight = seed.fit.straight()
    each = [seed.from_atoms(one).fit.coordinates() for one in np.eye(count)]
    share = np.array([(own / reach)[straight] for own in each])
    return np.diag((share**2).sum(axis=1))
