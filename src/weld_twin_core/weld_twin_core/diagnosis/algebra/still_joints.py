# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How far joints move and what that can show: of one at rest a constant; and what joints may have."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from ...arm.robot import Robot
from ...effects.effect import Effect
from ...effects.hooks import highest_order
from ...effects.registry import REGISTRY
from ...effects.view import View
from ...recording import Recording
from ...twin.features import Features, joints_of

STILL = 0.04
"""Travel [rad] below which a joint stands still: a scale of 0.1 % moves by 0.04 mrad over it."""
STILL_SLIDE = 2e-3
"""The same for a joint that slides, [m]."""
WIDE = 0.5
"""Travel [rad, m] from which on a joint shows well how something depends on its angle."""
MOST_OF_IT = 0.5
"""Share of what a joint can travel at all that is wide where that is less."""
REASON = 'the joint hardly moves'


def hardly_moves(features: list[Features], effect: Effect) -> bool:
    """Return whether an effect sits on a joint, or has a source, that hardly moves."""
    if effect.search.moved_by is None:
        return False
    robot = features[0].twin.robot
    i = robot.index(effect.search.moved_by)
    travel = max(m.reach[1][i] for m in features) - min(m.reach[0][i] for m in features)
    return bool(travel < (STILL_SLIDE if robot.prismatic[i] else STILL))


def narrow(recordings: Sequence[Recording], robot: Robot) -> tuple[str, ...]:
    """Return the joints that do not move widely, all recordings together."""
    ends = [(r.joints.q.min(axis=0), r.joints.q.max(axis=0)) for r in recordings]
    travel = np.max([high for _, high in ends], axis=0) - np.min([low for low, _ in ends], axis=0)
    wide = np.minimum(WIDE, MOST_OF_IT * (robot.upper - robot.lower))
    return tuple(np.array(robot.joint_names)[travel < wide].tolist())


def separable_orders(features: Sequence[Features], joint: str) -> int:
    """Return the highest order of a wave in a joint's angle that all recordings together can tell."""
    i = features[0].twin.robot.index(joint)
    return int(highest_order(np.concatenate([maker.view.joint(i) for maker in features])))


def moved_most(features: Sequence[Features], joint: str | None) -> int:
    """
    Return which recording moves a joint farthest on its whole way, or all joints together.

    Where an effect of many shapes may be is looked for there: a recording in which the joint stands
    still shows none of them. Between stations nothing is seen: beside a motion hardly any of the way
    to each counts, or a dozen would seem to show more of a joint than a path does.

    features: one for each recording.
    joint: none for all joints.
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
    """
    Return causes in joints and links that depend on nothing but some quantities, at zero.

    view: the samples that reach them.
    on: what they may depend on: 'constant', 'load'.
    """
    out: dict[tuple[str, ...], Effect] = {}
    for kind in REGISTRY.values():
        if kind.of not in ('joint', 'link') or not kind.traits.cause or kind.traits.dated:
            continue
        for joint in joints_of(kind, robot):
            if kind.applicable(view, joint) is None:
                out |= {e.key: e for e in kind.search.small(view, joint, 1) if e.on in on}
    return list(out.values())


def candidate_kinds(align: frozenset[str]) -> list[type[Effect]]:
    """Return the kinds of effect that may be a cause, in the order of their stages."""
    kinds = [
        kind
        for kind in REGISTRY.values()
        if kind.traits.cause and not kind.traits.dated and kind.traits.fitted_with not in align
    ]
    return sorted(kinds, key=lambda kind: (kind.stage, kind.name))
