# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which waves were seen over so little of a turn that any smooth curve would look the same."""

from __future__ import annotations

import numpy as np

from ..algebra.problem import Model, Problem
from ..beliefs import Beliefs


def glimpsed(problem: Problem, model: Model, beliefs: Beliefs) -> tuple[str, ...]:
    """
    Return the joints of which a wave was seen over too little of a period.

    Parameters
    ----------
    problem : Problem
        The recordings to explain, and the frames that are fitted along.
    model : Model
        What is believed so far; everything is taken about it.
    beliefs : Beliefs
        The numbers that decide.

    """
    names = model.robot.joint_names
    out = []
    for effect in model.found:
        if effect.orders().size:
            i = names.index(str(effect.site))
            q = [recording.joints.q[:, i] for recording in problem.recordings]
            span = max(float(x.max()) for x in q) - min(float(x.min()) for x in q)
            if effect.orders().max() * span < beliefs.periods * 2.0 * np.pi:
                out.append(str(effect.site))
    return tuple(out)
