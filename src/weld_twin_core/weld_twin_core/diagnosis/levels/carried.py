# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which model goes on: that of the names, or the curves where no name holds."""

from __future__ import annotations

from collections.abc import Sequence

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
    holdout : sequence of Recording
    beliefs : Beliefs

    """
    if rival is None or verdict.status != 'unknown':
        return found, unseen, shrink
    named = unseen.rms(unseen.predict(range(len(unseen.parts))))
    if rival.rms_m > beliefs.curve_room * named:
        return found, unseen, shrink
    return rival.found, rival.unseen, held_out_shrink(rival.found, rival.unseen, holdout, beliefs)
