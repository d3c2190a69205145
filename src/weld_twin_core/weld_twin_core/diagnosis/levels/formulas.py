# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Do the formulas of the names hold? Free forms at their own places, and noise from a joint."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..beliefs import Beliefs
from ..hypotheses.search import Search
from ..unseen.unseen_stretches import Unseen
from ..verdict.decision import Verdict
from .curved import Curved
from .own_place import Beside, beside_names
from .scatter import Scatter, scatter

FIELD = 'instrument'
"""A free field over the workspace speaks against every formula: it is what each of them bends to."""


class Missed(NamedTuple):
    """
    What the formulas of the names miss.

    Attributes
    ----------
    scattered : tuple of Scatter
        Joints that noise comes from beyond doubt, largest first.
    forms : tuple of Beside
        Free forms that predict beyond doubt what a name should.
    sizes : mapping from str to float
        The largest effect at every place, RMS in units of noise.

    """

    scattered: tuple[Scatter, ...] = ()
    forms: tuple[Beside, ...] = ()
    sizes: dict[str, float] = {}

    def by_forms(self, at: str) -> float:
        """Return the RMS that free forms take off at a place, as a share of the largest effect."""
        return max((one.share for one in self.forms if one.at in (at, FIELD)), default=0.0)

    def by_noise(self, at: str) -> float:
        """Return the RMS of the noise that comes from a place, as a share of the largest effect."""
        own = [one.size for one in self.scattered if one.joint == at]
        return max(own, default=0.0) / max(self.sizes.get(at, 0.0), 1e-12)


def missed(found: Search, unseen: Unseen, beliefs: Beliefs) -> Missed:
    """
    Return what the formulas of the effects found miss, as far as it is beyond doubt.

    Parameters
    ----------
    found : Search
    unseen : Unseen
        Of its final model.
    beliefs : Beliefs

    """
    if found.dense:
        return Missed()
    loose = [
        one
        for one in sorted(scatter(found, unseen), key=lambda one: -one.share)
        if one.share >= beliefs.beaten_share and one.steady >= beliefs.scatter_sure
    ]
    forms = tuple(one for one in beside_names(found, unseen) if _clear(one, beliefs))
    return Missed(tuple(loose), forms, _sizes(found, unseen))


def no_noise(verdict: Verdict, rival: Curved | None, left: Missed, beliefs: Beliefs) -> Verdict:
    """
    Return 'unknown' in the place of 'none' where what looks like noise follows something.

    Parameters
    ----------
    verdict : Verdict
        Of any other status, nothing changes.
    rival : Curved or None
        The free-form explanation, whether or not it can be carried to another motion.
    left : Missed
    beliefs : Beliefs

    """
    if verdict.status != 'none':
        return verdict
    reasons = [
        f'what remains is no noise of the instrument: {100.0 * one.share:.0f} % of it lies along '
        f'the motion of {one.joint}'
        for one in left.scattered
    ]
    form = None if rival is None else rival.form
    if form and form.gain >= beliefs.beaten_share and form.steady >= beliefs.beaten_steady:
        places = ' and '.join(str(part.group) for part in form.parts)
        reasons.append(
            f'no effect in the library explains the gap, but it is no noise: {places} predicts '
            f'{100.0 * form.gain:.0f} % of it on unseen stretches'
        )
    return replace(verdict, status='unknown', reasons=tuple(reasons)) if reasons else verdict


def _sizes(found: Search, unseen: Unseen) -> dict[str, float]:
    """Return the largest effect at every place, RMS in units of noise."""
    out: dict[str, float] = {}
    for effect, part in zip(found.final.model.found, unseen.targets[1:], strict=True):
        out[effect.at] = max(out.get(effect.at, 0.0), float(np.sqrt((part**2).mean())))
    return out


def _clear(one: Beside, beliefs: Beliefs) -> bool:
    """Return whether a free form takes off more than chance would."""
    if one.on == 'place':
        return one.gain >= beliefs.dependence_gain and one.steady >= beliefs.dependence_sure
    return one.gain >= beliefs.group_share and one.steady >= beliefs.structure_sure
