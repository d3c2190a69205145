# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which ripples were seen over so little of a turn that any smooth curve would look the same."""

from __future__ import annotations

import numpy as np

from ...effects.transmission_ripple import TransmissionRipple
from ..algebra.problem import Model, Problem
from ..beliefs import Beliefs


def glimpsed(problem: Problem, model: Model, beliefs: Beliefs) -> tuple[str, ...]:
    """Return the joints whose ripple was seen over less than a period."""
    names = model.robot.joint_names
    out = []
    for effect in model.found:
        if isinstance(effect, TransmissionRipple):
            i = names.index(str(effect.site))
            q = [recording.joints.q[:, i] for recording in problem.recordings]
            span = max(float(x.max()) for x in q) - min(float(x.min()) for x in q)
            if np.max(effect.order) * span < beliefs.periods * 2.0 * np.pi:
                out.append(str(effect.site))
    return tuple(out)
