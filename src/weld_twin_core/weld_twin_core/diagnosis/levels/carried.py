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
from .curved import Curved


def carried(
    found: Search,
    unseen: Unseen,
    shrink: Shrink,
    verdict: Verdict,
    rival: Curved | None,
    holdout: Sequence[Recording],
    beliefs: Beliefs,
) -> tuple[Search, Unseen, Shrink]:
    """
    Return the model to carry on with, its predictions on unseen stretches, and its shrink.

    Parameters
    ----------
    found, unseen, shrink
        Of the effects found.
    verdict : Verdict
    rival : Curved or None
        The free-form explanation; carried where the verdict is 'unknown' and it predicts as well.
        What makes unseen data worse than the nominal robot does is not carried at all.
    holdout : sequence of Recording
    beliefs : Beliefs

    """
    if verdict.status != 'unknown':
        return found, unseen, shrink
    if rival is not None:
        named = unseen.rms(unseen.predict(range(len(unseen.parts))))
        if rival.rms_m <= beliefs.curve_room * named:
            found, unseen = rival.found, rival.unseen
            shrink = held_out_shrink(found, unseen, holdout, beliefs)
    if shrink.rms_after_m <= shrink.rms_before_m:
        return found, unseen, shrink
    # Without a name there is no reason to carry what makes unseen data worse.
    found = replace(found, final=found.baseline, precision=np.zeros(0), slots=(), dense=False)
    unseen = Unseen.of(found.problem, found.scale, found.final, found.precision)
    return found, unseen, held_out_shrink(found, unseen, holdout, beliefs)
