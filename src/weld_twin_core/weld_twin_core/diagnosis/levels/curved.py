# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The model with curves in place of names: fitted, judged as any model is, and carried or not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...effects.effect import Effect
from ...recording import Recording
from ..algebra.fit import Fit, fit, robust_fit, robust_scale
from ..algebra.problem import Problem, Scale
from ..beliefs import Beliefs
from ..hypotheses.search import Search
from ..result import Shrink, Site
from ..unseen.folds import gain
from ..unseen.held_out_shrink import held_out_shrink
from ..unseen.unseen_stretches import Unseen
from ..verdict.decision import Verdict
from .free_form import FreeForm, free_form

ROWS = 6000
"""Rows that groups are chosen on; the curves are fitted on all."""


@dataclass(frozen=True, eq=False)
class Curved:
    """
    A free-form explanation, and the model that carries it.

    Attributes
    ----------
    kept : tuple of Effect
        Effects that stayed beside it: those named beyond doubt, and the set-up's own motion.
    found : Search
        With the curves in its final fit.
    unseen : Unseen
        Of that fit.

    """

    form: FreeForm
    kept: tuple[Effect, ...]
    found: Search
    unseen: Unseen

    @property
    def rms_m(self) -> float:
        """Return what it leaves on unseen stretches, RMS [m]."""
        return self.unseen.rms(self.unseen.whole)


def curved(found: Search, beliefs: Beliefs) -> Curved | None:
    """
    Return the free-form explanation of the whole gap, without any name; None where there is none.

    Parameters
    ----------
    found : Search
        The set-up's own motion that it holds stays beside the curves.

    """
    if found.dense:
        return None
    return _beside(found, _setup(found), beliefs)


def standing(
    found: Search, verdict: Verdict, alone: Curved | None, beliefs: Beliefs
) -> Curved | None:
    """
    Return curves for what an 'unknown' verdict leaves beside the names that it tells.

    Parameters
    ----------
    verdict : Verdict
        Of any other status, nothing changes.
    alone : Curved or None
        The free-form explanation without names.

    """
    if verdict.status != 'unknown' or found.dense:
        return alone
    told = {site for group in verdict.sets for site in group}
    named = [
        effect
        for effect, slot in zip(found.final.model.found, found.slots, strict=False)
        if {Site(effect.name, effect.site), slot[0].site} & told
    ]
    if not named:
        wandering = None if alone else _beside(found, _setup(found), beliefs, wandering=True)
        return alone or wandering
    kept = [*_setup(found), *named]
    beside = _beside(found, kept, beliefs)
    if beside is None and found.final.model.found != tuple(kept):
        beside = _beside(found, kept, beliefs, wandering=True)
    return beside


def _setup(found: Search) -> list[Effect]:
    return [effect for effect in found.final.model.found if not effect.traits.cause]


def bare_fit(found: Search, kept: Sequence[Effect] = ()) -> tuple[Problem, Fit, Scale]:
    """Return some of the measurements, the fit on them of frames and what stays, and its noise."""
    small = found.problem.thinned(ROWS)
    start = found.baseline.model.with_found(tuple(kept))
    noise = robust_scale(small, small.residuals(start))
    return small, *robust_fit(small, start, noise, rounds=1)


def _beside(
    found: Search, kept: Sequence[Effect], beliefs: Beliefs, *, wandering: bool = False
) -> Curved | None:
    small, bare, scale = bare_fit(found, kept)
    form = free_form(small, scale, bare, np.zeros(0), beliefs, wandering=wandering)
    if not form.parts:
        return None
    model = bare.model.with_found((*bare.model.found, *form.curves))
    own = bare.coordinates.size
    precision = np.concatenate([np.zeros(own), form.precision])
    full = found.problem
    scale = robust_scale(full, full.residuals(fit(small, model, scale, precision, 4).model))
    final, scale = robust_fit(full, model, scale, precision, rounds=1)
    changed = replace(found, final=final, scale=scale, precision=precision)
    unseen = Unseen.of(full, scale, final, precision)
    return Curved(form, bare.model.found, changed, unseen)


def gain_of(named: Unseen, rival: Unseen) -> tuple[float, float]:
    """
    Return what a rival takes off the squared unseen error, as a share and in standard errors.

    Parameters
    ----------
    named, rival : Unseen
        The model held against the rival, and the rival, both whole.

    """
    before, after = named.squares(named.whole), rival.squares(rival.whole)
    told = gain(before, after, named.trusted_labels(), rival.trusted_labels())
    return told.share, told.steady


def carried(
    found: Search,
    unseen: Unseen,
    shrink: Shrink,
    verdict: Verdict,
    rival: Curved | None,
    holdout: Sequence[Recording],
    beliefs: Beliefs,
) -> tuple[Search, Unseen, Shrink, Verdict]:
    """
    Return the model to carry on with, its predictions on unseen stretches, its shrink, the verdict.

    Parameters
    ----------
    found, unseen, shrink
        Of the effects found.
    rival : Curved or None
        The free-form explanation; carried where the verdict is 'unknown' and it predicts as well.
        What makes unseen data worse than the nominal robot does is not carried at all, nor told.

    """
    if verdict.status != 'unknown':
        return found, unseen, shrink, verdict
    if rival is not None and _worth(unseen, rival, verdict, beliefs):
        found, unseen = rival.found, rival.unseen
        shrink = held_out_shrink(found, unseen, holdout, beliefs)
    if shrink.rms_after_m <= shrink.rms_before_m:
        return found, unseen, shrink, verdict
    # Without a name there is no reason to carry what makes unseen data worse.
    found = replace(found, final=found.baseline, precision=np.zeros(0), slots=(), dense=False)
    unseen = Unseen.of(found.problem, found.scale, found.final, found.precision)
    shrink = held_out_shrink(found, unseen, holdout, beliefs)
    return found, unseen, shrink, replace(verdict, sets=())


def _worth(named: Unseen, rival: Curved, verdict: Verdict, beliefs: Beliefs) -> bool:
    """
    Return whether curves are carried: instead of names that do not stand, or clearly beside others.

    Curves that hardly help beside names would put places under suspicion for nothing.
    """
    if verdict.sets:
        share, steady = gain_of(named, rival.unseen)
        return share >= beliefs.beaten_share and steady >= beliefs.beaten_steady
    left = named.rms(named.whole)
    return rival.rms_m <= beliefs.curve_room * left
