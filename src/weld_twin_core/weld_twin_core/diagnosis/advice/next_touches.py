# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The touches to make next: in which postures, of what, and how many."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ..algebra.problem import PLACES, Model, Problem, Scale
from ..hypotheses.library import plain_causes
from .touch_design import SECONDS, Design, Touchable, again, beside, chosen, scatter

_COUNT = 12
"""Touches that are proposed: a quarter of an hour by hand."""
MOST = 40
"""Touches up to which it is told how many are needed."""
_REACHABLE = 0.9
"""Share of what all touches together could narrow that counts as enough."""
_LEAST = 1e-9
"""Size of an effect that counts as none; keeps a share from a division by zero."""
_MOVING = 10.0
"""Cost [min] of fastening the artefact elsewhere."""


def next_touches(
    problem: Problem,
    model: Model,
    alternatives: Sequence[tuple[Effect, ...]],
    scale: Scale,
    *,
    elsewhere: bool = True,
) -> dict[str, Any] | None:
    """
    Return the touches to make next, as plain numbers and strings; None where none can be reached.

    problem: of contacts.
    model: as found, with its frames.
    alternatives: explanations that fit alike; with fewer than two, whatever narrows the arm's
    errors most is proposed.
    scale: the noise of a touch.
    elsewhere: whether what is touched can be moved.

    Returns
    -------
    dict or None
        As `next_experiment` returns it, of kind 'touches'; 'motion' has 'contact', what each
        posture touches, and 'needed' says how many touches reach nine tenths of what more touches
        can narrow (None where forty do not).

    """
    effects, disputed = _unknowns(problem, model, alternatives)
    design = Design.of(problem, model, effects, scale)
    groups = list(_touchable(problem, model, design, elsewhere))
    if not groups:
        return None
    spread = scatter([each for _, touches, _ in groups for each in touches], design.errors)
    weight = spread if disputed is None else _sizes(design, effects, disputed)
    options = [_Option.of(*group, weight) for group in groups]
    # Fewer than three places show nobody what carries over to another one.
    new = [option for option in options if option.place is not None]
    few = new if new and len(problem.recordings) < PLACES else options
    best = min(few, key=lambda option: option.best.open(weight))
    parted = None if disputed is None else best.best.open(weight) ** -0.5
    return _entry(best, spread, model, parted)


class _Option(NamedTuple):
    """
    Touches of what is there, or of one new place [m], in the order in which they are worth making.

    ``known`` is what is known before, and after each.
    """

    touches: list[Touchable]
    place: Array | None
    order: list[int]
    known: list[Design]

    @classmethod
    def of(
        cls, before: Design, touches: list[Touchable], place: Array | None, weight: Array
    ) -> _Option:
        """Return touches put in order by what they tell of weighed errors."""
        order, after = chosen(before, np.concatenate([t.rows for t in touches]), weight, MOST)
        return cls(touches, place, order, [before, *after])

    @property
    def best(self) -> Design:
        """Return what is known after the touches that are proposed."""
        return self.known[: _COUNT + 1][-1]

    def needed(self, spread: Array) -> int | None:
        """Return how many touches reach most of what more of them can narrow."""
        scatters = np.sqrt([design.open(spread) for design in self.known])
        enough = np.flatnonzero(
            scatters[0] - scatters >= _REACHABLE * (scatters[0] - scatters[-1])
        )
        return int(enough[0]) if len(self.order) == MOST else None


def _touchable(
    problem: Problem, model: Model, design: Design, elsewhere: bool
) -> Iterator[tuple[Design, list[Touchable], Array | None]]:
    """Yield further touches of all that is there, and of every new place."""
    same = [design.touchable(k, recording) for k, recording in again(problem, model)]
    if same:
        yield design, same, None
    wider, last = design.with_place(), len(problem.recordings)
    for recording in beside(problem, model) if elsewhere else ():
        there = wider.touchable(last, recording)
        yield wider, [there], recording.seen.position[0]


def _unknowns(
    problem: Problem, model: Model, alternatives: Sequence[tuple[Effect, ...]]
) -> tuple[list[Effect], set[tuple[str, ...]] | None]:
    """Return the errors that take part, and the keys of those that explanations differ in."""
    view = problem.features(model)[0].view
    every = {
        effect.key: effect for effect in plain_causes(model.robot, view, ('constant', 'load'))
    }
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
            out[at : at + x.size] = 1.0 / np.maximum(x @ x, _LEAST**2)
        at += x.size
    return np.diag(out)


def _entry(best: _Option, spread: Array, model: Model, parted: float | None) -> dict[str, Any]:
    """Return the proposal as plain numbers and strings."""
    rows, touches, place = best.order[:_COUNT], best.touches, best.place
    q = np.concatenate([each.recording.joints.q for each in touches])[rows]
    labels = [label for each in touches for label in each.recording.touched.labels]
    both = (best.known[0], best.best)
    before, after = (1e3 * each.sigma * each.open(spread) ** 0.5 for each in both)
    what = f'Touch what was touched in these {len(rows)} postures.'
    if place is not None:
        x, y, z = place
        what = (
            f'Move what is touched to about ({x:.2f}, {y:.2f}, {z:.2f}) m from the base, and touch '
            f'it there near these {len(rows)} postures.'
        )
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
        'motion': {
            'static': True,
            'joint_names': list(model.robot.joint_names),
            't': (SECONDS * np.arange(float(len(rows)))).tolist(),
            'q': q.round(7).tolist(),
            'contact': [labels[k] for k in rows],
        },
    }
