# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Constant errors that no motion tells apart: they follow from the arm itself.

The offset of the first link lifts the tool exactly as a higher base does. Errors are compared by what
they do to the tool in postures all over the arm's range.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np

from ...arm.robot import Robot
from ...arrays import Array
from ...effects.effect import Effect
from ...effects.registry import REGISTRY
from ...recording import JointMotion, Recording
from ...twin.features import Features, joints_of
from ...twin.twin import Twin
from .definite import EMPTY, outside, share_outside, span_of
from .problem import Site

POSTURES = 40
"""Postures drawn over the joints' ranges; some ten would do for the 24 constants of six axes."""
LEVER = 0.5
"""Metres of tool motion that a radian of turn counts as; it only scales a comparison."""
SAME = 1e-6
"""Share of an error that may lie outside what another one spans; far above rounding."""
SEED = 7
"""Of the postures: any generic set gives the same answer."""


def constant(kind: type[Effect]) -> bool:
    """Return whether a kind is a cause that never changes."""
    return kind.traits.cause and kind.traits.depends_on == 'constant'


def of_no_size(site: Site) -> Effect:
    """Return an effect of no size at a site."""
    return REGISTRY[site.effect](**({'joint': site.joint} if site.joint is not None else {}))


def same_error(
    robot: Robot,
    one: Effect,
    other: Effect,
    align: frozenset[str] = frozenset(),
    *,
    both: bool = False,
) -> bool:
    """
    Return whether one of two constant errors can always do what the other does.

    one, other: their families and joints count, not their values.
    align: frames that are fitted, 'base' and 'tool': what these take up distinguishes nobody.
    both: ask that each can do what the other does.
    """
    a, b = columns(robot, one), columns(robot, other)
    if align:
        span = _frames(robot, align)
        if min(share_outside(rows, span).min() for rows in (a, b)) < SAME:
            return False  # A frame is what they are.
        a, b = (outside(rows, span) for rows in (a, b))
    within = (
        rows.any(axis=1).all() and (share_outside(rows, span_of(others)) < SAME).all()
        for rows, others in ((a, b), (b, a))
    )
    return bool(all(within) if both else any(within))


def never_parted(
    robot: Robot, align: frozenset[str], sets: Sequence[Sequence[Site]]
) -> tuple[tuple[Site, ...], ...]:
    """
    Return which sites are one error on any motion, what a person can set first.

    align: frames that are fitted, 'base' and 'tool'.
    sets: what the data cannot tell apart.
    """
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
    Return the constant errors that are on any motion what a person can set, and are no such themselves.

    The tilt of an axis may be the zero of its joint whatever the motion: no measurement can decide,
    mending one mends both, and the zero is what a controller takes.

    align: frames that are fitted, 'base' and 'tool'.
    exclude: families taken out of the library: nothing is set by them.
    """
    span = _frames(robot, align)
    singles = [e for e in _constants(robot) if e.fit.coordinates().size == 1]
    singles = [e for e in singles if e.traits.set_at_controller <= (e.name not in exclude)]
    rows = np.concatenate([np.zeros((0, span.shape[1])), *(columns(robot, e) for e in singles)])
    shown = share_outside(rows, span) > SAME
    rows = outside(rows, span)
    unit = rows / np.maximum(np.linalg.norm(rows, axis=1), EMPTY)[:, None]
    same = np.outer(shown, shown) & (np.abs(unit @ unit.T) > 1.0 - SAME**2)
    can_be_set = np.array([e.traits.set_at_controller for e in singles], dtype=bool)
    found = same[:, can_be_set].any(axis=1) & ~can_be_set
    return frozenset(Site.of(singles[k]) for k in np.flatnonzero(found))


def _constants(robot: Robot) -> Iterator[Effect]:
    """Yield every error of no size that never changes."""
    for name, kind in REGISTRY.items():
        if constant(kind):
            for joint in joints_of(kind, robot):
                if kind.applicable(anywhere(robot).view, joint) is None:
                    yield of_no_size(Site(name, joint))


def columns(robot: Robot, effect: Effect) -> Array:
    """Return what an error does to the tool in many postures, one row per component."""
    return _levered(anywhere(robot).columns(effect))


def _frames(robot: Robot, align: frozenset[str]) -> Array:
    """Return what spans the motions of frames in many postures, shape (P, rows)."""
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
