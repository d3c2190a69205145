# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The cheapest further measurement that would decide between explanations that fit alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...effects.curves import JointCurve, basis
from ...effects.effect import Effect
from ...effects.registry import way
from ...errors import TwinError
from ...recording import JointMotion
from ..algebra.problem import Model, Problem, Scale
from .candidates import Candidate, candidates
from .chosen_pieces import Plan, planned, widening
from .postures import Limits
from .separation import Explanation, at_hand

_WORTH = 0.8
"""A cheaper measurement is taken when it decides this share of what the best one does."""
_NEAR = 0.5
"""Minutes within which measurements take equally long."""
_MOST_KNOTS = 40
"""Knots of a curve that is carried on over the whole range of an experiment."""
_PACE = 0.1
"""Time [s] between the samples of a path as it is written: a spline through them is the path."""


def next_experiment(
    problem: Problem,
    model: Model,
    alternatives: Sequence[Explanation],
    scale: Scale,
    limits: Limits | None = None,
    *,
    closed: bool = True,
    named: int = 1,
) -> dict[str, Any] | None:
    """
    Return the measurement to make next, as plain numbers and strings; None if none can be foreseen.

    alternatives: explanations that fit alike. With fewer than two there is nothing to decide
    between, and what widens the data most is proposed.
    closed: whether one of the alternatives is believed to be true. Where no motion parts them,
    this is then said; otherwise the data are widened.
    named: so many of the alternatives, the first ones, are named by the verdict: to part these
    comes first.

    'cost' and, of that, 'robot_minutes' are in minutes. 'between', the two explanations that it
    parts, and 'expected_separation_sigma' are None where nothing is compared, 'stations' of a path,
    'motion' where no motion decides. 'skipped' says which measurements could not be foreseen.
    """
    limits = limits or Limits()
    joints = [e.site for effects in alternatives for e in effects if e.site]
    asked = [joint for joint in dict.fromkeys(joints) if joints.count(joint) < len(alternatives)]
    options = list(candidates(problem, model, limits, asked))

    def wider(reason: str) -> dict[str, Any]:
        return _entry(widening(problem, options, limits), reason, model)

    if len(alternatives) < 2:
        return wider(_UNKNOWN)
    plans, skipped = _plans(problem, model, alternatives, scale, limits, options, named)
    if not plans:
        return None
    best = max(plan.score for plan in plans)
    decided = not closed and all(plan.decided for plan in plans)
    if decided:
        proposal = wider(_DECIDED)
    elif best == 0.0:
        proposal = _outside(alternatives[0], alternatives[1]) if closed else wider(_ALIKE)
    else:
        good = [plan for plan in plans if plan.score >= _WORTH * best]
        if not problem.at_rest:
            # An instrument that follows the tool learns more in a minute than at four stations.
            good = [plan for plan in good if not plan.candidate.static] or good
        least = min(plan.minutes for plan in good)
        # Half a minute is no reason to learn less.
        near = [plan for plan in good if plan.minutes <= least + _NEAR]
        proposal = _comparison(max(near, key=lambda plan: plan.apart), alternatives, model)
    return proposal | {'skipped': skipped} if skipped else proposal


def confirming(
    problem: Problem, model: Model, joints: Sequence[str], limits: Limits
) -> dict[str, Any]:
    """Return the measurement that shows if an answer holds once joints, its 'confirms', move widely."""
    options = list(candidates(problem, model, limits, joints))
    reason = _NARROW.format(joints=', '.join(joints))
    return _entry(widening(problem, options, limits), reason, model) | {'confirms': list(joints)}


def _plans(
    problem: Problem,
    model: Model,
    alternatives: Sequence[Explanation],
    scale: Scale,
    limits: Limits,
    options: Sequence[Candidate],
    named: int,
) -> tuple[list[Plan], list[str]]:
    """Return the best of every kind of measurement, and what could not be foreseen."""
    now = at_hand(problem, model, alternatives, scale)
    plans, skipped = [], []
    for option in options:
        try:
            plan = planned(problem, model, alternatives, scale, limits, option, now, named)
        except TwinError as error:
            # Data of another kind may lack what an explanation needs; the others still count.
            skipped.append(f'{option.kind}: {error}')
            continue
        if plan is not None:
            plans.append(plan)
    return plans, skipped


_UNKNOWN = (
    'No effect of the library explains what is left; data of another kind show whether it '
    'depends on pose, direction or speed.'
)
_DECIDED = (
    'What is believed is parted from what else it could be, but answers from recordings like these '
    'are often wrong: data from elsewhere show whether it holds.'
)
_ALIKE = (
    'The explanations at hand move the tool alike, and none of them is sure: data from elsewhere '
    'show whether they hold.'
)
_NARROW = (
    'Little was seen of {joints}: what depends on the angle of a joint that hardly moves looks like '
    'something else. Data in which all move widely show whether the answer holds.'
)


def _comparison(plan: Plan, alternatives: Sequence[Explanation], model: Model) -> dict[str, Any]:
    one, other = _apart(alternatives[0], alternatives[plan.other])
    names = ' from '.join(filter(None, (_named(one, other), _named(other, one))))
    reason = (
        f'The data at hand tell {names} by {plan.before:.1f} standard deviations; this would add '
        f'{plan.after:.0f}.'
    )
    return _entry(plan, reason, model, [_side(one), _side(other)])


def _outside(first: Explanation, second: Explanation) -> dict[str, Any]:
    """Return what to do when no motion of the joints separates two explanations."""
    one, other = _apart(first, second)
    names = [_named(*pair) or 'nothing more' for pair in ((one, other), (other, one))]
    families = sorted({effect.name for effect in one + other})
    return {
        **dict.fromkeys(('motion', 'cost', 'robot_minutes', 'stations')),
        'kind': 'outside',
        'between': [_side(one), _side(other)],
        'changes': '',
        'expected_separation_sigma': 0.0,
        'sentence': f'No motion tells {names[0]} from {names[1]}: {way(families)}.',
        'reason': 'Both move the tool alike wherever the joints go.',
    }


def _apart(first: Explanation, second: Explanation) -> tuple[list[Effect], list[Effect]]:
    """Return the effects of each of two explanations that the other has not."""
    one, other = ({(e.key, e.on) for e in effects} for effects in (first, second))
    return [e for e in first if (e.key, e.on) not in other], [
        e for e in second if (e.key, e.on) not in one
    ]


def _side(effects: Sequence[Effect]) -> list[dict[str, str | None]]:
    each = (
        {'effect': e.name, 'joint': str(e.site) if e.site else None, 'at': e.at, 'on': e.on}
        for e in effects
    )
    return list({tuple(item.values()): item for item in each}.values())


def _named(effects: Sequence[Effect], others: Sequence[Effect]) -> str:
    return ' with '.join(dict.fromkeys(_name(effect, others) for effect in effects))


def _name(effect: Effect, others: Sequence[Effect]) -> str:
    if effect.traits.cause:
        return f'{effect.name} of {effect.site}' if effect.site else effect.name
    # A curve bends as any formula of the same kind does: what it stands for is the others.
    alike = any((other.at, other.on) == (effect.at, effect.on) for other in others)
    what = 'something else' if alike else 'something'
    if effect.on == 'constant':
        return f'{what} constant at {effect.at}'
    return f'{what} at {effect.at} that depends on {effect.on}'


def _entry(
    plan: Plan, reason: str, model: Model, between: list[list[dict[str, str | None]]] | None = None
) -> dict[str, Any]:
    option = plan.candidate
    joints = plan.motion()
    stations = len(joints.t) if joints.static else None
    return {
        'kind': option.kind,
        'sentence': f'{option.sentence.format(count=stations)} Check the motion for collisions first.',
        'reason': reason,
        'expected_separation_sigma': plan.after,
        'cost': round(plan.minutes, 2),
        'robot_minutes': round(plan.robot_minutes, 2),
        'stations': stations,
        'between': between,
        'changes': option.changed,
        'motion': motion_entry(joints, model.robot.joint_names),
    }


def motion_entry(joints: JointMotion, names: Sequence[str]) -> dict[str, Any]:
    t, q = joints.t, joints.q
    if not joints.static:
        t = np.linspace(0.0, t[-1], int(np.ceil(t[-1] / _PACE)) + 1)
        q = joints.at(t)[0]
    return {
        'static': joints.static,
        'joint_names': list(names),
        't': t.round(6).tolist(),
        'q': q.round(7).tolist(),
    }


def extended(effect: Effect, ends: dict[str, tuple[float, float]]) -> Effect:
    """Return a curve over an angle with knots as dense as they are over all that may be reached."""
    if not isinstance(effect, JointCurve) or effect.over != 'angle':
        return effect
    knots = np.asarray(effect.knots, dtype=float)
    low, high = ends[effect.joint]
    low, high = min(low, knots[0]), max(high, knots[-1])
    step = float(np.diff(knots).mean())
    count = min(int(np.ceil((high - low) / step)) + 1, _MOST_KNOTS)
    wide = np.linspace(low, high, count)
    values = np.asarray(effect.values, dtype=float) @ basis(effect.knots, wide)
    return replace(effect, values=tuple(values.tolist()), knots=tuple(wide.tolist()))
