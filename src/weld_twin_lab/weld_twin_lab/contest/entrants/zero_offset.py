# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Always a joint's zero: the scale of what mastering alone can do."""

from __future__ import annotations

from ..open_form import ContestAnswer, ContestCase
from .geometry import answer_with, fit


def answer(case: ContestCase) -> ContestAnswer:
    """Return the joint whose zero moves the tool most, without a doubt."""
    fitted = fit(case, ('theta',))
    row = int(fitted.effect[: case.robot.n].argmax())
    predicted = answer_with(case, ('theta',)).predicted
    return ContestAnswer(predicted, ((('joint_offset', case.robot.joint_names[row], 1.0),),))
