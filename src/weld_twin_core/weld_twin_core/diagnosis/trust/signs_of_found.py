# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Signs of every effect found, as plain numbers: does its formula hold, and does its name come back?

A formula that stands in for another wants other parameters on every stretch, and is beaten by
another on a motion that was not fitted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...arm.robot import Robot
from ...arrays import Array
from ...effects.effect import Effect
from ...recording import Recording
from ..algebra.problem import Problem
from ..hypotheses.rivals import Rival
from ..hypotheses.search import Search
from ..result import CameBack, Site
from ..unseen.held_out_shrink import left_on
from ..unseen.regions import posture_regions
from ..unseen.unseen_stretches import Unseen
from ..verdict.decision import Verdict
from ..verdict.evidence import Evidence
from .numbers import FAR, Numbers, log, log1, plain, rms

FEWEST_STATES = 4
"""Joint states from which a recording tells how fast and how often a joint turns."""
MOVING = 2e-3
"""Speed [rad/s or m/s] below which noise makes the direction."""
WORST = {
    'own_back': min,
    'own_margin': min,
    'own_apart': min,
    'own_leader': min,
    'own_nats': min,
    'own_elsewhere': min,
    'own_wander': max,
    'own_wander_place': max,
}
"""Signs of which the whole answer has the worst among all effects found."""


def signs_of_found(
    found: Search,
    unseen: Unseen,
    evidence: Evidence,
    verdict: Verdict,
    came_back: Sequence[CameBack | None],
    holdout: Sequence[Recording],
) -> tuple[Numbers, ...]:
    """
    Return the signs of every effect found one by one, in the order of the model.

    Parameters
    ----------
    found : Search
    unseen : Unseen
        Of its final model.
    evidence : Evidence
    verdict : Verdict
    came_back : sequence of CameBack or None
        How often each came back on halves; None where too few can tell.
    holdout : sequence of Recording

    """
    if found.dense or not found.slots:
        return ()
    chosen = {site for group in verdict.sets for site in group}
    wandered, elsewhere = unseen.wandered(), _of_places(unseen)
    out = []
    for k, (effect, slot, back) in enumerate(
        zip(found.final.model.found, found.slots, came_back, strict=False)
    ):
        own = {
            **_of_slot(slot, chosen),
            **_of_joint(effect, found.problem, found.final.model.robot),
            **_held_out(found, evidence, slot, chosen, holdout),
            'own_size': _size(effect),
            'own_wander': log(wandered[k]),
            'own_wander_place': log(elsewhere[k]),
        }
        if back is not None:
            own['own_back'] = back.share
        out.append(plain(own))
    return tuple(out)


def _of_places(unseen: Unseen) -> Array:
    return unseen.by(posture_regions(unseen.problem)).wandered()


def worst_of(each: Sequence[Mapping[str, float]]) -> Numbers:
    """
    Return what the effects found say of the whole answer: the worst of each.

    Parameters
    ----------
    each : sequence of mappings
        As `signs_of_found` gives them.

    """
    out = {}
    for name, worst in WORST.items():
        values = [signs[name] for signs in each if name in signs]
        if values:
            out[name] = worst(values)
    return out


def _of_slot(slot: Sequence[Rival], chosen: set[Site]) -> Numbers:
    """Return how far an effect stands from what could take its place, outside its set."""
    inside = [r for r in slot if r.site in chosen] or [slot[0]]
    outside = [r for r in slot if r not in inside]
    lead = slot[0]
    return {
        'own_leader': lead.probability,
        'own_mass': sum(r.probability for r in inside),
        'own_nats': log1(lead.nats),
        'own_margin': log1(min((lead.nats - r.nats for r in outside), default=FAR)),
        'own_apart': log(
            min((rms(lead.fit.residual - r.fit.residual) for r in outside), default=FAR)
        ),
        'own_rivals': len(outside),
        'own_rivals_here': sum(r.site.joint == lead.site.joint for r in outside),
    }


def _of_joint(effect: Effect, problem: Problem, robot: Robot) -> Numbers:
    """Return how a joint was moved: what a formula that depends on motion is told from."""
    streams = [r.joints for r in problem.recordings if r.joints.t.size >= FEWEST_STATES]
    if effect.site is None or not streams:
        return {}
    i = robot.joint_names.index(effect.site)
    speeds = [np.abs(np.gradient(own.q[:, i], own.t)) for own in streams]
    turns = 0.0
    for own, speed in zip(streams, speeds, strict=True):
        way = np.sign(np.diff(own.q[:, i]))[speed[1:] > MOVING]
        turns += float((way[1:] * way[:-1] < 0.0).sum())
    speed = np.concatenate(speeds)
    return {
        'own_travel': log(float(np.ptp(np.concatenate([own.q[:, i] for own in streams])))),
        'own_turns': log1(turns),
        'own_speed': log(float(speed.max())),
        'own_still': float((speed <= MOVING).mean()),
    }


def _size(effect: Effect) -> float:
    """Return how large an effect is in typical sizes of its kind, as a decimal logarithm."""
    sizes = np.abs(effect.coordinates()) / np.maximum(effect.coordinate_scales(), 1e-300)
    return log(float(sizes.max(initial=0.0)))


def _held_out(
    found: Search,
    evidence: Evidence,
    slot: Sequence[Rival],
    chosen: set[Site],
    holdout: Sequence[Recording],
) -> Numbers:
    """Return by how much the next rival leaves more on held-out recordings, in parts of noise."""
    outside = [r for r in slot[1:] if r.site not in chosen]
    if not holdout or not outside:
        return {}
    rival = max(outside, key=lambda r: r.probability)
    left = left_on(replace(found, final=rival.fit), holdout, found.work.beliefs)
    return {'own_elsewhere': log1((left - evidence.after) / max(evidence.floor, 1e-12) * 100.0)}


def residual_signs(unseen: Unseen) -> Numbers:
    """
    Return whether what is left looks like noise: its peaks, and how alike neighbours are.

    Parameters
    ----------
    unseen : Unseen
        Of the final model.

    """
    parts: list[Array] = [part[:, :3] for part in unseen.problem.by_sample(unseen.targets[0])]
    square = np.concatenate([(part**2).sum(axis=1) for part in parts])
    near = sum(float((part[1:] * part[:-1]).sum()) for part in parts)
    whole = max(float(square.sum()), 1e-300)
    return {
        'left_peaks': log(float((square**2).mean() / max(float(square.mean()) ** 2, 1e-300))),
        'left_alike': near / whole,
    }
