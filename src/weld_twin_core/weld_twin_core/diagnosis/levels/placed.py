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

from ..algebra.fit import Fit
from ..algebra.problem import Model, Problem, Scale
from ..beliefs import Beliefs
from ..hypotheses.search import Search
from ..result import Site
from ..unseen.folds import least_gain
from ..unseen.unseen_stretches import Base, Unseen
from ..verdict.decision import Verdict
from .curved import Curved, bare_fit
from .formulas import Missed
from .free_form import FreeForm, Part, free_form
from .groups import Group, all_groups, smooth_field, spanned
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

    They explain what is left beside everything that is told. Beside what curves can carry to another
    motion, causes are tried that act on the whole arm at once.

    Parameters
    ----------
    result : Search
        The effects found, before curves take their place.
    alternative : Curved or None
        The free-form explanation that can be carried; what stays beside it stays here too.
    missed : Missed
        What the formulas miss. Joints that noise comes from are places, too, where no group finds
        any.

    """
    if verdict.status != 'unknown':
        return None
    form = _grouped(result, verdict, alternative, beliefs)
    if any(one.on == 'place' for one in missed.forms):
        form = _with_field(form, beliefs)
    form = arm_first(result, form)
    return _with_scatter(form, missed.scattered)


def _grouped(
    result: Search, verdict: Verdict, alternative: Curved | None, beliefs: Beliefs
) -> FreeForm:
    """Return the groups of columns that tell place and dependence of what no name stands for."""
    none = np.zeros(0)
    if result.dense:
        # Beside many small errors it is what they leave that has no place yet.
        bare = replace(result.final, model=result.final.model.with_found(()))
        return free_form(result.problem, result.scale, bare, none, beliefs, whole_arm=True)
    reported = {site for group in verdict.sets for site in group}
    own = [
        e
        for e in result.final.model.found
        if Site(e.name, e.site) in reported or not e.traits.cause
    ]
    kept = own if alternative is None else alternative.kept
    small, bare, scale = bare_fit(result, kept)
    form = free_form(small, scale, bare, none, beliefs, whole_arm=True)
    if form.parts:
        return form
    if alternative is not None:
        return alternative.form
    # What carries to no other posture may still be told from neighbours in time.
    return free_form(small, scale, bare, none, beliefs, whole_arm=True, wandering=True)


def _with_field(form: FreeForm, beliefs: Beliefs) -> FreeForm:
    """
    Return a form in which a moved base and a bent field are one cause of the instrument.

    To first order a field over the workspace moves and turns the base, and scales.
    """
    one = [part for part in form.parts if part.group.at in ('base', 'instrument')]
    rest = tuple(part for part in form.parts if part not in one)
    share = sum(part.share for part in one) or form.gain
    field, base = (
        Group(at, on, (), np.zeros((0, 0)), np.zeros(0))
        for at, on in (('instrument', 'place'), ('base', 'constant'))
    )
    belief = beliefs.level_shared
    part = Part(field, 1.0, ((field, belief), (base, 1.0 - belief)), share)
    return replace(form, parts=tuple(sorted((part, *rest), key=lambda each: -each.share)))


def _with_scatter(form: FreeForm, scattered: Sequence[Scatter]) -> FreeForm:
    """Return a form with a part for every joint that noise comes from and that has none yet."""
    seen = {part.group.at for part in form.parts}
    more = [_scattering(one) for one in scattered if one.joint not in seen]
    if not more:
        return form
    gain = form.gain + (1.0 - form.gain) * sum(part.share for part in more)
    steady = form.steady or min(one.steady for one in scattered)
    return replace(form, parts=(*form.parts, *more), gain=gain, steady=steady)


def _scattering(one: Scatter) -> Part:
    rounded, jumping = (
        Group(one.joint, on, (), np.zeros((0, 0)), np.zeros(0)) for on in ('angle', 'direction')
    )
    return Part(rounded, 1.0, ((rounded, ROUNDED), (jumping, JUMPING)), one.share)


def arm_first(result: Search, form: FreeForm) -> FreeForm:
    """Return a form whose field of the instrument is a set with the joints, where they are one."""
    fields = [part for part in form.parts if part.group.at == 'instrument']
    if not fields or _tilt(result.problem, result.baseline.model) > TILT:
        return form
    small, bare, scale = bare_fit(result)
    joints, bases = _joints(small, bare, scale), _bases(small, bare, scale)
    every = [group for each in joints.values() for group in each]
    arm = _gain(bases, every) if every else 0.0
    if arm <= 0.0 or arm < AS_GOOD * _gain(bases, [_field(small, bare, scale)]):
        return form
    gains = {name: max(_gain(bases, groups), 0.0) for name, groups in joints.items()}
    rest = tuple(part for part in form.parts if part not in fields)
    whole = sum(gains.values())
    if whole <= 0.0:
        return form
    sizes = {name: (1.0 - FIELD) * gain / whole for name, gain in gains.items()}
    part = _shared(fields, joints, sizes)
    return replace(form, parts=tuple(sorted((part, *rest), key=lambda each: -each.share)))


def _tilt(problem: Problem, model: Model) -> float:
    """Return how far the tool turns about more than one axis of the world, RMS [rad]."""
    features = problem.features(model)
    turns = Rotation.concatenate([Rotation.from_matrix(f.run.poses.rotation) for f in features])
    vectors = (turns * turns.mean().inv()).as_rotvec()
    about = np.linalg.svd(vectors, compute_uv=False)
    return float(np.linalg.norm(about[1:]) / np.sqrt(len(vectors)))


def _shared(
    fields: Sequence[Part], joints: dict[str, list[Group]], sizes: dict[str, float]
) -> Part:
    """Return one part of all the joints and, last, the instrument."""
    ordered = sorted(sizes, key=lambda name: -sizes[name])
    rivals = ((joints[name][0], sizes[name]) for name in ordered)
    share = sum(part.share for part in fields)
    every = (*rivals, (fields[0].group, FIELD))
    return Part(joints[ordered[0]][0], fields[0].ridge, every, share)


def _joints(problem: Problem, bare: Fit, scale: Scale) -> dict[str, list[Group]]:
    """Return what every joint and its link can be off by at rest."""
    names = bare.model.robot.joint_names
    out: dict[str, list[Group]] = {}
    for group in all_groups(problem, bare.model, scale):
        if group.at in names and group.on in STATIC:
            out.setdefault(group.at, []).append(group)
    return out


def _field(problem: Problem, bare: Fit, scale: Scale) -> Group:
    features = problem.features(bare.model)
    parts = [smooth_field(problem, k, maker) for k, maker in enumerate(features)]
    return spanned(problem, scale, 'instrument', 'place', (), parts)


def _bases(problem: Problem, bare: Fit, scale: Scale) -> list[Base]:
    return Unseen.of(problem, scale, bare, np.zeros(bare.coordinates.size)).bases()


def _gain(bases: Sequence[Base], groups: Sequence[Group]) -> float:
    """Return the share of the squared unseen error that groups take off together."""
    columns = np.concatenate([group.columns for group in groups])
    return least_gain([base.gain(columns) for base in bases]).share
