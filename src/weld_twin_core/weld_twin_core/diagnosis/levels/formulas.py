# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Do the formulas of the names hold? Free forms instead of them and at their places, and noise."""

from __future__ import annotations

from collections.abc import Sequence, Set
from typing import NamedTuple

import numpy as np

from ..beliefs import Beliefs
from ..hypotheses.search import Search
from ..result import NAMING, Site
from ..unseen.unseen_stretches import Unseen
from ..verdict.decision import Verdict
from .curved import Curved, gain_of
from .own_place import Beside, beside_names
from .scatter import Scatter, scatter


class Missed(NamedTuple):
    """
    What the formulas of the names miss.

    Attributes
    ----------
    scattered : tuple of Scatter
        Joints that noise comes from, largest first.
    forms : tuple of Beside
        Free forms that predict what a name should.

    """

    scattered: tuple[Scatter, ...] = ()
    forms: tuple[Beside, ...] = ()


def formulas(
    found: Search, unseen: Unseen, verdict: Verdict, rival: Curved | None, beliefs: Beliefs
) -> tuple[Verdict, Missed]:
    """
    Return the verdict, or 'unknown' where what it names leaves what its formula should not.

    A free form that takes off much less than the effect itself, or than the noise, only mends a
    formula; so does scatter.

    Parameters
    ----------
    found : Search
    unseen : Unseen
        Of its final model.
    verdict : Verdict
    rival : Curved or None
        The free-form explanation in place of the names.
    beliefs : Beliefs

    """
    verdict = held_against(verdict, unseen, rival, beliefs)
    if found.dense:
        return verdict, Missed()
    loose = [
        one
        for one in sorted(scatter(found, unseen), key=lambda one: -one.share)
        if one.share >= beliefs.beaten_share and one.steady >= beliefs.scatter_sure
    ]
    if verdict.status not in (*NAMING, 'none'):
        return verdict, Missed(tuple(loose))
    sizes = _sizes(found, unseen)
    reasons = [
        f'what remains is no noise of the instrument: {100.0 * one.share:.0f} % of it lies along '
        f'the motion of {one.joint}'
        for one in loose
        if one.size >= beliefs.scatter_misses * sizes.get(one.joint, 0.0)
    ]
    told = beside_names(found, unseen) if verdict.status in NAMING else []
    missed = tuple(one for one in told if _fails(one, beliefs))
    reasons += [_misses(one) for one in _clearest(missed)]
    if not reasons:
        return verdict, Missed()
    doubted = {one.at for one in missed} | {one.joint for one in loose}
    sets = () if 'instrument' in doubted else _but_at(verdict, doubted)
    unknown = Verdict('unknown', beliefs.beaten_belief, sets, tuple(reasons))
    return unknown, Missed(tuple(loose), missed)


def _but_at(verdict: Verdict, doubted: Set[str]) -> tuple[tuple[Site, ...], ...]:
    """Return what is named but for the places where a formula does not hold."""
    return tuple(group for group in verdict.sets if not {s.joint for s in group} & doubted)


def _sizes(found: Search, unseen: Unseen) -> dict[str, float]:
    """Return the largest effect at every place, RMS in units of noise."""
    out: dict[str, float] = {}
    for effect, part in zip(found.final.model.found, unseen.targets[1:], strict=True):
        out[effect.at] = max(out.get(effect.at, 0.0), float(np.sqrt((part**2).mean())))
    return out


def _clearest(missed: Sequence[Beside]) -> list[Beside]:
    """Return one free form for each place, that which predicts most."""
    out: dict[str, Beside] = {}
    for one in missed:
        if one.at not in out or one.gain > out[one.at].gain:
            out[one.at] = one
    return list(out.values())


def _fails(one: Beside, beliefs: Beliefs) -> bool:
    """Return whether a free form takes off more than what a formula may miss."""
    if one.on == 'place':
        clear = one.gain >= beliefs.dependence_gain and one.steady >= beliefs.dependence_sure
        return clear and one.share >= beliefs.field_misses
    clear = one.gain >= beliefs.group_share and one.steady >= beliefs.structure_sure
    return clear and one.share >= beliefs.misfit_share


def _misses(one: Beside) -> str:
    return (
        f'a free curve at {one.at}, depending on {one.on}, still predicts '
        f'{100.0 * one.gain:.0f} % of what is left on unseen stretches: the formula of what was '
        'found does not hold'
    )


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
