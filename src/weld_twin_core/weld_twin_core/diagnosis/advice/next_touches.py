# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The touches to make next: in which postures, of what, and how many; chosen one by one.

Around what was found everything is linear: errors of the arm, the tool point where it is not
known, and where each contact is. The touch taken next is the one that most lowers the variance of
what is asked for [1]_: of predicted tool points, or of the sizes that part explanations.

References
----------
.. [1] V. V. Fedorov, "Theory of optimal experiments", Academic Press 1972.

"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arm.chain import forward
from ...arrays import Array, halton
from ...contacts import Artefact, Contact, Contacts, Places, places
from ...effects.effect import Effect
from ...motion.inverse.newton import reaching
from ...recording import JointMotion, Measurements, Recording
from ...twin.features import Features
from ..algebra.fit import effect_precision, frame_prior
from ..algebra.motions import plain_causes
from ..algebra.problem import PLACES, Model, Problem, Scale
from ..negligible import FLAT, MICROMETRE, ROUNDING
from .experiment import motion_entry
from .postures import widened
from .separation import Explanation

_ANYWHERE = 0.1
"""Spread [m] of where a contact may be: as good as not known."""
MOST = 40
"""Touches up to which the number needed is reported, and postures that are weighed at every place."""
_TRIED = 4 * MOST
"""Postures that are started from at every place; a third of them reach it within the limits."""
SECONDS = 60.0
"""Time from one touch to the next [s], by hand."""
_NEW = 'new place'
"""Label of what is touched where nothing has been touched yet."""
_APART = 0.2
"""Distance [m] of a new place from the others at the least."""
_BELOW = 0.05
"""How far a new place may lie below the lowest one [m]: there is a table."""


@dataclass(frozen=True, eq=False)
class _Touchable:
    """Touches that could be made, and what each sees of all unknowns, whitened, (N, 3, P)."""

    recording: Recording
    rows: Array


@dataclass(frozen=True, eq=False)
class Design:
    """What is known of the unknowns: errors of the arm first, then places."""

    model: Model  # with every error that takes part
    tool: bool  # whether the tool point is among the unknowns
    sigma: float  # noise of a touch [m]
    errors: int  # number of unknowns that are no place
    starts: tuple[int, ...]  # first unknown of every place
    surfaces: tuple[Places, ...]  # where contacts are
    root: Array
    """Its product with its transpose is the covariance of the unknowns, shape (P, P). Kept instead
    of it: with errors of micrometres and places that may be anywhere, rounding would make it
    negative."""

    @classmethod
    def of(cls, problem: Problem, model: Model, effects: Sequence[Effect], scale: Scale) -> Design:
        """Return what the touches at hand tell of errors as large as they were found."""
        # A base that is fitted along counts as known: another touch tells more of it anyway.
        problem = replace(problem, align=problem.align & {'tool'})
        model, tool = model.with_found(tuple(effects)), 'tool' in problem.align
        taken = [unknown for unknown in problem.touched if unknown is not None]
        sigma = max(scale.position, MICROMETRE)
        prior = np.concatenate([frame_prior(problem, model)[0], effect_precision(model)])
        freedom = [unknown.freedom for unknown in taken]
        starts = prior.size + np.cumsum([0, *freedom])
        information = np.diag(np.append(prior, np.full(sum(freedom), _ANYWHERE**-2.0)))
        surfaces = []
        for k, recording in enumerate(problem.recordings):
            points = model.twin(k).poses(recording, recording.joints.t).position
            surfaces.append(places(recording.touched, points))
            rows = _rows(model, k, recording, surfaces[k], points, tool) / sigma
            rows = rows * np.sqrt(scale.weights[k])[:, None, None]
            own = np.concatenate([np.arange(prior.size), np.arange(starts[k], starts[k + 1])])
            information[np.ix_(own, own)] += np.einsum('mcp,mcq->pq', rows, rows)
            ties, at = taken[k].ties, slice(starts[k], starts[k + 1])
            information[at, at] += ties.T @ ties
        return cls(
            model,
            tool,
            sigma,
            prior.size,
            tuple(starts[:-1].tolist()),
            tuple(surfaces),
            _root(information),
        )

    def with_place(self) -> Design:
        """Return the same with one more point somewhere."""
        size = len(self.root)
        wider = np.zeros((size + 3, size + 3))
        wider[:size, :size] = self.root
        wider[size:, size:] = _ANYWHERE * np.eye(3)
        return replace(self, starts=(*self.starts, size), root=wider)

    def touchable(self, k: int, recording: Recording) -> _Touchable:
        """Return touches of place k, or of a new one behind the last, as this sees them."""
        twin = min(k, len(self.surfaces) - 1)
        points = self.model.twin(twin).poses(recording, recording.joints.t).position
        if k < len(self.surfaces):
            where = Places(recording.touched, self.surfaces[k].surfaces)
        else:
            where = places(recording.touched, points)
        own = _rows(self.model, twin, recording, where, points, self.tool) / self.sigma
        rows = np.zeros((len(points), 3, len(self.root)))
        count, at = own.shape[1], self.starts[k]
        rows[:, :count, : self.errors] = own[..., : self.errors]
        rows[:, :count, at : at + own.shape[2] - self.errors] = own[..., self.errors :]
        return _Touchable(recording, rows)

    def after(self, rows: Array) -> Design:
        _, size, ways = np.linalg.svd(rows @ self.root, full_matrices=False)
        less = 1.0 - 1.0 / np.sqrt(1.0 + size**2)
        return replace(self, root=self.root - (self.root @ ways.T) * less @ ways)

    def open(self, weight: Array) -> float:
        """Return how much of what is asked for is not known: the weighed sum of variances."""
        own = self.root[: self.errors]
        return float(np.einsum('pi,pi->', own, weight @ own))

    def lowered(self, rows: Array, weight: Array) -> Array:
        """Return by how much each touch, (N, 3, P), lowers what is `open`, shape (N,)."""
        half = rows @ self.root
        seen = np.eye(3) + half @ np.swapaxes(half, 1, 2)
        own = half @ self.root[: self.errors].T
        wanted = own @ weight @ np.swapaxes(own, 1, 2)
        return np.asarray(np.trace(np.linalg.solve(seen, wanted), axis1=1, axis2=2))


def scatter(touches: Sequence[_Touchable], errors: int) -> Array:
    """Return the weight of errors in how far tool points scatter, in noise squared, (E, E)."""
    each = [t.rows[..., :errors] - t.rows[..., :errors].mean(axis=0) for t in touches]
    count = sum(len(rows) for rows in each)
    return np.asarray(sum(np.einsum('mcp,mcq->pq', rows, rows) for rows in each) / count)


def chosen(
    design: Design, rows: Array, weight: Array, count: int
) -> tuple[list[int], list[Design]]:
    """Return which touches (N, 3, P) to make, in order, by weights (E, E), and what each leaves open."""
    free = np.ones(len(rows), dtype=bool)
    order: list[int] = []
    after: list[Design] = []
    for _ in range(min(count, len(rows))):
        reported = np.where(free, design.lowered(rows, weight), -np.inf)
        best = int(np.argmax(reported))
        free[best] = False
        design = design.after(rows[best])
        order.append(best)
        after.append(design)
    return order, after


def _rows(
    model: Model, k: int, recording: Recording, where: Places, points: Array, tool: bool
) -> Array:
    """Return what touches see of the errors and of their own place, shape (M, c, E + Z)."""
    maker = Features(model.twin(k), recording, recording.joints.t)
    columns = [maker.columns(effect, False) for effect in model.found]
    if tool:
        columns.insert(0, np.stack([maker.column(('tool', j)) for j in range(6)]))
    _, seen, free = where.rows(points)
    moved = np.einsum('mci,pim->mcp', seen, np.concatenate(columns)[:, :3])
    return np.concatenate([-moved, free], axis=2)


def _root(information: Array) -> Array:
    """Return a root of the inverse of a normal matrix."""
    size = np.sqrt(np.diag(information))
    # Touched points see no turn of the tool, and of a curve nothing is believed.
    size[size == 0.0] = 1.0
    strength, ways = np.linalg.eigh(information / np.outer(size, size))
    strength = np.maximum(strength, ROUNDING * strength[-1])
    return np.asarray(ways / np.sqrt(strength) / size[:, None])


def again(problem: Problem, model: Model) -> Iterator[tuple[int, Recording]]:
    """Yield each place's number, and touches within its joints, widened, and its lean of the tool."""
    for k, recording in enumerate(problem.recordings):
        contacts, measured = recording.touched, recording.seen
        rows = np.arange(_TRIED) % contacts.size
        q, kept = _reached(problem, model, [recording], measured.position[rows])
        if kept.size:
            rows = rows[kept]
            labels = tuple(contacts.labels[row] for row in rows)
            value = None if contacts.value is None else contacts.value[rows]
            touched = Contacts(contacts.artefact, labels, value)
            yield k, _touching(recording, q, measured.position[rows], touched)


def _beside(problem: Problem, model: Model) -> Iterator[Recording]:
    """Yield touches of places where nothing was touched, each far from all others."""
    low, high = widened(problem, model.robot)
    known = [recording.seen.position.mean(axis=0) for recording in problem.recordings]
    lowest = min(float(point[2]) for point in known) - _BELOW
    free = forward(model.robot, low + halton(model.robot.n, _TRIED) * (high - low))[:, :3, 3]
    free = free[free[:, 2] > lowest]
    for _ in range(PLACES):
        if not free.size:
            return
        away = np.min([np.linalg.norm(free - point, axis=1) for point in known], axis=0)
        point = free[int(np.argmax(away))]
        if away.max() < _APART:
            return
        known.append(point)
        targets = np.tile(point, (_TRIED, 1))
        q, kept = _reached(problem, model, problem.recordings, targets)
        if kept.size:
            contacts = Contacts(Artefact((Contact(_NEW),)), (_NEW,) * kept.size)
            yield _touching(problem.recordings[0], q, targets[kept], contacts)


def _reached(
    problem: Problem, model: Model, recordings: Sequence[Recording], to: Array
) -> tuple[Array, NDArray[np.intp]]:
    """Return postures that may be taken, as the tool has leaned in recordings, and at which targets."""
    robot = model.robot
    low, high = widened(problem, robot)
    start = low + halton(robot.n, len(to)) * (high - low)
    q, good = reaching(robot, to, start)
    good &= ((q >= low) & (q <= high)).all(axis=1)
    leaned = np.concatenate([forward(robot, r.joints.q)[:, :3, 2] for r in recordings])
    middle = leaned.mean(axis=0) / max(float(np.linalg.norm(leaned.mean(axis=0))), FLAT)
    good &= forward(robot, q)[:, :3, 2] @ middle >= (leaned @ middle).min()
    kept = np.flatnonzero(good)[:MOST]
    return q[kept], kept


def _touching(recording: Recording, q: Array, points: Array, contacts: Contacts) -> Recording:
    t = SECONDS * np.arange(float(len(q)))
    motion = JointMotion(t, q, static=True)
    return replace(recording, joints=motion, measured=Measurements(t, points), contacts=contacts)


_COUNT = 12
"""Touches that are proposed: a quarter of an hour by hand."""
_REACHABLE = 0.9
"""Share of what all touches together could narrow that counts as enough."""
_MOVING = 10.0
"""Cost [min] of fastening the artefact elsewhere."""


def next_touches(
    problem: Problem, model: Model, alternatives: Sequence[Explanation], scale: Scale
) -> dict[str, Any] | None:
    """
    Return the touches to make next, as plain numbers and strings; None where none can be reached.

    alternatives: explanations that fit alike; with fewer than two, whatever narrows the arm's
    errors most is proposed.

    As `next_experiment` returns it, of kind 'touches'; 'motion' has 'contact', what each posture
    touches, and 'needed' says how many touches reach nine tenths of what more touches can narrow
    (None where forty do not).
    """
    effects, disputed = _unknowns(problem, model, alternatives)
    design = Design.of(problem, model, effects, scale)
    groups = list(_touchable(problem, model, design))
    if not groups:
        return None
    spread = scatter([each for _, touches, _ in groups for each in touches], design.errors)
    weight = spread if disputed is None else _sizes(design, effects, disputed)
    options = [_Option.of(*group, weight) for group in groups]
    # Fewer than three places show nobody what carries over to another one.
    new = [option for option in options if option.place is not None]
    few = new if new and len(problem.recordings) < PLACES else options
    best = min(few, key=lambda option: option.best.open(weight))
    parted = None if disputed is None else 1.0 / float(np.sqrt(best.best.open(weight)))
    return _entry(best, spread, model, parted)


class _Option(NamedTuple):
    """Touches of one place [m] in the order they are worth making in; known before, after each."""

    touches: list[_Touchable]
    place: Array | None
    order: list[int]
    known: list[Design]

    @classmethod
    def of(
        cls, before: Design, touches: list[_Touchable], place: Array | None, weight: Array
    ) -> _Option:
        order, after = chosen(before, np.concatenate([t.rows for t in touches]), weight, MOST)
        return cls(touches, place, order, [before, *after])

    @property
    def best(self) -> Design:
        return self.known[: _COUNT + 1][-1]

    def needed(self, spread: Array) -> int | None:
        """Return how many touches reach most of what more of them can narrow."""
        scatters = np.sqrt([design.open(spread) for design in self.known])
        narrowed = scatters[0] - scatters
        enough = np.flatnonzero(narrowed >= _REACHABLE * narrowed[-1])
        return int(enough[0]) if len(self.order) == MOST else None


def _touchable(
    problem: Problem, model: Model, design: Design
) -> Iterator[tuple[Design, list[_Touchable], Array | None]]:
    """Yield further touches of all that is there, and of every new place."""
    same = [design.touchable(k, recording) for k, recording in again(problem, model)]
    if same:
        yield design, same, None
    wider, last = design.with_place(), len(problem.recordings)
    for recording in _beside(problem, model):
        there = wider.touchable(last, recording)
        yield wider, [there], recording.seen.position[0]


def _unknowns(
    problem: Problem, model: Model, alternatives: Sequence[Explanation]
) -> tuple[list[Effect], set[tuple[str, ...]] | None]:
    """Return the errors that take part, and the keys of those that explanations differ in."""
    view = problem.features(model)[0].view
    every = {e.key: e for e in plain_causes(model.robot, view, ('constant', 'load'))}
    for effects in (*alternatives, model.found):
        every |= {effect.key: effect for effect in effects}
    if len(alternatives) < 2:
        return list(every.values()), None
    each = [{effect.key for effect in effects} for effects in alternatives]
    disputed = {key for keys in each for key in keys if not all(key in other for other in each)}
    return list(every.values()), disputed or None


def _sizes(design: Design, effects: Sequence[Effect], disputed: set[tuple[str, ...]]) -> Array:
    """Return the weight that asks for the disputed sizes: each variance over the square found."""
    out = np.zeros(design.errors)
    at = design.errors - sum(effect.fit.coordinates().size for effect in effects)
    for effect in effects:
        x = effect.fit.coordinates()
        if effect.key in disputed:
            out[at : at + x.size] = 1.0 / np.maximum(x @ x, FLAT**2)
        at += x.size
    return np.diag(out)


def _entry(best: _Option, spread: Array, model: Model, parted: float | None) -> dict[str, Any]:
    rows, touches, place = best.order[:_COUNT], best.touches, best.place
    q = np.concatenate([each.recording.joints.q for each in touches])[rows]
    labels = [label for each in touches for label in each.recording.touched.labels]
    both = (best.known[0], best.best)
    before, after = (1e3 * each.sigma * float(np.sqrt(each.open(spread))) for each in both)
    what = f'Touch what was touched in these {len(rows)} postures.'
    if place is not None:
        x, y, z = place
        what = (
            f'Move what is touched to about ({x:.2f}, {y:.2f}, {z:.2f}) m from the base, and touch '
            f'it there near these {len(rows)} postures.'
        )
    t = SECONDS * np.arange(float(len(rows)))
    motion = motion_entry(JointMotion(t, q, static=True), model.robot.joint_names)
    needed = best.needed(spread)
    enough = '' if needed is None else f' {needed} touches reach nine tenths of what more can.'
    return {
        'kind': 'touches',
        'sentence': f'{what} Guide the arm by hand, and lift it off between two of them.',
        'reason': f'What the model predicts about here is foreseen to scatter by {after:.2f} mm instead '
        f'of {before:.2f} mm.{enough}',
        'expected_separation_sigma': parted,
        'cost': len(rows) * SECONDS / 60.0 + (0.0 if place is None else _MOVING),
        'between': None,
        'needed': needed,
        'motion': motion | {'contact': [labels[k] for k in rows]},
    }
