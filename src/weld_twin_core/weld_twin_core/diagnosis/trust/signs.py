# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Signs of how far an answer can be trusted, as plain numbers.

They are more than any model of belief uses: a table of them, made once, lets other models be
fitted without a new diagnosis. Nothing here says which families were taken out of the library:
how often that is done is no property of a cell.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ..algebra.problem import Problem
from ..hypotheses.rivals import Rival
from ..hypotheses.search import Search
from ..hypotheses.still_joints import WIDE
from ..levels.curved import Curved, gain_of
from ..result import Cause, Check, Site
from ..unseen.unseen_stretches import Unseen
from ..verdict.decision import Verdict
from ..verdict.evidence import Evidence
from ..verdict.weighing import Weighed
from .numbers import FAR, Numbers, log, log1, plain, rms
from .signs_of_found import residual_signs, worst_of

MOVES = 0.02
"""Travel [rad, m] from which on a joint shows something at all."""
CURVES = (
    'curves',
    'curve_gain',
    'curve_sure',
    'curve_left',
    'curve_kept',
    'curve_place',
    'form_gain',
    'form_sure',
)


@dataclass(frozen=True)
class Signs:
    """
    Signs of an answer as a whole, and of each of its causes.

    Attributes
    ----------
    answer : mapping from str to float
    causes : tuple of mappings
        In the order of the causes.

    """

    answer: Mapping[str, float]
    causes: tuple[Mapping[str, float], ...] = ()


def signs_of_answer(
    found: Search,
    unseen: Unseen,
    evidence: Evidence,
    verdict: Verdict,
    rival: Curved | None,
    checks: Sequence[Check],
    each: Sequence[Mapping[str, float]] = (),
) -> Numbers:
    """
    Return the signs of an answer.

    Parameters
    ----------
    found : Search
        The effects found, before curves take their place.
    unseen : Unseen
        Of its final model.
    evidence : Evidence
    verdict : Verdict
    rival : Curved or None
        The free-form explanation.
    checks : sequence of Check
        Of data and set-up.
    each : sequence of mappings
        Signs of every effect found.

    """
    case = Weighed(evidence, found.work.beliefs)
    return plain(
        {
            **_of_gap(case),
            **_of_names(found, unseen, evidence, verdict),
            **_of_rivals(evidence, verdict),
            **_of_curves(unseen, rival, evidence.floor),
            **_of_data(found.problem),
            **families_in('named_', 'alone_', verdict.sets),
            **residual_signs(unseen),
            **worst_of(each),
            'rows': log(found.effective(found.small)),
            'notes': sum(check.level == 'note' for check in checks),
            'warnings': sum(check.level == 'warning' for check in checks),
        }
    )


def signs_of_cause(
    cause: Cause,
    rank: int,
    count: int,
    gap: float,
    floor: float,
    rival: Curved | None,
    own: Mapping[str, float] | None = None,
) -> Numbers:
    """
    Return the signs of one cause, before anything learned is applied.

    Parameters
    ----------
    cause : Cause
    rank, count : int
        Its place among the causes, 0 for the largest share, and how many there are.
    gap, floor : float
        RMS of the gap and of the noise [m].
    rival : Curved or None
    own : mapping from str to float, optional
        Signs of the effect that stands for it.

    """
    seen = rival.form.parts if rival is not None else ()
    at = {part.group.at for part in seen}
    on = {part.group.on for part in seen}
    size = np.sqrt(max(cause.share, 0.0)) * gap / max(floor, 1e-12)
    return plain(
        {
            'cause_rank': rank,
            'cause_count': count,
            'cause_share': cause.share,
            'cause_spread': cause.share_ci90[1] - cause.share_ci90[0],
            'cause_size': log(size),
            **_levels('place', [p for _, p in cause.place]),
            **_levels('dependence', [p for _, p in cause.dependence]),
            **_levels('name', [p for _, p in cause.name]),
            'curve_at_place': float(bool(cause.place) and cause.place[0][0] in at),
            'curve_on_dependence': float(bool(cause.dependence) and cause.dependence[0][0] in on),
            'one_joint': float(bool(cause.name) and cause.name[0][0].joint is not None),
            **families_in('cause_is_', 'cause_only_', [[site for site, _ in cause.name]]),
            **(own or {}),
        }
    )


def families_in(any_of: str, only: str, sets: Iterable[Sequence[Site]]) -> Numbers:
    """
    Return which families are named, and which of them alone: some stand in for others often.

    Parameters
    ----------
    any_of, only : str
        What the signs begin with, for a family that is in a set and for one that is the whole set.
    sets : iterable of sequences of Site

    """
    out = {}
    for group in sets:
        out.update({any_of + site.effect: 1.0 for site in group})
        if len(group) == 1:
            out[only + group[0].effect] = 1.0
    return out


def _levels(level: str, listed: Sequence[float]) -> Numbers:
    first, second, *_ = (*listed, 0.0, 0.0)
    return {level: first, f'{level}_second': second, f'{level}_listed': len(listed)}


def _of_gap(case: Weighed) -> Numbers:
    told, left = case.evidence, case.evidence.structure
    return {
        'gap': log(told.gap / max(told.floor, 1e-12)),
        'after': log(told.after / max(told.floor, 1e-12)),
        'elsewhere': log(told.after / max(told.fitted, 1e-12)),
        'left': case.left,
        'complete': case.complete,
        'rise': case.rise,
        'share': case.share,
        'carries': float(case.carries),
        'structured': float(case.structured),
        'high': float(case.high),
        'structure_gain': left.gain,
        'structure_sure': left.sure,
        'independent': float(told.independent),
        'refused': len(told.refused) + len(told.lacking),
        'glimpsed': len(told.glimpsed),
        'cancel': log(sum(told.parts)) if told.parts else 0.0,
    }


def _of_names(found: Search, unseen: Unseen, evidence: Evidence, verdict: Verdict) -> Numbers:
    model = found.final.model.found
    sizes = [unseen.rms(target) / max(evidence.floor, 1e-12) for target in unseen.targets[1:]]
    coordinates = [effect.coordinates().size for effect in model]
    return {
        'belief': verdict.confidence,
        'partly': float(verdict.status == 'unknown' and bool(verdict.sets) and not found.dense),
        'slots': len(evidence.slots),
        'found': len(model),
        'separate': sum(evidence.causes),
        'sets': len(verdict.sets),
        'breadth': max((len(group) for group in verdict.sets), default=0),
        'ambiguous': sum(len(group) > 1 for group in verdict.sets),
        'families': len(evidence.families or ()),
        'weakest': log(min(sizes, default=0.0)),
        'strongest': log(max(sizes, default=0.0)),
        'alike': _alike(unseen.targets[1:]) if len(model) <= len(evidence.slots) else 0.0,
        'coordinates': sum(coordinates),
        'most_coordinates': max(coordinates, default=0),
        'constants': sum(effect.on == 'constant' for effect in model),
        'angles': sum(effect.on == 'angle' for effect in model),
        'joints_shared': len(model) - len({effect.at for effect in model}),
    }


def _of_rivals(evidence: Evidence, verdict: Verdict) -> Numbers:
    """Return how far the sets named stand from what could take their place."""
    chosen = {site for group in verdict.sets for site in group}
    margins, apart, leaders, masses, nats = [], [], [], [], []
    for slot in evidence.slots:
        inside, outside = _parted(slot, chosen)
        leaders.append(slot[0].probability)
        masses.append(sum(r.probability for r in inside))
        nats.append(slot[0].nats)
        margins += [slot[0].nats - r.nats for r in outside]
        apart += [rms(slot[0].fit.residual - r.fit.residual) for r in outside]
    return {
        'leader': min(leaders, default=0.0),
        'mass': float(np.prod(masses)) if masses else 0.0,
        'nats': log1(min(nats, default=0.0)),
        'margin': log1(min(margins, default=FAR)),
        'apart': log(min(apart, default=FAR)),
        'near': sum(a < 0.1 for a in apart),
        'rivals': len(margins),
    }


def _parted(slot: Sequence[Rival], chosen: set[Site]) -> tuple[list[Rival], list[Rival]]:
    """Return the rivals of a slot inside its set, and the others."""
    inside = [r for r in slot if r.site in chosen] or [slot[0]]
    return inside, [r for r in slot if r not in inside]


def _of_curves(unseen: Unseen, rival: Curved | None, floor: float) -> Numbers:
    """Return how the free-form explanation compares with the names."""
    if rival is None:
        return dict.fromkeys(CURVES, 0.0)
    gain, sure = gain_of(unseen, rival.unseen)
    weights = [max(part.weight_of('at').values()) for part in rival.form.parts]
    return {
        'curves': len(rival.form.parts),
        'curve_gain': gain,
        'curve_sure': sure,
        'curve_left': log(rival.rms_m / max(floor, 1e-12)),
        'curve_kept': len(rival.kept),
        'curve_place': min(weights, default=0.0),
        'form_gain': rival.form.gain,
        'form_sure': rival.form.steady,
    }


def _of_data(problem: Problem) -> Numbers:
    """Return how rich the recordings are."""
    travel = np.max([np.ptp(r.joints.q, axis=0) for r in problem.recordings], axis=0)
    every = problem.recordings
    return {
        'static': float(any(r.joints.static for r in every)),
        'orientation': float(max(problem.rows) > 3),
        'aligned': len(problem.align),
        'recordings': len(every),
        'samples': log(sum(problem.samples)),
        'wrench': float(any(r.wrench is not None for r in every)),
        'temperature': float(any(r.temperature is not None for r in every)),
        'moving': float((travel > MOVES).mean()),
        'wide': float((travel > WIDE).mean()),
        'travel': log(float(np.median(travel))),
        'turns': log1(float(np.median(_turns(problem)))),
    }


def _turns(problem: Problem) -> Array:
    """Return how often each joint turns round, counting moves of its own noise too."""
    out = np.zeros(problem.recordings[0].joints.q.shape[1])
    for recording in problem.recordings:
        steps = np.sign(np.diff(recording.joints.q, axis=0))
        out += (steps[1:] * steps[:-1] < 0.0).sum(axis=0)
    return out


def _alike(parts: Array) -> float:
    """Return the largest absolute correlation between what two effects do to the tool."""
    if len(parts) < 2:
        return 0.0
    size = np.maximum(np.linalg.norm(parts, axis=1, keepdims=True), 1e-300)
    unit = parts / size
    product = np.abs(unit @ unit.T)
    return float(product[~np.eye(len(parts), dtype=bool)].max())
