# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The cheapest further measurement that would decide between explanations that fit alike."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ...errors import TwinError
from ...recording import JointMotion
from ..algebra.problem import Model, Problem, Scale
from .candidates import Candidate, candidates
from .inseparable import way
from .separation import ahead, at_hand, separations

DECIDES = 6.0
"""Standard deviations from which a measurement decides between two explanations."""
NOTHING = 1.0
"""Standard deviations below which it says nothing."""
WORTH = 0.8
"""A cheaper measurement is taken when it decides this share of what the best one does."""
SAMPLES = 400
"""Samples of a candidate that are computed; neighbours of a moving arm say the same."""


def next_experiment(
    problem: Problem, model: Model, alternatives: Sequence[tuple[Effect, ...]], scale: Scale
) -> dict[str, Any] | None:
    """
    Return the measurement to make next, as plain numbers and strings.

    Parameters
    ----------
    problem, model, scale
        The data at hand, the model with its frames, and the noise.
    alternatives : sequence of tuple of Effect
        Explanations that fit alike. With fewer than two there is nothing to decide between, and
        what widens the data most is proposed.

    Returns
    -------
    dict or None
        'kind', 'sentence', 'reason', 'expected_separation_sigma' (None where nothing is compared),
        'cost' [min], 'between' (the two explanations it parts, each a list of effect and joint;
        None where nothing is compared) and 'motion': 'static', 'joint_names', 't' [s] and 'q'
        [rad, m]; 'motion' is None when no motion decides. 'skipped' says which measurements could
        not be foreseen. None when none could.

    """
    options = list(candidates(problem, model))
    if len(alternatives) < 2:
        return _entry(_widening(problem, options), _UNKNOWN, None, model)
    now = at_hand(problem, model, alternatives, scale)
    before = separations(now, None)
    tried, tables, skipped = [], [], []
    for option in options:
        try:
            both = separations(now, ahead(problem, option, alternatives, scale))
        except TwinError as error:
            # Data of another kind may lack what an explanation needs; the others still count.
            skipped.append(f'{option.kind}: {error}')
            continue
        tried.append(option)
        tables.append(np.sqrt(np.maximum(both**2 - before**2, 0.0)))
    chosen = _chosen(alternatives, model, tried, tables, before) if tried else None
    return chosen | {'skipped': skipped} if chosen and skipped else chosen


def _chosen(
    alternatives: Sequence[tuple[Effect, ...]],
    model: Model,
    options: Sequence[Candidate],
    tables: Sequence[Array],
    before: Array,
) -> dict[str, Any]:
    """Return the cheapest measurement that decides nearly as much as the best one."""
    pairs = list(combinations(range(len(alternatives)), 2))
    scores = np.array(
        [sum(min(table[p], DECIDES) for p in pairs if table[p] > NOTHING) for table in tables]
    )
    if scores.max() == 0.0:
        return _outside(alternatives[0], alternatives[1])
    enough = np.flatnonzero(scores >= WORTH * scores.max())
    best = min(enough.tolist(), key=lambda k: float(options[k].cost))
    pair = max(pairs, key=lambda p: tables[best][p])
    return _entry(
        options[best],
        _reason(alternatives, pair, before, tables[best]),
        float(tables[best][pair]),
        model,
        _sides(alternatives[pair[0]], alternatives[pair[1]]),
    )


_UNKNOWN = (
    'No effect of the library explains what is left; data of another kind show whether it '
    'depends on pose, direction or speed.'
)


def _widening(problem: Problem, options: Sequence[Candidate]) -> Candidate:
    """Return the kind of measurement that the data at hand lack."""
    static = all(r.joints.static for r in problem.recordings)
    wanted = 'speed_sweep' if static else 'bidirectional'
    return next(option for option in options if option.kind == wanted)


def _reason(
    alternatives: Sequence[tuple[Effect, ...]], pair: tuple[int, int], before: Array, after: Array
) -> str:
    first, second = _differing(alternatives[pair[0]], alternatives[pair[1]])
    return (
        f'The data at hand hold {first} and {second} {before[pair]:.1f} standard deviations '
        f'apart; this would add {after[pair]:.0f}.'
    )


def _outside(first: tuple[Effect, ...], second: tuple[Effect, ...]) -> dict[str, Any]:
    """Return what to do when no motion of the joints separates two explanations."""
    one, other = _differing(first, second)
    families = {effect.name for effect in _only(first, second) + _only(second, first)}
    return {
        'kind': 'outside',
        'motion': None,
        'cost': None,
        'between': _sides(first, second),
        'expected_separation_sigma': 0.0,
        'sentence': f'No motion tells {one} from {other}: {way(sorted(families))}.',
        'reason': 'Both move the tool alike wherever the joints go.',
    }


def _sides(
    first: tuple[Effect, ...], second: tuple[Effect, ...]
) -> list[list[dict[str, str | None]]]:
    """Return what each of two explanations has that the other has not."""
    return [
        [{'effect': e.name, 'joint': str(e.site) if e.site else None} for e in _only(one, other)]
        for one, other in ((first, second), (second, first))
    ]


def _differing(first: tuple[Effect, ...], second: tuple[Effect, ...]) -> tuple[str, str]:
    return _named(_only(first, second)), _named(_only(second, first))


def _only(effects: tuple[Effect, ...], others: tuple[Effect, ...]) -> list[Effect]:
    """Return the effects that the others do not have."""
    known = {effect.key for effect in others}
    return [effect for effect in effects if effect.key not in known]


def _named(effects: Sequence[Effect]) -> str:
    if not effects:
        return 'the rest alone'
    return ' with '.join(f'{e.name} of {e.site}' if e.site else e.name for e in effects)


def _entry(
    option: Candidate,
    reason: str,
    separation: float | None,
    model: Model,
    between: list[list[dict[str, str | None]]] | None = None,
) -> dict[str, Any]:
    return {
        'kind': option.kind,
        'sentence': f'{option.sentence} Check the motion for collisions first.',
        'reason': reason,
        'expected_separation_sigma': separation,
        'cost': option.cost,
        'between': between,
        'motion': _motion(option.recording.joints, model.robot.joint_names),
    }


def _motion(joints: JointMotion, names: Sequence[str]) -> dict[str, Any]:
    index = np.arange(joints.t.size)
    if index.size > SAMPLES:
        index = np.linspace(0, index.size - 1, SAMPLES).round().astype(int)
    return {
        'static': joints.static,
        'joint_names': list(names),
        't': joints.t[index].round(6).tolist(),
        'q': joints.q[index].round(7).tolist(),
    }
