# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every named explanation held against the free-form one: does the formula hold, and the place?"""

from __future__ import annotations

from ..beliefs import Beliefs
from ..unseen.unseen_stretches import Unseen
from ..verdict.decision import Verdict
from .curved import Curved, gain_of


def held_against(
    verdict: Verdict, named: Unseen, rival: Curved | None, beliefs: Beliefs
) -> Verdict:
    """
    Return the verdict, or 'unknown' where a free form predicts clearly better than the names.

    There is no 'none' where a free form predicts what looks like noise, whether or not a curve can
    carry it to another motion. What is named stays told; `standing` says whether it holds beside
    what is left.

    Parameters
    ----------
    verdict : Verdict
    named : Unseen
        Of the model with the effects named.
    rival : Curved or None
    beliefs : Beliefs

    """
    if rival is None:
        return verdict
    if verdict.status == 'none':
        return _something(verdict, rival, beliefs)
    if verdict.status == 'unknown':
        return verdict
    gain, steady = gain_of(named, rival.unseen)
    if gain < beliefs.beaten_share or steady < beliefs.beaten_steady:
        return verdict
    reason = (
        f'a curve at {_places(rival)} predicts unseen stretches better than any effect in the library '
        f'({100.0 * gain:.0f} % less squared error)'
    )
    return Verdict('unknown', beliefs.beaten_belief, verdict.sets, (reason,))


def _something(verdict: Verdict, rival: Curved, beliefs: Beliefs) -> Verdict:
    """Return 'unknown' where what looks like noise follows something on unseen stretches."""
    form = rival.form
    if form.gain < beliefs.beaten_share or form.steady < beliefs.beaten_steady:
        return verdict
    reason = (
        f'no effect in the library explains the gap, but it is no noise: {_places(rival)} predicts '
        f'{100.0 * form.gain:.0f} % of it on unseen stretches'
    )
    return Verdict('unknown', beliefs.beaten_belief, (), (reason,))


def _places(rival: Curved) -> str:
    return ' and '.join(str(part.group) for part in rival.form.parts)
