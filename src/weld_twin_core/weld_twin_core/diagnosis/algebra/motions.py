# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What motions can show: those recorded, of joints that hardly move; and what none can, whatever it is.

Of a joint at rest a constant shows. What no motion tells apart follows from the arm itself, in
postures all over its range: the offset of the first link lifts the tool exactly as a higher base does.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from ...arm.robot import Robot
from ...arrays import Array
from ...effects.effect import Effect
from ...effects.hooks import highest_order, highest_order_alone
from ...effects.registry import REGISTRY
from ...effects.view import View
from ...recording import JointMotion, Recording
from ...twin.features import Features, joints_of
from ...twin.twin import Twin
from ..negligible import EMPTY, SLIGHT
from .definite import outside, share_outside, span_of
from .problem import LEVER, Site

STILL = 0.04
"""Travel [rad] below which a joint stands still: a `SCALE` error moves by 0.04 mrad over it."""
STILL_SLIDE = 2e-3
"""The same for a joint that slides, [m]."""
SCALE = 1e-3
"""Error of a scale that is taken for large; so much of `STILL` is what a load has to move, too."""
WIDE = 0.5
"""Travel [rad, m], or half of all that there is, from which on a joint shows well how something
depends on its angle."""
REASON = 'the joint hardly moves'
POSTURES = 40
"""Postures drawn over the joints' ranges; some ten would do for the 24 constants of six axes."""
SEED = 1
"""Of the postures: any generic set gives the same answer."""


def hardly_moves(features: Sequence[Features], effect: Effect) -> bool:
    """
    Return whether a joint that an effect needs in motion is at rest, and its load with it.

    A joint at rest bears another load wherever others move its links, and gives way as that changes.
    """
    if effect.search.moved_by is None:
        return False
    robot = features[0].twin.robot
    i = robot.index(effect.search.moved_by)
    least = STILL_SLIDE if robot.prismatic[i] else STILL
    if max(m.reach[1][i] for m in features) - min(m.reach[0][i] for m in features) >= least:
        return False
    if effect.on != 'load':
        return True
    by_load = np.concatenate([maker.shifts(effect)[0]['q', i] for maker in features])
    return bool(np.ptp(by_load) * effect.fit.coordinate_scales()[0] < SCALE * least)


def lacking(features: Sequence[Features], kind: type[Effect], joint: str | None) -> str | None:
    """
    Return why neither a recording nor all together show a kind on a joint; None where one does.

    A torch held alike along each of two seams may be held otherwise along the other.
    """
    reasons = [kind.applicable(maker.view, joint) for maker in features]
    if None in reasons or len(reasons) == 1:
        return None if None in reasons else reasons[0]
    return kind.applicable(together(features), joint)


def together(features: Sequence[Features]) -> View:
    """Return the samples of all recordings as those of one; when each was taken means nothing."""
    views = [maker.view for maker in features]

    def joined(name: str) -> Array | None:
        each = [getattr(view, name) for view in views]
        return None if any(value is None for value in each) else np.concatenate(each)

    named: dict[str, Any] = {
        name: joined(name) for name in ('q', 'qd', 'wrench', 'temperature', 'effort')
    }
    count = np.arange(float(sum(view.t.size for view in views)))
    static = all(view.static for view in views)
    loads = {at: np.concatenate([v.shift[at] for v in views]) for at in views[0].shift}
    return replace(
        views[0], t=count, elapsed=count, later=0.0, static=static, shift=loads, **named
    )


def narrow(recordings: Sequence[Recording], robot: Robot) -> tuple[str, ...]:
    """Return the joints that do not move widely, all recordings together."""
    ends = [(r.joints.q.min(axis=0), r.joints.q.max(axis=0)) for r in recordings]
    travel = np.max([high for _, high in ends], axis=0) - np.min([low for low, _ in ends], axis=0)
    wide = np.minimum(WIDE, (robot.upper - robot.lower) / 2.0)
    return tuple(np.array(robot.joint_names)[travel < wide].tolist())


def separable_orders(features: Sequence[Features], joint: str) -> int:
    """Return the highest order of a wave in a joint's angle that all recordings together can tell."""
    return int(highest_order(_positions(features, joint)))


def order_alone(features: Sequence[Features], joint: str) -> int:
    """Return the highest order of a wave that they can tell where it is the only one."""
    return int(highest_order_alone(_positions(features, joint)))


def _positions(features: Sequence[Features], joint: str) -> Array:
    i = features[0].twin.robot.index(joint)
    return np.concatenate([maker.view.joint(i) for maker in features])


def moved_most(features: Sequence[Features], joint: str | None) -> int:
    """
    Return which recording moves a joint farthest on its whole way, or all joints together.

    An effect of many shapes is looked for there: where the joint stands still it shows none. Between
    stations nothing is seen: beside a motion hardly any of the way to each counts.
    """
    if len(features) == 1:
        return 0
    joints = features[0].twin.robot.joint_names
    chosen = slice(None) if joint is None else [joints.index(joint)]
    static = [maker.recording.joints.static for maker in features]
    most = np.inf if all(static) else STILL
    ways = []
    for maker, at_rest in zip(features, static, strict=True):
        steps = np.abs(np.diff(maker.recording.joints.q[:, chosen], axis=0))
        ways.append((np.minimum(steps, most) if at_rest else steps).sum())
    return int(np.argmax(ways))


def plain_causes(robot: Robot, view: View, on: Collection[str]) -> list[Effect]:
    """Return causes of no size in joints and links that depend on some quantities alone ('load')."""
    out: dict[tuple[str, ...], Effect] = {}
    for kind in REGISTRY.values():
        if kind.of not in ('joint', 'link') or not kind.traits.cause or kind.traits.dated:
            continue
        for joint in joints_of(kind, robot):
            if kind.applicable(view, joint) is None:
                out |= {e.key: e for e in kind.search.small(view, joint, 1) if e.on in on}
    return list(out.values())


def candidate_kinds(align: frozenset[str]) -> list[type[Effect]]:
    kinds = [
        kind
        for kind in REGISTRY.values()
        if kind.traits.cause and not kind.traits.dated and kind.traits.fitted_with not in align
    ]
    return sorted(kinds, key=lambda kind: (kind.stage, kind.name))


def constant(kind: type[Effect]) -> bool:
    return kind.traits.cause and kind.traits.depends_on == 'constant'


def of_no_size(site: Site) -> Effect:
    return REGISTRY[site.effect](**({'joint': site.joint} if site.joint is not None else {}))


def same_error(
    robot: Robot,
    one: Effect,
    other: Effect,
    align: frozenset[str] = frozenset(),
    *,
    both: bool = False,
) -> bool:
    """Return whether one of two constant errors, or each, can always do the other, frames aside."""
    a, b = columns(robot, one), columns(robot, other)
    if align:
        span = _frames(robot, align)
        if min(share_outside(rows, span).min() for rows in (a, b)) < SLIGHT:
            return False  # A frame is what they are.
        a, b = (outside(rows, span) for rows in (a, b))
    within = (
        rows.any(axis=1).all() and (share_outside(rows, span_of(others)) < SLIGHT).all()
        for rows, others in ((a, b), (b, a))
    )
    return bool(all(within) if both else any(within))


def never_parted(
    robot: Robot, align: frozenset[str], sets: Sequence[Sequence[Site]]
) -> tuple[tuple[Site, ...], ...]:
    """Return which sites of each set are one error on any motion, what a person can set first."""
    out = []
    for group in sets:
        known = [site for site in group if site.effect in REGISTRY]
        remaining = [site for site in known if constant(REGISTRY[site.effect])]
        remaining.sort(key=lambda site: not REGISTRY[site.effect].traits.set_at_controller)
        while len(remaining) > 1:
            first = of_no_size(remaining[0])
            others = ((s, of_no_size(s)) for s in remaining[1:])
            same = [s for s, own in others if same_error(robot, first, own, align, both=True)]
            same = [remaining[0], *same]
            remaining = [site for site in remaining if site not in same]
            if len(same) > 1:
                out.append(tuple(same))
    return tuple(out)


@lru_cache(maxsize=4)
def set_instead(robot: Robot, align: frozenset[str], exclude: frozenset[str]) -> frozenset[Site]:
    """
    Return the constant errors that are what a person can set, on any motion, and cannot be set.

    The tilt of an axis may be the zero of its joint whatever the motion: no measurement can decide,
    mending one mends both, and the zero is what a controller takes. Nothing is set by what is
    excluded.
    """
    span = _frames(robot, align)
    singles = [e for e in _constants(robot) if e.fit.coordinates().size == 1]
    singles = [e for e in singles if e.traits.set_at_controller <= (e.name not in exclude)]
    rows = np.concatenate([np.zeros((0, span.shape[1])), *(columns(robot, e) for e in singles)])
    shown = share_outside(rows, span) > SLIGHT
    rows = outside(rows, span)
    unit = rows / np.maximum(np.linalg.norm(rows, axis=1), EMPTY)[:, None]
    same = np.outer(shown, shown) & (np.abs(unit @ unit.T) > 1.0 - SLIGHT**2)
    can_be_set = np.array([e.traits.set_at_controller for e in singles], dtype=bool)
    found = same[:, can_be_set].any(axis=1) & ~can_be_set
    return frozenset(Site.of(singles[k]) for k in np.flatnonzero(found))


def _constants(robot: Robot) -> Iterator[Effect]:
    for name, kind in REGISTRY.items():
        if constant(kind):
            for joint in joints_of(kind, robot):
                if kind.applicable(anywhere(robot).view, joint) is None:
                    yield of_no_size(Site(name, joint))


def columns(robot: Robot, effect: Effect) -> Array:
    return _levered(anywhere(robot).columns(effect))


def _frames(robot: Robot, align: frozenset[str]) -> Array:
    maker, rows = anywhere(robot), [np.zeros((0, 6 * POSTURES))]
    for name in sorted(align):
        rows.append(_levered(np.stack([maker.column((name, k)) for k in range(6)])))
    return span_of(np.concatenate(rows))


@lru_cache(maxsize=2)
def anywhere(robot: Robot) -> Features:
    """Return the twin in postures all over its range."""
    low = np.maximum(robot.lower, -np.pi)
    high = np.minimum(robot.upper, np.pi)
    q = low + (high - low) * np.random.default_rng(SEED).random((POSTURES, robot.n))
    motion = JointMotion(np.arange(float(POSTURES)), q, static=True)
    return Features(Twin(robot), Recording('postures', motion), motion.t)


def _levered(columns: Array) -> Array:
    out = np.array(columns)
    out[:, 3:] *= LEVER
    return out.reshape(out.shape[0], -1)
