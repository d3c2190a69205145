# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Arms that are off by a little everywhere, as every arm is."""

from __future__ import annotations

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.diagnosis.predicting import plausible_arm

from .cause_sizes import RIPPLE_ORDERS, Cause, scaled

FREEDOM = 3.0
"""Of Student's t, after which sizes are drawn: some errors of an arm are several times as large as
the others."""
EXACT = frozenset({'gear_ratio'})
"""Not everywhere: tooth numbers are exact."""
RIPPLE = 2e-4
"""Usual amplitude of one order of a gear's ripple [rad], as `cause_sizes` has it."""
LOW_ORDERS = (1, 2)
"""Of the ripple that every gear has, beside one that is drawn."""


def small_errors(robot: Robot, rng: np.random.Generator, part: float = 1.0) -> list[Cause]:
    """Return every small error that arms of this kind have, each drawn from a part of its spread."""
    out = []
    for effect in plausible_arm.directions(robot, ()):
        if effect.of not in ('joint', 'link') or effect.traits.waves is not None:
            continue
        size = plausible_arm.sizes(robot, effect) * rng.standard_normal(effect.vector().size)
        if effect.name == 'joint_compliance':
            if robot.mass is None:
                continue
            size = np.abs(size)
        out.append(effect.with_vector(part * size).to_mapping())
    return out


def uneven_errors(robot: Robot, rng: np.random.Generator, part: float) -> list[Cause]:
    """
    Return small errors everywhere, of which some are several times as large as the others.

    Gears run unevenly, too, and their ratios are exact. part: of the usual spread.
    """
    drawn = [own for own in small_errors(robot, rng, part) if own['effect'] not in EXACT]
    out = [scaled(own, float(np.sqrt(FREEDOM / rng.chisquare(FREEDOM)))) for own in drawn]
    for joint, slides in zip(robot.joint_names, robot.prismatic, strict=True):
        for order in () if slides else (*LOW_ORDERS, int(rng.choice(RIPPLE_ORDERS))):
            amplitude = RIPPLE * part * abs(float(rng.standard_t(FREEDOM)))
            phase = float(rng.uniform(-np.pi, np.pi))
            waves = {'order': order, 'amplitude': amplitude, 'phase': phase}
            out.append({'effect': 'transmission_ripple', 'joint': joint, **waves})
    return out
