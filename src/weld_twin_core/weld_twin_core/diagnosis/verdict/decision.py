# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""From fits to a verdict: status, sets that cannot be told apart, and how sure it is."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ...effects import REGISTRY
from ...effects.transmission_ripple import TransmissionRipple
from ..hypotheses.rivals import LISTED, Rival
from ..result import Family, Site
from ..unseen.leftover_structure import Structure

SURE = 0.85
"""A leader less probable than this is not named alone."""
STRUCTURE = 0.05
"""Share of the squared gap that may stay unexplained before the answer is 'unknown'."""
ABOVE = 1.3
"""What remains must exceed an independently measured floor by this factor to count."""
GAIN, CERTAIN = 0.03, 3.0
"""Share of the squared error that a structure must take away, in standard errors as well."""
BLATANT, LIKELY = 0.15, 1.5
"""The same for a structure so large that a few stretches may hold all of it."""
CANCEL = 5.0
"""Effects whose squares sum to this many times the square of their sum cancel each other."""
CROWD = 3
"""More separate causes than this at once are more likely one that the library lacks."""
CARRIED = 1.3
"""What remains on a held-out motion over what remains on unseen stretches of those fitted: beyond
this the model does not carry over, as a cause would that was found."""
RISE, SHARE = 0.2, 0.12
"""Rise above the floor, as a share of it, and as a share of the gap, that together halve the
belief: a large gap leaves more of the physics that no model has, a small one more of the noise."""
CARRIED_SHARE = 0.1
"""Share of the gap that a model may leave on any motion before it is said not to carry over."""
STACKED = 0.75
"""Belief left when two effects at rest sit on one joint; a judgement."""
CALIBRATION = 0.95
"""Belief left for every cause named where all evidence agrees: no library is complete, and on some
motions a cause that it lacks moves the tool exactly as those that it holds."""
GLIMPSED = 0.6
"""Belief left in a ripple of which less than a period was seen; a judgement."""
DOUBTED = 0.75
"""Belief in 'unknown' where effects fit but are no plausible explanation; a judgement."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """
    What the verdict is drawn from.

    Attributes
    ----------
    slots : tuple of tuple of Rival
        For every found effect, itself and its rivals, most probable first.
    structure : Structure
        What generic columns still find.
    gap, after, floor : float
        RMS on unseen data before and after, and of the noise, [m].
    fitted : float
        RMS after on unseen stretches of the recordings fitted, [m]; the same as ``after`` where
        nothing was held out.
    independent : bool
        Whether the floor was measured apart from any model.
    parts : tuple of float
        Squared contribution of every effect over the square of their sum.
    glimpsed : tuple of str
        Joints whose ripple was seen over less than a period.

    """

    slots: tuple[tuple[Rival, ...], ...]
    structure: Structure
    gap: float
    after: float
    floor: float
    fitted: float
    independent: bool
    parts: tuple[float, ...]
    glimpsed: tuple[str, ...] = ()

    @property
    def structured(self) -> bool:
        """Return whether generic columns find something beyond doubt."""
        gain, sure = self.structure.gain, self.structure.sure
        return (gain > GAIN and sure > CERTAIN) or (gain > BLATANT and sure > LIKELY)

    @property
    def above_noise(self) -> bool:
        """Return whether what remains rises above the floor."""
        return self.structured or (self.independent and self.after > ABOVE * self.floor)

    @property
    def rise(self) -> float:
        """Return by what share of an independent floor what remains stands above it."""
        return max(self.after / self.floor - 1.0, 0.0) if self.independent else 0.0

    @property
    def carried(self) -> bool:
        """Return whether the model does on a held-out motion what it does on those fitted."""
        return (
            self.after < ABOVE * self.floor
            or self.after < CARRIED * self.fitted
            or self.share < CARRIED_SHARE
        )

    @property
    def share(self) -> float:
        """Return what remains above the floor as a share of the gap."""
        gap = max(self.gap**2 - self.floor**2, 1e-18)
        return float(np.sqrt(max(self.after**2 - self.floor**2, 0.0) / gap))

    @property
    def left(self) -> float:
        """Return the share of the squared gap above noise that is not explained."""
        excess = max(self.gap**2 - self.floor**2, 0.05 * self.floor**2, 1e-18)
        found = self.structure.gain * self.after**2 if self.structured else 0.0
        high = self.independent and self.after > ABOVE * self.floor
        over = self.after**2 - self.floor**2 if high else 0.0
        return float(np.clip(max(found, over) / excess, 0.0, 1.0))


@dataclass(frozen=True)
class Verdict:
    """Status, confidence, one set of sites per named effect, families of many small ones."""

    status: str
    confidence: float
    sets: tuple[tuple[Site, ...], ...]
    reasons: tuple[str, ...]
    families: tuple[Family, ...] = ()


def decide(evidence: Evidence) -> Verdict:
    """Return the verdict."""
    left = evidence.left
    if not evidence.slots:
        if left > STRUCTURE:
            return Verdict('unknown', _unknown_confidence(left), (), (_depends(evidence),))
        return _none(evidence)
    sets = tuple(_leaders(slot) for slot in evidence.slots)
    doubt = _doubt(evidence)
    if left > STRUCTURE or doubt is not None:
        solid = tuple(
            chosen
            for chosen, part in zip(sets, evidence.parts, strict=True)
            if len(chosen) == 1
            and doubt is None
            and part > left
            and not _touched(chosen[0], evidence)
        )
        reason = _depends(evidence) if doubt is None else doubt
        sure = _unknown_confidence(left) if doubt is None else DOUBTED
        return Verdict('unknown', sure, solid, (reason,))
    mass = [
        sum(r.probability for r in slot if r.site in chosen)
        for slot, chosen in zip(evidence.slots, sets, strict=True)
    ]
    complete = 1.0 / (1.0 + (left / STRUCTURE) ** 3)
    confidence = float(np.prod(mass)) * complete * CALIBRATION ** len(sets)
    if _stacked(sets):
        confidence *= STACKED
    if evidence.glimpsed:
        confidence *= GLIMPSED
    confidence /= 1.0 + min(evidence.rise / RISE, evidence.share / SHARE) ** 2
    reasons = tuple(
        _alike(slot, chosen)
        for slot, chosen in zip(evidence.slots, sets, strict=True)
        if len(chosen) > 1
    )
    status = 'ambiguous' if reasons else 'identified'
    return Verdict(status, confidence, sets, reasons)


def _none(evidence: Evidence) -> Verdict:
    """Return that there is no gap, with less belief where only the rest shows the noise."""
    if not evidence.independent and evidence.after > ABOVE * evidence.floor:
        return Verdict(
            'none',
            0.6,
            (),
            (
                'nothing is found, but what remains is not spread as noise is, and nothing on these '
                'recordings shows the noise by itself: repeat some poses',
            ),
        )
    return Verdict('none', CALIBRATION, (), ('the gap does not rise above the noise',))


def _doubt(evidence: Evidence) -> str | None:
    """Return why the effects found are no plausible explanation, however well they fit."""
    if len(evidence.slots) > 1 and sum(evidence.parts) > CANCEL:
        return (
            'the effects that fit best nearly cancel each other: together they imitate a cause '
            'that is not in the library'
        )
    count = sum(_orders(slot[0]) for slot in evidence.slots)
    if count > CROWD:
        return (
            f'{count} separate effects would be needed at once: together they imitate a cause '
            'that is not in the library'
        )
    bent = [joint for joint in evidence.glimpsed if _joints_at_rest(evidence).count(joint) > 1]
    if bent:
        return (
            f'less than a period of ripple was seen over the angle of {" and ".join(bent)}, and '
            'with another effect on that joint it bends to anything that depends on the angle'
        )
    if not evidence.carried:
        return (
            f'what was found leaves {evidence.after / evidence.fitted:.1f} times as much on the '
            'held-out motion as on the recordings fitted: it imitates a cause that is not in the '
            'library'
        )
    return None


def _stacked(sets: tuple[tuple[Site, ...], ...]) -> bool:
    """Return whether two effects that show at rest sit on one joint: two may stand for a third."""
    joints = _at_rest(chosen[0] for chosen in sets)
    return len(joints) > len(set(joints))


def _joints_at_rest(evidence: Evidence) -> list[str]:
    return _at_rest(slot[0].site for slot in evidence.slots)


def _at_rest(sites: Iterable[Site]) -> list[str]:
    """Return the joints of the effects that show at rest."""
    return [
        site.joint
        for site in sites
        if site.joint and REGISTRY[site.effect].regime in ('static', 'load')
    ]


def _orders(rival: Rival) -> int:
    """Return how many causes a slot stands for: every further order of a ripple is another."""
    for effect in rival.fit.model.found:
        is_it = (effect.name, effect.site) == (rival.site.effect, rival.site.joint)
        if is_it and isinstance(effect, TransmissionRipple):
            return int(np.size(effect.order))
    return 1


def _touched(site: Site, evidence: Evidence) -> bool:
    """Return whether what remains depends on the joint that an effect sits on."""
    return any(str(site.joint) in name for name in evidence.structure.depends_on)


def _unknown_confidence(left: float) -> float:
    return float(np.clip(0.7 + left, 0.7, 0.95))


def _leaders(slot: tuple[Rival, ...]) -> tuple[Site, ...]:
    """Return the leader alone when it is sure, else all that are worth naming."""
    if slot[0].probability >= SURE:
        return (slot[0].site,)
    return tuple(dict.fromkeys(r.site for r in slot if r.probability >= LISTED))


def _alike(slot: tuple[Rival, ...], chosen: tuple[Site, ...]) -> str:
    names = ', '.join(str(site) for site in chosen)
    return f'{names} move the tool alike on these data: their fits differ by less than the noise'


def _depends(evidence: Evidence) -> str:
    names = evidence.structure.depends_on
    on = ' and '.join(names) if names else 'something not looked at'
    return f'what remains depends on {on}, and no effect in the library explains it'
