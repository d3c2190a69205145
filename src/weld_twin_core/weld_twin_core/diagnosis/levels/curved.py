# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The model with curves in place of names: fitted, and judged as any model is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...effects.effect import Effect
from ..algebra.fit import fit, robust_fit, robust_scale
from ..beliefs import Beliefs
from ..hypotheses.search import Search
from ..result import Site
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
    form : FreeForm
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
        return self.unseen.rms(self.unseen.predict(range(len(self.unseen.parts))))


def curved(found: Search, verdict: Verdict, beliefs: Beliefs) -> Curved | None:
    """
    Return the free-form explanation of the gap; None where there is none, or nothing to explain.

    Parameters
    ----------
    found : Search
    verdict : Verdict
        Effects that an 'unknown' names beyond doubt stay beside the curves, unless curves alone
        predict better; the set-up's own motion always stays.
    beliefs : Beliefs

    """
    if found.dense:
        return None
    setup = [e for e in found.final.model.found if not e.cause]
    alone = _beside(found, setup, beliefs)
    sure = {site for group in verdict.sets for site in group}
    named = [e for e in found.final.model.found if Site(e.name, e.site) in sure]
    if verdict.status != 'unknown':
        return alone
    beside = _beside(found, [*setup, *named], beliefs) if named else None
    tried = [way for way in (beside, alone) if way is not None]
    if not tried:
        return _beside(found, [*setup, *named], beliefs, wandering=True)
    return min(tried, key=lambda way: way.rms_m)


def _beside(
    found: Search, kept: Sequence[Effect], beliefs: Beliefs, *, wandering: bool = False
) -> Curved | None:
    small = found.problem.thinned(ROWS)
    start = found.baseline.model.with_found(tuple(kept))
    bare, scale = robust_fit(small, start, robust_scale(small, small.residuals(start)), rounds=1)
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
