# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What an arm of this kind may have, whether or not it was found, and how large it may be."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from ...arm.robot import Robot
from ...arrays import Array
from ...effects.effect import Effect
from ...effects.plausible import spreads
from ...effects.registry import REGISTRY
from ...effects.view import Stage
from ...twin.compensation import acts
from ...twin.directions import Directions, Discrepancy
from ...twin.features import joints_of
from ..algebra.fit import FRAME_SHIFT, FRAME_TURN
from .leftover import Rest
from .sizes import GEARS, GEOMETRY, MEASURING

ORDERS = np.arange(1.0, 5.0)
"""Ripple orders [1/rev] that bend a joint's whole range; finer ones are part of what is left over,
for they are as large inside as outside what was recorded."""
SPACING = 0.05
"""Least distance of the knots of a joint's fine curve [rad or m], and distance beyond what was recorded
at which nothing is known of it. Gears of two arms are uneven up to forty times a turn, and what a curve
cannot follow is read as wrong zeros and ratios. Knots at 0.1 foretold five parts of three arms that
were left out 2.5 times as badly, and knots at 0.025 foretold 26 parts no better."""
KNOTS = 32
"""Most spacings of a recorded range on a joint's fine curve; over more a gear's error is no slope."""
FINE = 7e-5
"""Usual height of the fine curve [rad]: of halves of the recordings of four real arms it was learned as
0.3, 0.5, 0.7 and 1.0 times 1e-4, RMS of all joints."""
GIVE = 3e-5
"""Usual give of a joint for its own acceleration [s^2]: on a spring that swings at f it is
1 / (2 pi f)^2, and joints of robots swing at 10 to 50 Hz."""
MOST = 24
"""Coordinates of one ripple effect; more of them are high orders, part of what is left over."""


def directions(
    robot: Robot, result: Sequence[Effect], *, measured: bool = False
) -> tuple[Effect, ...]:
    """
    Return the effects whose coordinates are uncertain, at the values found or at zero.

    measured: whether an instrument saw the tool, which may be off by a little as well. What it is off by
    looks like errors of the arm that no program needs corrected.
    """
    out: list[Effect] = []
    every = (kind for kind in REGISTRY.values() if kind.traits.everywhere)
    for kind in [kind for kind in every if measured or not _of_the_measured(kind)]:
        for joint in joints_of(kind, robot):
            here = [e for e in result if (e.name, e.site) == (kind.name, joint)]
            if kind.traits.waves is None:
                out += here[:1] or [_none_yet(kind, joint)]
            elif joint is not None and not robot.prismatic[robot.index(joint)]:
                wave = reduce(_joined, here, _none_yet(kind, joint))
                out += [wave.search.with_orders(ORDERS), *_finer(wave)]
    for effect in result:
        # All but how one set-up moved goes along to other motions.
        counts = effect.traits.cause or not effect.traits.of_setup
        if effect.traits.waves is None and counts and effect.key not in {e.key for e in out}:
            out.append(effect)
    return tuple(e for e in out if e.fit.coordinates().size)


def _of_the_measured(kind: type[Effect]) -> bool:
    """Return whether a kind moves what is measured and not the tool."""
    return kind.stage == Stage.POSE and not acts(kind)


def _none_yet(kind: type[Effect], joint: str | None) -> Effect:
    return kind() if joint is None else kind(joint)  # type: ignore[call-arg]


def _joined(one: Effect, other: Effect) -> Effect:
    return one.search.joined(other) or other


def _finer(wave: Effect) -> list[Effect]:
    """Return the part of some waves that the orders of every arm do not have."""
    other = wave.search.orders()[~np.isin(wave.search.orders(), ORDERS)]
    return [wave.search.with_orders(other)] if 0 < 2 * other.size <= MOST else []


def middles(effects: Sequence[Effect], result: Sequence[Effect]) -> Array:
    """
    Return where the prior of every coordinate lies, counted from the fitted model, shape (K,).

    Small errors are counted from zero. What bends the twin (a frequency) is counted from the fit,
    and so are the waves of a joint that was fitted with many orders at once: their sizes were
    learned together there, and some of them alone must not be drawn back.
    """
    dense = {(e.name, e.site) for e in result if e.search.orders().size > ORDERS.size}
    out = [np.zeros(0)]
    for effect in effects:
        straight = effect.fit.straight() & ((effect.name, effect.site) not in dense)
        out.append(np.where(straight, -effect.fit.coordinates(), 0.0))
    return np.concatenate(out)


def groups(effects: Sequence[Effect]) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Return the family of every coordinate, (K,), each gear by itself, and whose each is, (G,)."""
    names = [(e.name, None if e.traits.waves is None else e.site) for e in effects]
    whose = {name: _whose(e) for name, e in zip(names, effects, strict=True)}
    distinct = list(whose)
    sizes = [effect.fit.coordinates().size for effect in effects]
    numbers = np.repeat([distinct.index(name) for name in names], sizes).astype(int)
    return numbers, np.array(list(whose.values()), dtype=int)


def _whose(effect: Effect) -> int:
    if effect.traits.waves is not None:
        return GEARS
    return GEOMETRY if acts(effect) else MEASURING


def widths(robot: Robot, what: Directions) -> Array:
    """Return the standard deviation of every coordinate before the data, shape (P,)."""
    frames = np.tile(np.repeat((FRAME_SHIFT, FRAME_TURN), 3), what.frame_count // 6)
    fine = np.full(sum(knots.size for knots in what.knots), FINE)
    own = [sizes(robot, effect) for effect in what.effects]
    return np.concatenate([frames, *own, np.full(what.gives, GIVE), fine])


def sizes(robot: Robot, effect: Effect) -> Array:
    """Return how large the coordinates of an effect are on machines, shape (K,)."""
    size = spreads(robot, effect)
    # What the table knows nothing of is as far from the fit as that is from nothing.
    unknown = np.maximum(np.abs(effect.fit.coordinates()), effect.fit.coordinate_scales())
    return np.where(np.isfinite(size), size, unknown)


def fine_knots(motions: Sequence[Array]) -> tuple[Array, ...]:
    """
    Return knots along every joint's recorded range, one array (K,) for each joint [rad, m].

    They are multiples of `SPACING`, or of it times a power of two, so that recordings of much the
    same range have the same knots and can be compared.
    """
    q = np.concatenate(motions)
    low, high = q.min(axis=0), q.max(axis=0)
    doubled = np.ceil(np.log2(np.maximum(high - low, SPACING) / (SPACING * KNOTS)))
    steps = SPACING * 2.0 ** np.maximum(doubled, 0.0)
    first, last = np.floor(low / steps), np.floor(high / steps) + 1.0
    each = zip(steps, first, last, strict=True)
    return tuple(step * np.arange(a, b + 1.0) for step, a, b in each)


def discrepancy(
    robot: Robot, rest: Rest, fine: Array, jumps: float, result: Sequence[Effect]
) -> Discrepancy:
    """
    Return what no parameter explains, with gears as uneven where they were not seen.

    fine: height of every joint's fine curve, shape (n,).
    jumps: how many the recordings showed.
    result: a curve without a formula among them says nothing beyond its ends, so that the joint
    may be off by as much as that there.
    """
    fine = np.array(fine)
    for effect in result:
        if effect.twin.off_outside() > 0.0:
            joint = robot.index(str(effect.site))
            fine[joint] = max(fine[joint], effect.twin.off_outside())
    turning = np.where(robot.prismatic, 0.0, 1.0)
    return Discrepancy(
        rest.position,
        rest.orientation,
        rest.gears * turning,
        fine * turning,
        SPACING,
        rest.turns,
        rest.peaks,
        jumps,
        rest.swings,
    )
