# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The answer where data or set-up are wrong: what is wrong, and nothing about causes."""

from __future__ import annotations

from math import nan

from ..algebra.problem import Model
from ..result import Diagnosis, Gap, Shrink, Traces, Unexplained, Where
from ..soundness.gate import Examined


def refusal(examined: Examined) -> Diagnosis:
    """
    Return the diagnosis that there is none: status 'unsound', every figure not a number.

    Parameters
    ----------
    examined : Examined
        With the mistakes found.

    """
    robot = examined.given.robot
    return Diagnosis(
        gap=Gap(nan, nan, nan, None, 0, nan),
        where=Where((), {}, (), {}, (), ()),
        status='unsound',
        effects=(),
        confidence=nan,
        indistinguishable=(),
        reasons=tuple(item.sentence for item in examined.unsound),
        candidates=(),
        shrink=Shrink(nan, nan, nan, (nan, nan), ''),
        unexplained=Unexplained(nan, above_noise=False),
        next_experiment=None,
        actions=tuple(f'{item.remedy}.' for item in examined.unsound),
        checks=examined.checks,
        model=Model(robot, (robot.T_world_base,)),
        traces=Traces((), (), (), ()),
        recordings=examined.given.recordings,
        unsound=examined.unsound,
    )
