# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which ripples were seen over so little of a turn that any smooth curve would look the same."""

from __future__ import annotations

import numpy as np

from ...effects.transmission_ripple import TransmissionRipple
from ..algebra.problem import Model, Problem

PERIOD = 0.8
"""Periods of its highest order that a joint must pass through for a ripple to be told as one."""


def glimpsed(problem: Problem, model: Model) -> tuple[str, ...]:
    """Return the joints whose ripple was seen over less than a period."""
    names = model.robot.joint_names
    out = []
    for effect in model.found:
        if isinstance(effect, TransmissionRipple):
            i = names.index(str(effect.site))
            q = [recording.joints.q[:, i] for recording in problem.recordings]
            span = max(float(x.max()) for x in q) - min(float(x.min()) for x in q)
            if np.max(effect.order) * span < PERIOD * 2.0 * np.pi:
                out.append(str(effect.site))
    return tuple(out)
