# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What to do next: mend what was found, or measure what would decide."""

from collections.abc import Collection, Sequence

from ...arm.robot import Robot
from ...effects.effect import Effect
from ...effects.wording import TURNED_ROUND
from .experiment import next_experiment
from .postures import Limits

__all__ = ['Limits', 'actions', 'next_experiment']


def actions(
    result: Sequence[Effect], robot: Robot, turned: Collection[str | None] = ()
) -> tuple[str, ...]:
    """Return what to do about every effect by the nominal model, and how to read a ``turned`` joint."""
    counted = [each.traits.set_at_controller and each.site in turned for each in result]
    return tuple(
        f'{each.remedy(robot)} {TURNED_ROUND}' if other else each.remedy(robot)
        for each, other in zip(result, counted, strict=True)
    )
