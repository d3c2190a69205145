# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Always 'unknown', and the nominal arm: the scale of saying nothing."""

from __future__ import annotations

from weld_twin_core.arm.chain import forward

from ..open_form import Answer, Case


def answer(case: Case) -> Answer:
    """Return that the cause is unknown."""
    q, _ = case.ask.joints.at(case.times)
    return Answer(forward(case.robot, q)[:, :3, 3], unknown=1.0)
