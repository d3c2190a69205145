# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
From the table of answers to a verdict: what has a name, and is that more than what has none?

One rule decides. An effect counts as named where its name is likelier right than wrong. What the
others explain, and what nothing explains, has no name. Where that is more, or where a cause that has
no name is likelier at work than not, the gap is unknown; what counts as named is reported all the same.
Noise that comes from a joint beyond doubt is such a cause. What depends there on the direction of motion
is the mean of the same jumps, and no cause beside it.
"""

from __future__ import annotations

from dataclasses import replace

from ..beliefs import Beliefs
from ..evidence import LIKELIER, CandidateSet, Evidence, Left, Verdict, named_together
from ..negligible import MICROMETRE
from ..result import Family, Site

LISTED = 8
"""Readings that a sentence lists one by one at the most."""
NO_GAP = 'there is no gap above the noise'
UNEVEN = (
    'nothing is found, but what remains is not spread as noise is, and nothing on these recordings '
    'shows the noise by itself, so repeat some poses'
)
"""Why nothing is told where a floor that only the fit shows leaves it open whether there is a gap."""
_FOREIGN = (
    'where the evidence was like this, a cause that is not in the library was at work more often '
    'than not, and what was found stood in for a part of it'
)
_NO_KIND = (
    'no kind of error is needed by these data more than the others: each takes the place of the '
    'rest'
)


def decide(evidence: Evidence, beliefs: Beliefs | None = None) -> Verdict:
    """Return the verdict, by the usual beliefs when none are given."""
    remaining = Left(evidence, beliefs or Beliefs())
    if evidence.families is not None:
        return _of_families(remaining)
    if not evidence.candidate_sets:
        return _of_nothing(remaining)
    sets = tuple(
        named_together(candidate_set, remaining.beliefs)
        for candidate_set in evidence.candidate_sets
    )
    likely = [
        p > LIKELIER and not _mean_of_jumps(evidence, candidate_set)
        for candidate_set, p in zip(evidence.candidate_sets, evidence.believed, strict=True)
    ]
    named = remaining.explained * _share_of(likely, evidence)
    more = remaining.share + remaining.explained * _share_of([not one for one in likely], evidence)
    more += remaining.scattered
    likeliest = tuple(group for group, holds in zip(sets, likely, strict=True) if holds)
    if named <= more or evidence.nameless > LIKELIER:
        return Verdict('unknown', likeliest, _why_unknown(remaining, sets, likely))
    reasons = tuple(
        f'{", ".join(map(str, group))} move the tool alike on these data: their fits differ by less '
        'than the noise'
        for group in likeliest
        if len(group) > 1
    )
    return Verdict('ambiguous' if reasons else 'identified', likeliest, reasons)


def _mean_of_jumps(evidence: Evidence, candidate_set: CandidateSet) -> bool:
    """Return whether an effect depends on the direction of a joint that noise comes from."""
    leader, joints = candidate_set[0], {one.joint for one in evidence.scattered}
    return leader.site.joint in joints and leader.dependence == 'direction'


def _share_of(some: list[bool], evidence: Evidence) -> float:
    """Return the share of what is explained that some of the effects explain."""
    parts = evidence.parts[: len(some)]
    whole = sum(parts)
    own = sum(part for part, holds in zip(parts, some, strict=True) if holds)
    return own / whole if whole > 0.0 else float(all(some))


def _why_unknown(
    remaining: Left, sets: tuple[tuple[Site, ...], ...], likely: list[bool]
) -> tuple[str, ...]:
    """Return why something has no name, the gravest first."""
    evidence = remaining.evidence
    out = [_absurd(evidence)] if evidence.refused or evidence.lacking else []
    out += _no_noise(evidence)
    if remaining.share > remaining.beliefs.unexplained:
        out.append(_depends(evidence))
    doubted = [
        group[0]
        for group, candidate_set, holds in zip(sets, evidence.candidate_sets, likely, strict=True)
        if not (holds or _mean_of_jumps(evidence, candidate_set))
    ]
    if doubted:
        names = ', '.join(map(str, doubted))
        out.append(
            f'what would fit best is {names}, and where the evidence was like this, such a name '
            'was wrong more often than right: it imitates a cause that is not in the library'
        )
    if not out and evidence.nameless > LIKELIER:
        out.append(_FOREIGN)
    return tuple(out) or (_depends(evidence),)


def _of_nothing(remaining: Left) -> Verdict:
    """Return the verdict where no effect was found."""
    evidence, beliefs = remaining.evidence, remaining.beliefs
    if evidence.refused or evidence.lacking:
        return Verdict('unknown', (), (_absurd(evidence),))
    with_strays = replace(remaining, evidence=replace(evidence, after=evidence.with_strays))
    noise = not remaining.structured and not remaining.rises(beliefs.above)
    if evidence.strays and noise and with_strays.rises(beliefs.above):
        first, others = evidence.strays[:LISTED], len(evidence.strays) - LISTED
        names = ', '.join(first) + (f' and {others} others' if others > 0 else '')
        reason = (
            f'nothing but noise is left where no reading stands out by itself; those at {names} do, '
            'so measure there again'
        )
        return Verdict('none', (), (reason,))
    if remaining.share > beliefs.unexplained and remaining.above_noise:
        return Verdict('unknown', (), (_depends(evidence),))
    if remaining.wide:
        reason = (
            'what remains is far wider spread than noise, though it depends on nothing looked at'
        )
        return Verdict('unknown', (), (reason,))
    if evidence.scattered:
        return Verdict('unknown', (), tuple(_no_noise(evidence)))
    if not evidence.independent and remaining.rises(beliefs.above):
        return Verdict('none', (), (UNEVEN,))
    return Verdict('none', (), (NO_GAP,))


def _of_families(remaining: Left) -> Verdict:
    """Return the families that unseen data need, each with the joints that they need it on."""
    beliefs = remaining.beliefs
    families = []
    for family in remaining.evidence.families or ():
        members = tuple(item for item in family.members if item[1] > MICROMETRE)
        if not members and family.chosen and family.rms_m > MICROMETRE:
            # The fit of all kinds has put into others what unseen data need of this one.
            members = family.members
        if members:
            # Joints at which it is the same error count together.
            needed = tuple(
                (site, share)
                for site, share in family.needed
                if share * len(family.group(site)) >= beliefs.family_worth
            )
            like = tuple(item for item in family.like if item[1] >= beliefs.family_worth)
            named = family.missed(beliefs.family_worth)
            families.append(
                replace(family, named=named, members=members, needed=needed, like=like)
            )
    families.sort(key=lambda family: -family.rms_m)
    sets = tuple(group for family in families if family.named for group in _sets_of(family))
    reason = (
        'many small errors act together; a kind is named where unseen data get worse without it, '
        'whatever the others do in its place'
    )
    whole = Verdict('identified', sets, (reason,), tuple(families))
    if not sets and remaining.explained <= beliefs.unexplained:
        return _of_nothing(remaining)
    if not sets:
        return replace(whole, status='unknown', reasons=(reason, _NO_KIND))
    if remaining.explained <= remaining.share:
        return replace(whole, status='unknown')
    alone = all(len(group) == 1 for group in sets)
    return whole if alone else replace(whole, status='ambiguous')


def _sets_of(family: Family) -> list[tuple[Site, ...]]:
    """
    Return a set for every joint of a kind, or for joints that are alike.

    What would do as well as the kind is in the first.
    """
    groups = dict.fromkeys(family.group(site) for site, _ in family.needed)
    like = [site for site, _ in family.like]
    return [(*group, *(like if k == 0 else ())) for k, group in enumerate(groups)]


def _no_noise(evidence: Evidence) -> list[str]:
    """Return that what looks like noise comes from a joint, for each such joint."""
    return [
        f'what remains is no noise of the instrument: {100.0 * one.share:.0f} % of it lies along '
        f'the motion of {one.joint}'
        for one in evidence.scattered
    ]


def _absurd(evidence: Evidence) -> str:
    """Return that only what no machine has, or the library lacks, would explain the rest."""
    first, *_ = (*evidence.lacking, *evidence.refused)
    return (
        f'what remains would be explained best by {first}: it imitates a cause that '
        'is not in the library, or the data are not what they seem'
    )


def _depends(evidence: Evidence) -> str:
    names = evidence.structure.depends_on
    on = ' and '.join(names) if names else 'something not looked at'
    return f'what remains depends on {on}, and no effect in the library explains it'
