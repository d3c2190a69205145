# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Do the formulas of the names hold? Free forms at their places, and noise.

At their places lost motion of a joint is free in the gaps it trails in, and in angle, speed and
load by the way it goes; what the instrument and the frames do is a free smooth field over the
workspace. They are added to everything that is named, so that they need to find no more than what
the name misses.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..beliefs import Beliefs
from ..hypotheses.search import Search
from ..hypotheses.usual_errors import UsualErrors
from ..unseen.folds import least_gain
from ..unseen.groups import plain_groups
from ..unseen.unseen_stretches import Unseen
from ..verdict.decision import Verdict
from .curved import Curved
from .scatter import Scatter, scatter

FIELD = 'instrument'
"""A free field over the workspace speaks against every formula: it is what each of them bends to."""


class Beside(NamedTuple):
    """What a free form predicts that the names do not."""

    at: str
    on: str
    """Place and dependence of the free form."""
    gain: float
    """Share of the squared error that it takes off on unseen data, by the way of leaving out,
    stretches of time or regions of posture, that shows less."""
    steady: float
    """The same in standard errors between the parts left out."""
    share: float
    """RMS of what it takes off over that of the largest effect named at this place."""


class Missed(NamedTuple):
    """What the formulas of the names miss."""

    scattered: tuple[Scatter, ...] = ()
    """Joints that noise comes from beyond doubt, largest first."""
    forms: tuple[Beside, ...] = ()
    """Free forms that predict beyond doubt what a name should."""

    @property
    def in_words(self) -> tuple[tuple[str, str], ...]:
        """Return the places where formulas do not hold, each with the free form that predicts most."""
        best: dict[str, Beside] = {}
        for one in self.forms:
            if one.at not in best or one.gain > best[one.at].gain:
                best[one.at] = one
        return tuple(
            (
                at,
                f'a free curve at {at}, depending on {one.on}, still predicts {100.0 * one.gain:.0f} % '
                'of what is left on unseen stretches: the formula of what was found does not hold',
            )
            for at, one in best.items()
        )


def missed(result: Search, unseen: Unseen, beliefs: Beliefs) -> Missed:
    """Return what the formulas of the effects found miss, as far as it is beyond doubt."""
    if result.dense:
        return Missed()
    loose = [
        one
        for one in sorted(scatter(result, unseen), key=lambda one: -one.share)
        if one.share >= beliefs.beaten_share and one.steady >= beliefs.scatter_sure
    ]
    forms = [one for one in beside_names(result, unseen) if _fails(one, beliefs)]
    if forms:
        # A field is what small errors everywhere do as well: names fail by what is beyond those.
        own = result.problem, result.scale, result.final
        small = UsualErrors.beside(*own, lambda fit: float(fit.residual.size))
        at = {(one.at, one.on) for one in forms}
        beyond = beside_names(result, unseen.along(small.columns))
        forms = [one for one in beyond if (one.at, one.on) in at and _fails(one, beliefs)]
    return Missed(tuple(loose), tuple(forms))


def no_noise(
    verdict: Verdict, alternative: Curved | None, remaining: Missed, beliefs: Beliefs
) -> Verdict:
    """
    Return 'unknown' in the place of 'none' where what looks like noise follows something.

    verdict: of any other status, nothing changes.
    alternative: the free-form explanation, whether or not it can be carried to another motion.
    """
    if verdict.status != 'none':
        return verdict
    reasons = [
        f'what remains is no noise of the instrument: {100.0 * one.share:.0f} % of it lies along '
        f'the motion of {one.joint}'
        for one in remaining.scattered
    ]
    form = None if alternative is None else alternative.form
    if form and form.gain >= beliefs.beaten_share and form.steady >= beliefs.beaten_steady:
        places = ' and '.join(str(part.group) for part in form.parts)
        reasons.append(
            f'no effect in the library explains the gap, but it is no noise: {places} predicts '
            f'{100.0 * form.gain:.0f} % of it on unseen stretches'
        )
    return replace(verdict, status='unknown', reasons=tuple(reasons)) if reasons else verdict


def _fails(one: Beside, beliefs: Beliefs) -> bool:
    """Return whether a free form takes off more than what a formula may miss."""
    if one.on == 'place':
        clear = one.gain >= beliefs.dependence_gain and one.steady >= beliefs.dependence_sure
        return clear and one.share >= beliefs.field_misses
    clear = one.gain >= beliefs.group_share and one.steady >= beliefs.structure_sure
    return clear and one.share >= beliefs.misfit_share


def beside_names(result: Search, unseen: Unseen) -> list[Beside]:
    """Return what free forms at the places of the effects found predict beside all of them."""
    problem, model = unseen.problem, result.final.model
    if problem.touched or not model.found:
        return []
    sizes = [unseen.rms(part) for part in unseen.targets[1:]]
    bases, places = unseen.bases(), {e.at for e in model.found}
    out = []
    for group in plain_groups(problem, model, unseen.scale):
        if group.at != FIELD and (group.on != 'direction' or group.at not in places):
            continue
        own = [s for e, s in zip(model.found, sizes, strict=False) if group.at in (e.at, FIELD)]
        reported = least_gain([base.gain(group.columns) for base in bases])
        share = float(np.sqrt(max(reported.fall, 0.0))) / max([*own, 1e-12])
        out.append(Beside(group.at, group.on, reported.share, reported.steady, share))
    return out
