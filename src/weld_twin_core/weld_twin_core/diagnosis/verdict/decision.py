# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""From fits to a verdict: status, sets that cannot be told apart, and how sure it is."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from ...effects import REGISTRY
from ..beliefs import Beliefs
from ..hypotheses.rivals import Rival
from ..result import Family, Site
from .evidence import Evidence
from .weighing import TINY, Weighed

_CANCEL = (
    'the effects that fit best nearly cancel each other: together they imitate a cause that is '
    'not in the library'
)
AT_REST = ('constant', 'angle', 'place', 'load')
"""Dependences that show without any motion."""
_NO_KIND = (
    'no kind of error is needed by these data more than the others: each takes the place of the '
    'rest'
)


@dataclass(frozen=True)
class Verdict:
    """
    Status, confidence, one set of sites per effect told, families of many small ones.

    An effect that was found is told whatever the status: 'unknown' says that beside it something
    is left that has no name. ``sure`` says whether the answer keeps the promise of being wrong
    hardly ever; ``complete`` is the probability that no cause of any size is missing.
    """

    status: str
    confidence: float
    sets: tuple[tuple[Site, ...], ...]
    reasons: tuple[str, ...]
    families: tuple[Family, ...] = ()
    sure: bool = False
    complete: float = 0.0


def decide(evidence: Evidence, beliefs: Beliefs | None = None) -> Verdict:
    """
    Return the verdict.

    Parameters
    ----------
    evidence : Evidence
    beliefs : Beliefs, optional
        The usual ones when left out.

    """
    case = Weighed(evidence, beliefs or Beliefs())
    if evidence.families is not None:
        return _of_families(case)
    if not evidence.slots:
        return _of_nothing(case)
    sets = tuple(leaders(slot, case.beliefs) for slot in evidence.slots)
    open_ends: tuple[str, ...] = ()
    if not case.carries and evidence.least is not None:
        # Another member of a set may carry over where the one in the model does not: no sign of a
        # cause that the library lacks.
        other = Weighed(replace(evidence, after=evidence.least), case.beliefs)
        if other.carries:
            case, open_ends = other, (_parts_elsewhere(evidence),)
    if len(sets) > 1 and sum(evidence.parts) > case.beliefs.cancel:
        return Verdict('unknown', case.beliefs.doubted, (), (_CANCEL,))
    doubt = _doubt(case)
    if doubt is not None:
        return Verdict('unknown', case.beliefs.doubted, _elsewhere(sets, evidence), (doubt,))
    if case.left > case.beliefs.unexplained:
        told = _elsewhere(sets, evidence)
        return Verdict('unknown', _unknown_confidence(case), told, (_depends(evidence),))
    reasons = (*(_alike(chosen) for chosen in sets if len(chosen) > 1), *open_ends)
    status = 'ambiguous' if reasons else 'identified'
    return Verdict(status, _confidence(case, sets), sets, reasons)


def _of_nothing(case: Weighed) -> Verdict:
    """Return the verdict where no effect was found."""
    told, beliefs = case.evidence, case.beliefs
    if told.refused or told.lacking:
        return Verdict('unknown', beliefs.doubted, (), (_absurd(told),))
    if case.left > beliefs.unexplained and case.above_noise:
        return Verdict('unknown', _unknown_confidence(case), (), (_depends(told),))
    if case.wide:
        reason = (
            'what remains is far wider spread than noise, though it depends on nothing looked at'
        )
        return Verdict('unknown', beliefs.noise_unseen, (), (reason,))
    if not told.independent and told.after > beliefs.above * told.floor:
        return Verdict(
            'none',
            beliefs.noise_unseen,
            (),
            (
                'nothing is found, but what remains is not spread as noise is, and nothing on these '
                'recordings shows the noise by itself: repeat some poses',
            ),
        )
    return Verdict('none', beliefs.calibration, (), ('the gap does not rise above the noise',))


def _of_families(case: Weighed) -> Verdict:
    """Return the families that unseen data need, each with the joints that they need it on."""
    beliefs = case.beliefs
    families = []
    for told in case.evidence.families or ():
        members = tuple(item for item in told.members if item[1] > beliefs.member_least_m)
        if members:
            named = told.named(beliefs.family_worth)
            needed = tuple(item for item in told.needed if item[1] >= beliefs.joint_worth)
            like = tuple(item for item in told.like if item[1] >= beliefs.joint_worth)
            more = told.median, needed, like, told.share
            families.append(Family(told.effect, named, told.rms_m, members, *more))
    families.sort(key=lambda family: -family.rms_m)
    sets = tuple(group for family in families if family.named for group in _sets_of(family))
    reason = (
        'many small errors act together; a kind is named where unseen data get worse without it, '
        'whatever the others do in its place'
    )
    if not sets:
        return Verdict('unknown', beliefs.doubted, (), (reason, _NO_KIND), tuple(families))
    alone = all(len(group) == 1 for group in sets)
    status = 'identified' if alone else 'ambiguous'
    if case.left > beliefs.unexplained:
        status = 'unknown'
    return Verdict(status, beliefs.families * case.complete, sets, (reason,), tuple(families))


def _sets_of(family: Family) -> list[tuple[Site, ...]]:
    """Return a set for every joint of a kind; what would do as well as the kind is in the first."""
    sites = [site for site, _ in family.needed]
    like = tuple(site for site, _ in family.like)
    return [(sites[0], *like), *((site,) for site in sites[1:])] if sites else []


def _confidence(case: Weighed, sets: tuple[tuple[Site, ...], ...]) -> float:
    """Return the probability that the sets named are right, and all there is."""
    told, beliefs = case.evidence, case.beliefs
    mass = [
        sum(r.probability for r in slot if r.site in chosen)
        for slot, chosen in zip(told.slots, sets, strict=True)
    ]
    out = float(np.prod(mass)) * case.complete * beliefs.calibration ** len(sets)
    if _stacked(sets):
        out *= beliefs.stacked
    if told.glimpsed:
        out *= beliefs.glimpsed
    risen = min(case.rise / beliefs.rise, case.share / beliefs.rise_share)
    return float(out / (1.0 + risen**beliefs.rise_power))


def _doubt(case: Weighed) -> str | None:
    """Return why the effects found are no plausible explanation, however well they fit."""
    told, beliefs = case.evidence, case.beliefs
    # Beside effects that leave noise alone, what no machine has would mend a formula at most.
    remains = case.above_noise or told.structure.gain > beliefs.structure_gain
    if told.lacking or (told.refused and remains):
        return _absurd(told)
    bent = [joint for joint in told.glimpsed if _joints_at_rest(told).count(joint) > 1]
    if bent:
        return (
            f'less than a period of ripple was seen over the angle of {" and ".join(bent)}, and '
            'with another effect on that joint it bends to anything that depends on the angle'
        )
    if not case.carries:
        return (
            f'what was found leaves {told.after / told.fitted:.1f} times as much on the '
            'held-out motion as on the recordings fitted: it imitates a cause that is not in the '
            'library'
        )
    return None


def _absurd(evidence: Evidence) -> str:
    """Return that only what no machine has, or the library lacks, would explain the rest."""
    first, *_ = (*evidence.lacking, *evidence.refused)
    return (
        f'what remains would be explained best by {first}: it imitates a cause that '
        'is not in the library, or the data are not what they seem'
    )


def _stacked(sets: tuple[tuple[Site, ...], ...]) -> bool:
    """Return whether two effects that show at rest sit on one joint: two may stand for a third."""
    joints = _at_rest(chosen[0] for chosen in sets)
    return len(joints) > len(set(joints))


def _joints_at_rest(evidence: Evidence) -> list[str]:
    return _at_rest(slot[0].site for slot in evidence.slots)


def _at_rest(sites: Iterable[Site]) -> list[str]:
    """Return the joints of the effects that show at rest."""
    return [
        site.joint for site in sites if site.joint and REGISTRY[site.effect].depends_on in AT_REST
    ]


def _elsewhere(
    sets: tuple[tuple[Site, ...], ...], evidence: Evidence
) -> tuple[tuple[Site, ...], ...]:
    """
    Return the sets that sit where nothing is left.

    What is left at the joint of an effect says that its formula is not the one at work there.
    """
    first = (*evidence.structure.depends_on[:1], *evidence.refused[:1], *evidence.lacking[:1])
    return tuple(
        group
        for group in sets
        if not any(s.joint is not None and s.joint in word for s in group[:1] for word in first)
    )


def _unknown_confidence(case: Weighed) -> float:
    least, most = case.beliefs.unknown_least, case.beliefs.unknown_most
    return float(np.clip(least + case.left, least, most))


def leaders(slot: tuple[Rival, ...], beliefs: Beliefs) -> tuple[Site, ...]:
    """
    Return the leader alone when it is sure, else all worth naming, the simplest first.

    Parameters
    ----------
    slot : tuple of Rival
    beliefs : Beliefs

    """
    if slot[0].probability >= beliefs.sure:
        return (slot[0].site,)
    listed = dict.fromkeys(r.site for r in slot if r.probability >= beliefs.listed)
    return tuple(sorted(listed, key=_numbers))


def _numbers(site: Site) -> int:
    """Return how many numbers an effect has: the fewer, the simpler."""
    return sum(max(parameter.size, 1) for parameter in REGISTRY[site.effect].parameters)


def _alike(chosen: tuple[Site, ...]) -> str:
    names = ', '.join(str(site) for site in chosen)
    return f'{names} move the tool alike on these data: their fits differ by less than the noise'


def _parts_elsewhere(evidence: Evidence) -> str:
    """Return that members of a set part on the held-out motion."""
    return (
        'what cannot be told apart here parts on the held-out motion: there the model leaves '
        f'{evidence.after / max(evidence.fitted, TINY):.1f} times as much, and another member of '
        'a set does not'
    )


def _depends(evidence: Evidence) -> str:
    names = evidence.structure.depends_on
    on = ' and '.join(names) if names else 'something not looked at'
    return f'what remains depends on {on}, and no effect in the library explains it'
