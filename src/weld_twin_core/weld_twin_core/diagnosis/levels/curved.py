# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Curves for what has no name: chosen, fitted, judged as any model is, and kept or not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...effects.effect import Effect
from ...recording import Recording
from ..algebra.fit import fit, robust_fit
from ..algebra.problem import ROWS
from ..beliefs import Beliefs
from ..evidence import Evidence, Scatter, Search, Verdict
from ..result import NAMING, Shrink, Site
from ..unseen.folds import gain
from ..unseen.groups import Group
from ..unseen.held_out_shrink import held_out_shrink
from ..unseen.unseen_stretches import Unseen
from .free_form import FreeForm, Part, free_form


@dataclass(frozen=True, eq=False)
class Curved:
    """A free-form explanation, and the model with its curves."""

    form: FreeForm
    kept: tuple[Effect, ...]
    """Effects that stayed beside it: those named beyond doubt, and the set-up's own motion."""
    found: Search  # with the curves in its final fit
    unseen: Unseen  # of that fit


def curved(result: Search, verdict: Verdict, beliefs: Beliefs) -> Curved | None:
    """
    Return curves for what a verdict leaves beside its names; None where there are none.

    What holds in no other posture may still be predicted from neighbours in time. The set-up's own
    motion stays beside the curves; beside a verdict that names something nothing is left.
    """
    if verdict.status in NAMING or (result.dense and verdict.sets):
        return None
    reported = {site for group in verdict.sets for site in group}
    found = result.final.model.found
    pairs = zip(found, result.candidate_sets, strict=False)
    named = [effect for effect, own in pairs if {Site.of(effect), own[0].site} & reported]
    kept = [*(e for e in found if not (e.traits.cause or e.traits.bends)), *named]
    out = _beside(result, kept, beliefs)
    if out is None and verdict.status == 'unknown':
        out = _beside(result, kept, beliefs, wandering=True)
    return out


def _beside(
    result: Search, kept: Sequence[Effect], beliefs: Beliefs, *, wandering: bool = False
) -> Curved | None:
    small = result.problem.thinned(ROWS)
    start = result.baseline.model.with_found(tuple(kept))
    bare, scale = robust_fit(small, start, rounds=1)
    form = free_form(small, scale, bare, beliefs, wandering=wandering)
    if not form.parts:
        return None
    model = bare.model.with_found((*bare.model.found, *form.curves))
    own = bare.coordinates.size
    precision = np.concatenate([np.zeros(own), form.precision])
    full = result.problem
    nearly = fit(small, model, scale, precision).model
    final, scale = robust_fit(full, nearly, precision, rounds=1)
    changed = replace(result, final=final, scale=scale, precision=precision, dense=False)
    if any(part.any() for part in result.scale.left_out):
        changed = changed.apart_from_strays()
    unseen = Unseen.of(full, changed.scale, changed.final, precision)
    return Curved(form, bare.model.found, changed, unseen)


def choose_model(
    result: Search,
    unseen: Unseen,
    shrink: Shrink,
    verdict: Verdict,
    alternative: Curved | None,
    holdout: Sequence[Recording],
    beliefs: Beliefs,
) -> tuple[Search, Unseen, Shrink, Verdict]:
    """
    Return the model to go on with, its predictions in unseen folds, its shrink, the verdict.

    alternative: the free-form explanation; carried where the verdict is 'unknown' and it predicts
    as well. What makes unseen data worse than the nominal robot does is not carried at all, nor
    told; nor is what has no name and makes them hardly better, which would move points for nothing.
    """
    nothing = result.dense and verdict.status == 'none'
    if verdict.status != 'unknown' and not nothing:
        return result, unseen, shrink, verdict
    if alternative is not None and _worth(unseen, alternative, verdict, beliefs):
        result, unseen = alternative.found, alternative.unseen
        shrink = held_out_shrink(result, unseen, holdout, beliefs)
    least = 1.0 if verdict.sets else beliefs.better
    if shrink.rms_after_m <= least * shrink.rms_before_m and not nothing:
        return result, unseen, shrink, verdict
    # Without a name there is no reason to keep what makes unseen data worse.
    # The frames alone were fitted when the noise was not known yet.
    bare = result.problem.whitened(result.problem.residuals(result.baseline.model), result.scale)
    final = replace(result.baseline, residual=bare)
    result = replace(result, final=final, precision=np.zeros(0), candidate_sets=(), dense=False)
    unseen = Unseen.of(result.problem, result.scale, result.final, result.precision)
    shrink = held_out_shrink(result, unseen, holdout, beliefs)
    return result, unseen, shrink, replace(verdict, sets=())


def _worth(named: Unseen, alternative: Curved, verdict: Verdict, beliefs: Beliefs) -> bool:
    """Return whether the model has curves: for names that do not stand, or clearly beside."""
    there = alternative.unseen
    before, after = named.squares(named.whole), there.squares(there.whole)
    if not verdict.sets:
        return float(after.mean()) <= beliefs.curve_room**2 * float(before.mean())
    taken = gain(before, after, named.trusted_labels(), there.trusted_labels())
    return taken.share >= beliefs.beaten_share and taken.steady >= beliefs.steady


def no_noise(verdict: Verdict, alternative: Curved | None, beliefs: Beliefs) -> Verdict:
    """Return 'unknown' in the place of 'none' where free curves predict what looks like noise."""
    if verdict.status != 'none' or alternative is None:
        return verdict
    form = alternative.form
    if form.gain < beliefs.beaten_share or form.steady < beliefs.steady:
        return verdict
    places = ' and '.join(str(part.group) for part in form.parts)
    reason = (
        f'no effect in the library explains the gap, but it is no noise: {places} predicts '
        f'{100.0 * form.gain:.0f} % of it on unseen stretches'
    )
    return replace(verdict, status='unknown', reasons=(reason,))


def locate_gap(
    result: Search,
    verdict: Verdict,
    alternative: Curved | None,
    evidence: Evidence,
    beliefs: Beliefs,
) -> FreeForm:
    """
    Return the groups that tell place and dependence of an unknown gap; of any other nothing.

    They explain what is left beside all that is reported, and joints that noise comes from.
    """
    if verdict.status != 'unknown':
        return FreeForm(())
    if result.dense and verdict.sets:
        # Beside many small errors it is what they leave that has no place yet.
        bare = replace(result.final, model=result.final.model.with_found(()))
        form = free_form(result.problem, result.scale, bare, beliefs)
    else:
        form = FreeForm(()) if alternative is None else alternative.form
    return _with_scatter(form, evidence.scattered)


def _bare(at: str, on: str) -> Group:
    """Return a place and a dependence that no columns are needed of."""
    return Group(at, on, (), np.zeros((0, 0)), np.zeros(0))


def _with_scatter(form: FreeForm, scattered: Sequence[Scatter]) -> FreeForm:
    """Return a form with a part for every joint that noise comes from and that has none yet."""
    seen = {part.group.at for part in form.parts}
    more = []
    for one in scattered:
        if one.joint not in seen:
            # An encoder that rounds its angle, or a link that jumps as its direction has it.
            rounded, jumping = (_bare(one.joint, on) for on in ('angle', 'direction'))
            weights = (rounded, 1.0 / 2.0), (jumping, 1.0 / 2.0)
            more.append(Part(rounded, 1.0, weights, one.share))
    if not more:
        return form
    gain = form.gain + (1.0 - form.gain) * sum(part.share for part in more)
    steady = form.steady or min(one.steady for one in scattered)
    return replace(form, parts=(*form.parts, *more), gain=gain, steady=steady)
