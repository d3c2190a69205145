# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Where an unknown gap sits and what it depends on, curves or none that could carry it.

Where the tool keeps one direction, the joints are a function of the place, and errors of the arm
and a field over the workspace are one and the same. An arm is off by tenths of a millimetre as it
is delivered, an instrument is not: the arm is to be looked at first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from ..algebra.problem import Model, Problem
from ..beliefs import Beliefs
from ..hypotheses.search import Search
from ..unseen.folds import least_gain
from ..unseen.groups import Group, all_groups
from ..unseen.unseen_stretches import Base, Unseen
from ..verdict.decision import Verdict
from .curved import Curved, bare_fit
from .formulas import Missed
from .free_form import FreeForm, Part, free_form
from .scatter import Scatter

ROUNDED, JUMPING = 0.6, 0.4
"""Belief that noise from a joint is an encoder that rounds its angle, or a link that jumps as its
direction has it, where nothing else is found there. A judgement."""
AS_GOOD = 0.9
"""Share of what a field takes off unseen data that an arm must take off to be one with it. Of two
that are one they take the same to a few hundredths."""
TILT = 0.2
"""Tilt of the tool [rad], RMS about its mean, up to which it keeps one direction: a hand that is held
level by eye, or a torch that follows a seam's slope."""
FIELD = 0.2
"""Belief left for the instrument then: trackers and cameras are checked, and arms are not."""
STATIC = ('constant', 'load')
"""What an arm is off by at rest, whatever it did before."""


def placed(
    result: Search,
    verdict: Verdict,
    alternative: Curved | None,
    missed: Missed,
    beliefs: Beliefs,
) -> FreeForm | None:
    """
    Return the groups that tell place and dependence of an unknown gap; None of any other.

    They explain what is left beside everything that is told.

    result: the effects found, before curves take their place.
    alternative: the free-form explanation beside what is told.
    missed: what the formulas miss. Joints that noise comes from are places, too, where no group
    finds any.
    """
    if verdict.status != 'unknown':
        return None
    if result.dense:
        # Beside many small errors it is what they leave that has no place yet.
        bare = replace(result.final, model=result.final.model.with_found(()))
        form = free_form(result.problem, result.scale, bare, beliefs)
    else:
        form = FreeForm(()) if alternative is None else alternative.form
    return _with_scatter(arm_first(result, form), missed.scattered)


def _with_scatter(form: FreeForm, scattered: Sequence[Scatter]) -> FreeForm:
    """Return a form with a part for every joint that noise comes from and that has none yet."""
    seen = {part.group.at for part in form.parts}
    more = []
    for one in scattered:
        if one.joint not in seen:
            rounded, jumping = (
                Group(one.joint, on, (), np.zeros((0, 0)), np.zeros(0))
                for on in ('angle', 'direction')
            )
            weights = (rounded, ROUNDED), (jumping, JUMPING)
            more.append(Part(rounded, 1.0, weights, one.share))
    if not more:
        return form
    gain = form.gain + (1.0 - form.gain) * sum(part.share for part in more)
    steady = form.steady or min(one.steady for one in scattered)
    return replace(form, parts=(*form.parts, *more), gain=gain, steady=steady)


def arm_first(result: Search, form: FreeForm) -> FreeForm:
    """Return a form whose field of the instrument is a set with the joints, where they are one."""
    fields = [part for part in form.parts if part.group.at == 'instrument']
    if not fields or _tilt(result.problem, result.baseline.model) > TILT:
        return form
    small, bare, scale = bare_fit(result)
    bases = Unseen.of(small, scale, bare, np.zeros(bare.coordinates.size)).bases()
    names = bare.model.robot.joint_names
    joints: dict[str, list[Group]] = {}
    field = 0.0
    for group in all_groups(small, bare.model, scale):
        if group.at in names and group.on in STATIC:
            joints.setdefault(group.at, []).append(group)
        elif group.at == 'instrument':
            field = max(field, _gain(bases, [group]))
    every = [group for each in joints.values() for group in each]
    arm = _gain(bases, every) if every else 0.0
    gains = {name: max(_gain(bases, groups), 0.0) for name, groups in joints.items()}
    whole = sum(gains.values())
    if min(arm, whole) <= 0.0 or arm < AS_GOOD * field:
        return form
    rest = tuple(part for part in form.parts if part not in fields)
    sizes = {name: (1.0 - FIELD) * gain / whole for name, gain in gains.items()}
    # One part of all the joints and, last, the instrument.
    ordered = sorted(sizes, key=lambda name: -sizes[name])
    every_one = (*((joints[name][0], sizes[name]) for name in ordered), (fields[0].group, FIELD))
    share = sum(part.share for part in fields)
    part = Part(joints[ordered[0]][0], fields[0].ridge, every_one, share)
    return replace(form, parts=tuple(sorted((part, *rest), key=lambda each: -each.share)))


def _tilt(problem: Problem, model: Model) -> float:
    """Return how far the tool turns about more than one axis of the world, RMS [rad]."""
    features = problem.features(model)
    turns = Rotation.concatenate([Rotation.from_matrix(f.run.poses.rotation) for f in features])
    vectors = (turns * turns.mean().inv()).as_rotvec()
    about = np.linalg.svd(vectors, compute_uv=False)
    return float(np.linalg.norm(about[1:]) / np.sqrt(len(vectors)))


def _gain(bases: Sequence[Base], groups: Sequence[Group]) -> float:
    """Return the share of the squared unseen error that groups take off together."""
    columns = np.concatenate([group.columns for group in groups])
    return least_gain([base.gain(columns) for base in bases]).share
