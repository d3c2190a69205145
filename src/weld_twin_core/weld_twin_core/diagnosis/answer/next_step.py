# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The measurement to make next where the verdict leaves a question open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain
from math import erfc, sqrt
from typing import Any

import numpy as np

from ...arrays import Array
from ...effects import REGISTRY
from ..advice.chosen_pieces import DECIDES
from ..advice.experiment import confirming, extended, next_experiment
from ..advice.next_touches import next_touches
from ..advice.postures import Limits, Room
from ..advice.separation import Explanation
from ..algebra.fit import fit
from ..algebra.motions import narrow
from ..algebra.problem import ROWS, Scale
from ..beliefs import CAUSES
from ..evidence import LIKELIER, NAMED, Search, Verdict
from ..levels.curved import Curved
from ..levels.free_form import Part
from ..negligible import FLAT
from ..unseen.groups import Group

_FORESEEN = 2.0
"""Factor within which what parts two explanations is foreseen, one standard deviation. A judgement; of
five experiments that were to part theirs by 6 to 16 standard deviations three did."""
_DECIDED = 0.6
"""Share of experiments that decide, asked for by answers that name something without confidence; with
full confidence all do. Of 21 in development cells 19 did; two, with 0.3 and 0.55, did not."""
_ALTERNATIVES = 2
"""Other places or dependences that are compared with the one that fits best."""


def next_step(
    result: Search, verdict: Verdict, limits: Limits, alternative: Curved | None
) -> dict[str, Any] | None:
    """Return the next experiment as `next_experiment` does, None when the question is closed."""
    if result.problem.untracked:
        return _touches(result, verdict)
    wanted = _parting(result, verdict, limits, alternative)
    if not limits.confirm or (wanted is not None and wanted['motion'] is not None):
        return wanted
    problem, model = result.work.problem, result.small.model
    joints = narrow(problem.recordings, model.robot)
    if not joints:
        return wanted
    return {**confirming(problem, model, joints, limits), 'promise': None}


def _touches(result: Search, verdict: Verdict) -> dict[str, Any] | None:
    """Return the contacts to make next: a motion in the air would show nothing."""
    if verdict.status in ('identified', 'none'):
        return None
    listed = [result.small.model.found, *_in_place(result, verdict, named=True)]
    return next_touches(result.problem, result.final.model, listed[:NAMED], result.scale)


def _parting(
    result: Search, verdict: Verdict, limits: Limits, alternative: Curved | None
) -> dict[str, Any] | None:
    """Return the experiment that parts what is believed from what else it could be."""
    if verdict.status in ('identified', 'none') and verdict.sure:
        return None
    listed = [result.small.model.found, *_in_place(result, verdict, named=True)]
    named = len(listed)
    closed = verdict.status == 'ambiguous' and verdict.sure and len(listed) > 1
    if not closed:
        room = Room(result.work.problem, result.small.model.robot, limits)
        shapes = _without_names(alternative, room.low, room.high)
        if verdict.status == 'unknown' and verdict.confidence >= LIKELIER:
            listed, named = [*shapes, *listed], 1
        else:
            listed += shapes[:1]
        listed += _in_place(result, verdict, named=False)
        listed += _beside(result)
    wanted = next_experiment(
        result.work.problem,
        result.small.model,
        listed[:CAUSES],
        _as_weighed(result),
        limits,
        closed=closed,
        named=min(named, CAUSES),
    )
    return None if wanted is None else {**wanted, 'promise': _promise(verdict, wanted)}


def _as_weighed(result: Search) -> Scale:
    """Return the noise, as much larger as rows count less beside large effects (`effective`)."""
    fit, problem, scale = result.small, result.work.problem, result.work.scale
    apart = problem.independent_share(fit.residual) * fit.residual.size
    wider = float(np.sqrt(max(apart / max(result.effective(fit), FLAT), 1.0)))
    return replace(scale, position=wider * scale.position, orientation=wider * scale.orientation)


def _promise(verdict: Verdict, wanted: Mapping[str, Any]) -> float | None:
    """Return how probable it is that an experiment decides; None if it asks nothing."""
    sigma = wanted['expected_separation_sigma']
    if wanted['between'] is None or wanted['motion'] is None or sigma is None:
        return None
    beyond = np.log(max(sigma, FLAT) / DECIDES) / np.log(_FORESEEN)
    parted = erfc(-beyond / sqrt(2.0)) / 2.0
    if verdict.status != 'unknown':
        return parted * (_DECIDED + (1.0 - _DECIDED) * verdict.confidence)
    between = chain.from_iterable(wanted['between'])
    named = all(REGISTRY[each['effect']].traits.cause for each in between)
    believed = verdict.confidence if verdict.sets else 1.0 - verdict.confidence
    # Of what has no name too few such experiments were seen to promise more than an even chance.
    return parted * max(believed, 0.0 if named else LIKELIER)


def _in_place(result: Search, verdict: Verdict, *, named: bool) -> list[Explanation]:
    """Return the explanations with an alternative in an effect's place: those named, or the others."""
    sites = {site for group in verdict.sets for site in group}
    own = result.small.model.found
    every = chain.from_iterable(result.candidate_sets)
    asked = [one for one in every if (one.site in sites) is named]
    fits = [one.fit.model.found for one in sorted(asked, key=lambda one: -one.probability)]
    return [effects for effects in fits if effects != own]


def _beside(result: Search) -> list[Explanation]:
    """Return the explanations with one effect more, those first that come nearest to be needed."""
    model = result.small.model
    ranked = result.work.ranked(result.small, result.effective(result.small))
    taken = {(effect.name, effect.site) for effect in model.found}
    more = [choice for choice in ranked if choice.unit.site not in taken]
    return [(*model.found, choice.effect()) for choice in more[: CAUSES - 1]]


def _without_names(alternative: Curved | None, low: Array, high: Array) -> list[Explanation]:
    """Return the free-form explanation and those nearest; curves go on from low to high."""
    if alternative is None:
        return []
    fitted = alternative.found.final.model.found
    parts = [part for part in alternative.form.parts if part.group.movable_curves]
    if not parts:
        return []
    robot = alternative.found.final.model.robot
    ends = {name: (low[i], high[i]) for i, name in enumerate(robot.joint_names)}
    out = [fitted]
    kept = fitted[: len(alternative.kept)]
    for group in _others(alternative.form.parts):
        groups = [group if p is parts[0] else p.group for p in alternative.form.parts]
        curves = [curve for own in groups for curve in own.movable_curves]
        out.append(_fitted(alternative.found, (*kept, *curves)))
    return [tuple(extended(effect, ends) for effect in effects) for effects in out]


def _others(parts: Sequence[Part]) -> list[Group]:
    """Return the likeliest alternatives of the first group that curves stand for, at other sites."""
    part = next(part for part in parts if part.group.movable_curves)
    taken = {(p.group.at, p.group.on) for p in parts}
    out: list[Group] = []
    for group, _ in sorted(part.alternatives, key=lambda item: -item[1]):
        if (group.at, group.on) not in taken and group.movable_curves:
            taken.add((group.at, group.on))
            out.append(group)
    return out[:_ALTERNATIVES]


def _fitted(result: Search, effects: Explanation) -> Explanation:
    few = result.problem.thinned(ROWS)
    scale = replace(result.scale, weights=tuple(np.ones(m) for m in few.samples))
    return fit(few, result.final.model.with_found(effects), scale).model.found
