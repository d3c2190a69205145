# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What to mend: one sentence for every effect found; the effect says it itself."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from ...arm.robot import Robot
from ...effects.effect import Effect
from ...effects.wording import TURNED_ROUND
from ..soundness.mending import turned_joints


def actions(
    result: Sequence[Effect], robot: Robot, mends: Sequence[Mapping[str, Any]] = ()
) -> tuple[str, ...]:
    """
    Return what to do about every effect found, one sentence each, in their order.

    By the nominal model, which is entered in the controller now, and what was undone of the data.
    """
    turned = turned_joints(mends, robot)
    return tuple(_action(effect, robot, turned) for effect in result)


def _action(effect: Effect, robot: Robot, turned: Collection[str]) -> str:
    """Return its remedy, and how to read it where the joint was recorded with the other sign."""
    counted = effect.traits.set_at_controller and effect.site in turned
    return f'{effect.remedy(robot)} {TURNED_ROUND}' if counted else effect.remedy(robot)
