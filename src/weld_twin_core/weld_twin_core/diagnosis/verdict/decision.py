# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
From the table of answers to a verdict: what is told, and is it more than what has no name?

One rule decides. An effect counts as named where its name is likelier right than wrong, and nothing
free at its place predicts what its formula should. What the others explain, and what nothing
explains, has no name; where that is more, the gap is unknown.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..beliefs import Beliefs
from ..posterior.table import named_together
from ..result import Family, Site
from .evidence import Evidence

FIELD = 'instrument'
"""A free field over the workspace speaks against every formula: it is what each of them bends to."""
LIKELIER = 0.5
"""Probability from which on a cause counts as named: it is likelier right than wrong."""
TINY = 1e-18
"""Least squared gap [m^2] divided by: a nanometre, far below any instrument."""
_MANY_IMITATE = (
    'many small errors together fit best, but leave so much that they rather imitate a cause that '
    'is not in the library'
)
_NO_KIND = (
    'no kind of error is needed by these data more than the others: each takes the place of the '
    'rest'
)


@dataclass(frozen=True)
class Verdict:
    """
    Status, one set of sites per effect told, families of many small ones, and how sure it is.

    An effect that was found is told whatever the status: 'unknown' says that beside it something
    is left that has no name. ``confidence`` is the probability that the whole answer is right,
    ``sure`` says whether it keeps the promise of being wrong hardly ever, and ``complete`` is the
    probability that no cause of any size is missing; all three are told by the calibration.
    """

    status: str
    sets: tuple[tuple[Site, ...], ...] = ()
    reasons: tuple[str, ...] = ()
    families: tuple[Family, ...] = ()
    confidence: float = 0.0
    sure: bool = False
    complete: float = 0.0


@dataclass(frozen=True, eq=False)
class Left:
    """Evidence, and the numbers from which on what it leaves is more than noise."""

    evidence: Evidence
    beliefs: Beliefs

    @property
    def structured(self) -> bool:
        """Return whether generic columns find something beyond doubt."""
        gain, sure = self.evidence.structure.gain, self.evidence.structure.sure
        usual = gain > self.beliefs.structure_gain and sure > self.beliefs.structure_sure
        blatant = gain > self.beliefs.blatant_gain and sure > self.beliefs.blatant_sure
        return (usual or blatant) and gain > self.evidence.structure.chance

    @property
    def high(self) -> bool:
        """Return whether what remains rises above a floor that was measured apart."""
        told = self.evidence
        return told.independent and self.rises(self.beliefs.above)

    @property
    def wide(self) -> bool:
        """Return whether what remains is far wider than a floor that only the fit shows."""
        told = self.evidence
        return not told.independent and self.rises(self.beliefs.far_above)

    def rises(self, times: float) -> bool:
        """Return whether what remains is so many times the floor, and more than chance makes it."""
        told = self.evidence
        return told.after > max(times, told.leverage) * told.floor

    @property
    def above_noise(self) -> bool:
        """Return whether what remains is more than noise."""
        return self.structured or self.high

    @property
    def share(self) -> float:
        """Return the share of the squared gap above noise that is not explained."""
        told = self.evidence
        found = told.structure.gain * told.after**2 if self.structured else 0.0
        over = told.after**2 - told.floor**2 if self.high else 0.0
        if self.wide:
            # Such a floor may be too low by that factor; what is beyond is left all the same.
            over = told.after**2 - (self.beliefs.far_above * told.floor) ** 2
        return float(np.clip(max(found, over) / self._excess, 0.0, 1.0))

    @property
    def explained(self) -> float:
        """Return the share of the squared gap above noise that the model takes off unseen data."""
        told = self.evidence
        return float(np.clip((told.gap**2 - told.after**2) / self._excess, 0.0, 1.0))

    @property
    def _excess(self) -> float:
        told = self.evidence
        least = self.beliefs.least_excess * told.floor**2
        return max(told.gap**2 - told.floor**2, least, TINY)


def decide(evidence: Evidence, beliefs: Beliefs | None = None) -> Verdict:
    """Return the verdict, by the usual beliefs when none are given."""
    left = Left(evidence, beliefs or Beliefs())
    if evidence.families is not None:
        return _of_families(left)
    if not evidence.slots:
        return _of_nothing(left)
    sets = tuple(named_together(slot, left.beliefs) for slot in evidence.slots)
    likely = [
        p > LIKELIER and _holds(group, evidence)
        for p, group in zip(evidence.believed, sets, strict=True)
    ]
    named = left.explained * _share_of(likely, evidence)
    if named <= left.share + left.explained * _share_of([not one for one in likely], evidence):
        told = tuple(group for group, holds in zip(sets, likely, strict=True) if holds)
        return Verdict('unknown', told, _why_unknown(left, sets, likely))
    reasons = tuple(_alike(group) for group in sets if len(group) > 1)
    return Verdict('ambiguous' if reasons else 'identified', sets, reasons)


def _holds(group: tuple[Site, ...], evidence: Evidence) -> bool:
    """Return whether nothing free predicts what the formulas of a set should."""
    return not any(
        at == FIELD or at in [site.joint for site in group] for at, _ in evidence.missed
    )


def _share_of(some: list[bool], evidence: Evidence) -> float:
    """Return the share of what is explained that some of the effects explain."""
    parts = evidence.parts[: len(some)]
    whole = sum(parts)
    own = sum(part for part, holds in zip(parts, some, strict=True) if holds)
    return own / whole if whole > 0.0 else float(all(some))


def _why_unknown(
    left: Left, sets: tuple[tuple[Site, ...], ...], likely: list[bool]
) -> tuple[str, ...]:
    """Return why something has no name, the gravest first."""
    told = left.evidence
    out = [_absurd(told)] if told.refused or told.lacking else []
    out += [sentence for _, sentence in told.missed]
    if left.share > left.beliefs.unexplained:
        out.append(_depends(told))
    doubted = [group[0] for group, holds in zip(sets, likely, strict=True) if not holds]
    if doubted and not told.missed:
        names = ', '.join(map(str, doubted))
        out.append(
            f'what would fit best is {names}, and where the evidence was like this, such a name '
            'was wrong more often than right: it imitates a cause that is not in the library'
        )
    return tuple(out) or (_depends(told),)


def _of_nothing(left: Left) -> Verdict:
    """Return the verdict where no effect was found."""
    told, beliefs = left.evidence, left.beliefs
    if told.refused or told.lacking:
        return Verdict('unknown', (), (_absurd(told),))
    if left.share > beliefs.unexplained and left.above_noise:
        return Verdict('unknown', (), (_depends(told),))
    if left.wide:
        reason = (
            'what remains is far wider spread than noise, though it depends on nothing looked at'
        )
        return Verdict('unknown', (), (reason,))
    if not told.independent and left.rises(beliefs.above):
        reason = (
            'nothing is found, but what remains is not spread as noise is, and nothing on these '
            'recordings shows the noise by itself: repeat some poses'
        )
        return Verdict('none', (), (reason,))
    return Verdict('none', (), ('the gap does not rise above the noise',))


def _of_families(left: Left) -> Verdict:
    """Return the families that unseen data need, each with the joints that they need it on."""
    beliefs = left.beliefs
    families = []
    for told in left.evidence.families or ():
        members = tuple(item for item in told.members if item[1] > beliefs.member_least_m)
        if members:
            needed, like = (
                tuple(item for item in part if item[1] >= beliefs.joint_worth)
                for part in (told.needed, told.like)
            )
            named = told.missed(beliefs.family_worth)
            families.append(replace(told, named=named, members=members, needed=needed, like=like))
    families.sort(key=lambda family: -family.rms_m)
    sets = tuple(group for family in families if family.named for group in _sets_of(family))
    reason = (
        'many small errors act together; a kind is named where unseen data get worse without it, '
        'whatever the others do in its place'
    )
    whole = Verdict('identified', sets, (reason,), tuple(families))
    if not sets:
        return replace(whole, status='unknown', reasons=(reason, _NO_KIND))
    if not all(p > LIKELIER for p in left.evidence.believed):
        return replace(whole, status='unknown', reasons=(_MANY_IMITATE,))
    if left.explained <= left.share:
        return replace(whole, status='unknown')
    alone = all(len(group) == 1 for group in sets)
    return whole if alone else replace(whole, status='ambiguous')


def _sets_of(family: Family) -> list[tuple[Site, ...]]:
    """Return a set for every joint of a kind; what would do as well as the kind is in the first."""
    sites = [site for site, _ in family.needed]
    like = tuple(site for site, _ in family.like)
    return [(sites[0], *like), *((site,) for site in sites[1:])] if sites else []


def _absurd(evidence: Evidence) -> str:
    """Return that only what no machine has, or the library lacks, would explain the rest."""
    first, *_ = (*evidence.lacking, *evidence.refused)
    return (
        f'what remains would be explained best by {first}: it imitates a cause that '
        'is not in the library, or the data are not what they seem'
    )


def _alike(chosen: tuple[Site, ...]) -> str:
    names = ', '.join(str(site) for site in chosen)
    return f'{names} move the tool alike on these data: their fits differ by less than the noise'


def _depends(evidence: Evidence) -> str:
    names = evidence.structure.depends_on
    on = ' and '.join(names) if names else 'something not looked at'
    return f'what remains depends on {on}, and no effect in the library explains it'
