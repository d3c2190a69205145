# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What every arm has a little of: constant errors of joints and links, and springs."""

from __future__ import annotations

from collections.abc import Collection

from ...arm.robot import Robot
from ...effects import REGISTRY, Effect
from ...effects.view import View
from ...twin.features import joints_of


def plain_causes(robot: Robot, view: View, on: Collection[str]) -> list[Effect]:
    """
    Return causes in joints and links that depend on nothing but some quantities, at zero.

    Parameters
    ----------
    robot : Robot
    view : View
        The samples that reach them.
    on : collection of str
        What they may depend on: 'constant', 'load'.

    """
    out: dict[tuple[str, ...], Effect] = {}
    for kind in REGISTRY.values():
        if kind.of not in ('joint', 'link') or not kind.cause or kind.dated:
            continue
        for joint in joints_of(kind, robot.joint_names):
            if kind.applicable(view, joint) is None:
                out |= {e.key: e for e in kind.small(view, joint, 1) if e.on in on}
    return list(out.values())
