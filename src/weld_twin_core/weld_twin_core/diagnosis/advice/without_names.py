# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Explanations without a formula, for an experiment to part: which place, depending on what.

Where no effect of the library explains the gap, what can still be learned is where it sits and what it
depends on. The free form of a diagnosis tells which places and dependences fit alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...effects.curve import basis
from ...effects.effect import Effect
from ...effects.joint_curve import JointCurve
from ..algebra.fit import fit
from ..hypotheses.search import Search
from ..levels.curved import Curved
from ..levels.free_form import Part
from ..levels.groups import Group

RIVALS = 2
"""Other places or dependences that are compared with the one that fits best."""
ROWS = 2000
"""Rows that a rival's curves are fitted on: only its shape counts."""
MOST_KNOTS = 40
"""Knots of a curve that is carried on over the whole range of an experiment."""

Explanation = tuple[Effect, ...]


def without_names(
    found: Search, rival: Curved | None, low: Array, high: Array
) -> list[Explanation]:
    """
    Return the free-form explanation and the nearest other ones, likeliest first.

    Parameters
    ----------
    found : Search
    rival : Curved or None
        What explains the gap without a formula; None where nothing does.
    low, high : array, shape (n,) [rad, m]
        What joints may reach in an experiment: curves over an angle go on there, free to bend.

    """
    if rival is None:
        return []
    fitted = rival.found.final.model.found
    parts = [part for part in rival.form.parts if part.group.carried]
    if not parts:
        return []
    robot = rival.found.final.model.robot
    ends = {name: (low[i], high[i]) for i, name in enumerate(robot.joint_names)}
    out = [fitted]
    kept = fitted[: len(rival.kept)]
    for group in _others(rival.form.parts):
        curves = [
            c for p in rival.form.parts for c in (group if p is parts[0] else p.group).carried
        ]
        out.append(_fitted(rival.found, (*kept, *curves)))
    return [tuple(_wide(effect, ends) for effect in effects) for effects in out]


def _others(parts: Sequence[Part]) -> list[Group]:
    """Return the likeliest rivals of the first group that curves stand for, at other sites."""
    part = next(part for part in parts if part.group.carried)
    taken = {(p.group.at, p.group.on) for p in parts}
    out: list[Group] = []
    for group, _ in sorted(part.rivals, key=lambda item: -item[1]):
        if (group.at, group.on) not in taken and group.carried:
            taken.add((group.at, group.on))
            out.append(group)
    return out[:RIVALS]


def _fitted(found: Search, effects: Explanation) -> Explanation:
    few = found.problem.thinned(ROWS)
    scale = replace(found.scale, weights=tuple(np.ones(m) for m in few.samples))
    return fit(few, found.final.model.with_found(effects), scale, None, 3).model.found


def _wide(effect: Effect, ends: dict[str, tuple[float, float]]) -> Effect:
    """Return a curve over an angle with knots as dense as they are over all that may be reached."""
    if not isinstance(effect, JointCurve) or effect.over != 'angle':
        return effect
    knots = np.asarray(effect.knots, dtype=float)
    low, high = ends[effect.joint]
    low, high = min(low, knots[0]), max(high, knots[-1])
    step = float(np.diff(knots).mean())
    count = min(int(np.ceil((high - low) / step)) + 1, MOST_KNOTS)
    wide = np.linspace(low, high, count)
    values = np.asarray(effect.values, dtype=float) @ basis(effect.knots, wide)
    return replace(effect, values=tuple(values.tolist()), knots=tuple(wide.tolist()))
