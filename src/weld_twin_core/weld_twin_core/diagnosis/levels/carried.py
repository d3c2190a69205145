# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which model goes on: that of the names, the curves where no name holds, or none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...recording import Recording
from ..beliefs import Beliefs
from ..hypotheses.search import Search
from ..result import Shrink
from ..unseen.held_out_shrink import held_out_shrink
from ..unseen.unseen_stretches import Unseen
from ..verdict.decision import Verdict
from .curved import Curved, gain_of


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
    verdict : Verdict
    rival : Curved or None
        The free-form explanation; carried where the verdict is 'unknown' and it predicts as well.
        What makes unseen data worse than the nominal robot does is not carried at all, nor told.
    holdout : sequence of Recording
    beliefs : Beliefs

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
        gain, steady = gain_of(named, rival.unseen)
        return gain >= beliefs.beaten_share and steady >= beliefs.beaten_steady
    left = named.rms(named.predict(range(len(named.parts))))
    return rival.rms_m <= beliefs.curve_room * left
