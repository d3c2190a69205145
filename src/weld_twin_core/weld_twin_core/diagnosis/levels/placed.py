# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where an unknown gap sits and what it depends on, curves or none that could carry it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..algebra.fit import robust_fit, robust_scale
from ..beliefs import Beliefs
from ..hypotheses.search import Search
from ..result import Site
from ..verdict.decision import Verdict
from .arm_or_field import arm_first
from .curved import ROWS, Curved
from .formulas import Missed
from .free_form import FreeForm, Part, free_form
from .groups import Group
from .scatter import Scatter

ROUNDED, JUMPING = 0.6, 0.4
"""Belief that noise from a joint is an encoder that rounds its angle, or a link that jumps as its
direction has it, where nothing else is found there. A judgement."""


def placed(
    found: Search,
    verdict: Verdict,
    rival: Curved | None,
    missed: Missed,
    beliefs: Beliefs,
) -> FreeForm | None:
    """
    Return the groups that tell place and dependence of an unknown gap; None of any other.

    They explain what is left beside everything that is told. Beside what curves can carry to another
    motion, causes are tried that act on the whole arm at once.

    Parameters
    ----------
    found : Search
        The effects found, before curves take their place.
    verdict : Verdict
    rival : Curved or None
        The free-form explanation that can be carried; what stays beside it stays here too.
    missed : Missed
        What the formulas miss. Joints that noise comes from are places, too, where no group finds
        any.
    beliefs : Beliefs

    """
    if verdict.status != 'unknown':
        return None
    form = _grouped(found, verdict, rival, beliefs)
    if any(one.on == 'place' and one.share >= beliefs.field_misses for one in missed.forms):
        form = _with_field(form, beliefs)
    form = arm_first(found, form, ROWS, beliefs)
    return _with_scatter(form, missed.scattered)


def _grouped(found: Search, verdict: Verdict, rival: Curved | None, beliefs: Beliefs) -> FreeForm:
    """Return the groups of columns that tell place and dependence of what no name stands for."""
    none = np.zeros(0)
    if found.dense:
        # Beside many small errors it is what they leave that has no place yet.
        bare = replace(found.final, model=found.final.model.with_found(()))
        return free_form(found.problem, found.scale, bare, none, beliefs, whole_arm=True)
    told = {site for group in verdict.sets for site in group}
    own = [e for e in found.final.model.found if Site(e.name, e.site) in told or not e.cause]
    kept = own if rival is None else rival.kept
    small = found.problem.thinned(ROWS)
    start = found.baseline.model.with_found(tuple(kept))
    bare, scale = robust_fit(small, start, robust_scale(small, small.residuals(start)), rounds=1)
    form = free_form(small, scale, bare, none, beliefs, whole_arm=True)
    if form.parts:
        return form
    if rival is not None:
        return rival.form
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
