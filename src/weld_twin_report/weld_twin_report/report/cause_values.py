# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How far off a cause is: its parameters in degrees or mm first, or its curve at its furthest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.diagnosis.result import Cause, Diagnosis
from weld_twin_core.effects.effect import Effect
from weld_twin_core.effects.frame_curve import FrameCurve
from weld_twin_core.effects.servo_lag import ServoLag
from weld_twin_nodes.wording.quantities import DEGREES, in_short, millimetres, short_rows, turned
from weld_twin_nodes.wording.words import CURVES, parameter_word

from .curve_plot import furthest, furthest_frame, furthest_off

_SHARES = ('scale', 'ratio', 'difference')
"""Parameters of joints that are a share of an angle."""
_QUARTER = 90.0
"""Degrees that such a share is told of."""


def values(diagnosis: Diagnosis, cause: Cause, effects: Sequence[Effect]) -> list[str]:
    """Return how far off the effects of a cause are, the most telling first."""
    errors = {(f.effect.name, f.effect.site): f.std for f in diagnosis.effects}
    curve, rows = furthest_off(diagnosis, cause), []
    if curve is not None:
        rows.append(f'off by {furthest(curve[1])}')
    for effect in effects:
        if isinstance(effect, FrameCurve):
            rows.append(f'moves by {furthest_frame(effect)}')
        if effect.name in CURVES:
            continue
        if isinstance(effect, ServoLag):
            rows.append(_trail(diagnosis, effect))
        rows += _in_a_quarter(effect, diagnosis.model.robot)
        for name, value in short_rows(
            effect, errors.get((effect.name, effect.site), {}), diagnosis.model.robot
        ):
            rows.append(f'{parameter_word(name)} {value}')
    return rows


def _in_a_quarter(effect: Effect, robot: Robot) -> list[str]:
    """Return what an error that grows with the angle makes of a quarter turn, or of a metre."""
    share = next((getattr(effect, n) for n in _SHARES if hasattr(effect, n)), None)
    if share is None or effect.of != 'joint':
        return []
    if effect.on_slide(robot):
        return [f'off by {in_short(1e3 * float(share), None, 1.0, "mm")} in every metre']
    return [f'off by {in_short(_QUARTER * float(share), None, 1.0, "°")} in every 90°']


def _trail(diagnosis: Diagnosis, lag: ServoLag) -> str:
    """Return how far a joint trails its command where the recordings move it fastest."""
    robot = diagnosis.model.robot
    i = robot.index(lag.joint)
    speeds = [np.abs(r.joints.velocity[:, i]).max() for r in diagnosis.recordings]
    fastest = float(max(speeds, default=0.0))
    trail = fastest * float(lag.time_constant)
    if robot.prismatic[i]:
        return (
            f'{lag.joint} trails by {millimetres(trail)} at its fastest ({1e3 * fastest:.0f} mm/s)'
        )
    return f'{lag.joint} trails by {turned(trail)} at its fastest ({DEGREES * fastest:.0f} °/s)'
