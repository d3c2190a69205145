# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Is something left that no named effect explains, and what does the whole gap depend on?

Groups of columns without a formula are given to the bare model without effects, and a few of them, for
the best of many finds more in noise, to the model. If one predicts unseen stretches better beside the
model, the residual has structure, and the groups that bring it say what it depends on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..algebra.fit import Fit
from ..algebra.problem import Model
from ..beliefs import Beliefs
from .chance import Candidates, chance_gain, may_be_chance
from .folds import Gain
from .groups import FIELD, FINE, KNOTS, Group, all_groups
from .unseen_stretches import RIDGES, Unseen

TOLD = 3
"""Things that what remains depends on, told at the most; further ones are echoes of these."""


@dataclass(frozen=True, eq=False)
class Structure:
    """What groups of columns without a formula find."""

    rms_m: float
    """RMS error on unseen stretches with the best of them beside the model, [m]."""
    gain: float
    """Share of the squared error on unseen stretches that it takes away."""
    sure: float
    """The gain over its standard error between stretches."""
    depends_on: tuple[str, ...]
    chance: float = 0.0
    """Share that the best of them hardly ever takes off noise alone; 0 where rows are many."""
    of_gap: Mapping[tuple[str, str], float] = field(default_factory=dict)
    """By joint and dependence: share of the squared gap, no effect fitted, that one takes off."""


def structure(unseen: Unseen, model: Model, baseline: Fit, beliefs: Beliefs) -> Structure:
    """
    Return what groups without a formula add on stretches not used for fitting.

    unseen: of the model.
    baseline: of the model without any effect that was found.
    """
    problem = unseen.problem
    bare = Unseen.of(problem, unseen.scale, baseline, np.zeros(0))
    base, first = (each.base(range(len(each.parts))) for each in (unseen, bare))
    before = first.errors(first.residual).sum()
    found, of_gap = list[tuple[Gain, str]](), dict[tuple[str, str], float]()
    joints = model.robot.joint_names
    # Where no instrument measured, and nothing shows where the base stands, joints alone are told of.
    elsewhere = problem.placed or not problem.untracked
    for group in all_groups(problem, model, unseen.scale):
        if group.at in joints:
            after = first.errors(first.extended(group.columns, RIDGES[1:2])[0]).sum()
            # Waves of a gear stand by themselves.
            waves = group.on == 'angle' and len(group.columns) == FINE
            key = group.at, 'waves' if waves else group.on
            of_gap[key] = max(of_gap.get(key, 0.0), float(1.0 - after / max(before, 1e-300)))
        if _tells(group, at_joint=group.at in joints) and (elsewhere or group.at in joints):
            found.append((base.gain(group.columns), f'{group.on} at {group.at}'))
    if not found:
        return Structure(unseen.rms(unseen.whole), 0.0, 0.0, (), of_gap=of_gap)
    found.sort(key=lambda item: -item[0].share)
    best = found[0][0]
    least, certain = beliefs.dependence_gain, beliefs.dependence_sure
    names = [name for one, name in found if one.share > least and one.steady > certain]
    chance = 0.0
    counts = best.share > beliefs.structure_gain and best.steady > beliefs.blatant_sure
    if counts and may_be_chance(unseen.residual.size, best.share):
        every = all_groups(problem, model, unseen.scale)
        each = (g.columns for g in every if _tells(g, at_joint=g.at in joints))
        tried = Candidates(
            unseen.columns.written_out(), unseen.precision, each, RIDGES, [unseen.labels]
        )
        chance = chance_gain(tried, beliefs.blatant_sure)
    return Structure(best.rms_m, best.share, best.steady, tuple(names[:TOLD]), chance, of_gap)


def _tells(group: Group, *, at_joint: bool) -> bool:
    """Return whether a group is one of the few that show what is left: the widest of their kind."""
    if group.on == 'angle' and at_joint:
        return len(group.curves) == 1 and len(group.columns) == KNOTS['angle']
    if group.on == 'direction':
        return not group.curves
    return not at_joint and (
        group.on == 'time' or (group.on, len(group.columns)) == ('place', FIELD)
    )
