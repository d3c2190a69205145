# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every named explanation held against the free-form one: does the formula hold, and the place?"""

from __future__ import annotations

import numpy as np

from ..unseen.unseen_stretches import Unseen
from ..verdict.decision import Verdict
from .curved import Curved
from .sparse_groups import steadiness

BEATEN = 0.15
"""Share of the squared error left by the effects named that a free form must take away for the
names to be doubted. A cause that is named rightly leaves noise, of which no curve predicts any on
unseen stretches; the share leaves room for what real gears and springs are beyond their formulas."""
STEADY = 2.0
"""The same in standard errors between stretches."""
BELIEF = 0.75
"""Belief in 'unknown' where a curve beats the names; a judgement."""


def held_against(verdict: Verdict, named: Unseen, rival: Curved | None) -> Verdict:
    """
    Return the verdict, or 'unknown' where a free form predicts clearly better than the names.

    Parameters
    ----------
    verdict : Verdict
    named : Unseen
        Of the model with the effects named.
    rival : Curved or None

    """
    if rival is None or verdict.status not in ('identified', 'ambiguous'):
        return verdict
    before = named.squares(named.predict(range(len(named.parts))))
    after = rival.unseen.squares(rival.unseen.predict(range(len(rival.unseen.parts))))
    gain = 1.0 - float(after.mean() / max(float(before.mean()), 1e-300))
    if gain < BEATEN or _steady(named, before, rival.unseen, after) < STEADY:
        return verdict
    places = ' and '.join(str(part.group) for part in rival.form.parts)
    reason = (
        f'a curve at {places} predicts unseen stretches better than any effect in the library '
        f'({100.0 * gain:.0f} % less squared error)'
    )
    return Verdict('unknown', BELIEF, (), (reason,))


def _steady(named: Unseen, before: np.ndarray, rival: Unseen, after: np.ndarray) -> float:
    labels, others = named.trusted_labels(), rival.trusted_labels()
    names = np.intersect1d(labels, others)
    one = np.array([before[labels == n].mean() for n in names])
    two = np.array([after[others == n].mean() for n in names])
    return steadiness(one, two)
