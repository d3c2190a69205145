# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every named explanation held against the free-form one: does the formula hold, and the place?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..beliefs import Beliefs
from ..result import Site
from ..unseen.unseen_stretches import Unseen
from ..verdict.decision import Verdict
from .curved import Curved
from .sparse_groups import steadiness


def held_against(
    verdict: Verdict, named: Unseen, rival: Curved | None, beliefs: Beliefs
) -> Verdict:
    """
    Return the verdict, or 'unknown' where a free form predicts clearly better than the names.

    What an 'unknown' names beside is withdrawn where curves alone predict better. There is no
    'none' where a free form predicts what looks like noise, whether or not a curve can carry it to
    another motion.

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
        kept = {Site(effect.name, effect.site) for effect in rival.kept}
        stays = all(group[0] in kept for group in verdict.sets)
        return verdict if stays else replace(verdict, sets=())
    gain, steady = gain_of(named, rival.unseen)
    if gain < beliefs.beaten_share or steady < beliefs.beaten_steady:
        return verdict
    reason = (
        f'a curve at {_places(rival)} predicts unseen stretches better than any effect in the library '
        f'({100.0 * gain:.0f} % less squared error)'
    )
    return Verdict('unknown', beliefs.beaten_belief, (), (reason,))


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


def gain_of(named: Unseen, rival: Unseen) -> tuple[float, float]:
    """
    Return what a rival takes off the squared unseen error, as a share and in standard errors.

    Parameters
    ----------
    named, rival : Unseen
        The model held against the rival, and the rival, both whole.

    """
    before = named.squares(named.predict(range(len(named.parts))))
    after = rival.squares(rival.predict(range(len(rival.parts))))
    gain = 1.0 - float(after.mean() / max(float(before.mean()), 1e-300))
    labels, others = named.trusted_labels(), rival.trusted_labels()
    names = np.intersect1d(labels, others)
    one = np.array([before[labels == n].mean() for n in names])
    two = np.array([after[others == n].mean() for n in names])
    return gain, steadiness(one, two)
