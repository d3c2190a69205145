# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where an unknown gap sits and what it depends on, curves or none that could carry it."""

from __future__ import annotations

import numpy as np

from ..algebra.fit import robust_fit, robust_scale
from ..beliefs import Beliefs
from ..hypotheses.search import Search
from ..verdict.decision import Verdict
from .curved import ROWS, Curved
from .free_form import FreeForm, free_form


def placed(
    found: Search, verdict: Verdict, rival: Curved | None, beliefs: Beliefs
) -> FreeForm | None:
    """
    Return the groups that tell place and dependence of an unknown gap; None of any other.

    Beside what curves can carry to another motion, causes are tried that act on the whole arm at
    once.

    Parameters
    ----------
    found : Search
        The effects found, before curves take their place.
    verdict : Verdict
    rival : Curved or None
        The free-form explanation that can be carried; what stays beside it stays here too.
    beliefs : Beliefs

    """
    if verdict.status != 'unknown':
        return None
    # Curves fitted along with many small errors are what is to be placed, not what stays beside.
    setup = [e for e in found.final.model.found if not (e.cause or e.bends)]
    kept = setup if rival is None else rival.kept
    small = found.problem.thinned(ROWS)
    start = found.baseline.model.with_found(tuple(kept))
    bare, scale = robust_fit(small, start, robust_scale(small, small.residuals(start)), rounds=1)
    none = np.zeros(0)
    form = free_form(small, scale, bare, none, beliefs, whole_arm=True)
    if form.parts:
        return form
    if rival is not None:
        return rival.form
    # What carries to no other posture may still be told from neighbours in time.
    return free_form(small, scale, bare, none, beliefs, whole_arm=True, wandering=True)
