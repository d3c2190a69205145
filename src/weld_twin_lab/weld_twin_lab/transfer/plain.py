# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What anybody would do: fit the frames, the geometry, or geometry and gravity, all at once."""

from __future__ import annotations

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.diagnosis.algebra.fit import fit, robust_scale
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, usable
from weld_twin_core.diagnosis.frames.alignment import initial_frames
from weld_twin_core.effects import REGISTRY
from weld_twin_core.effects.effect import Effect
from weld_twin_core.effects.plausible import spreads
from weld_twin_core.recording import Recording

GEOMETRY = ('joint_offset', 'link_length', 'link_offset', 'link_twist', 'axis_parallelism')
PLAIN: dict[str, tuple[str, ...]] = {
    'frames': (),
    'geometry': GEOMETRY,
    'gravity': (*GEOMETRY, 'joint_compliance'),
}
"""The plain fits by name: the families that are fitted, all members of each."""
ROUNDS = 4
"""Gauss-Newton steps; there is no test of convergence."""


def plain_fit(
    train: Recording, robot: Robot, families: tuple[str, ...], align: frozenset[str]
) -> Model:
    """
    Return the robot with frames and all members of some families fitted.

    Least squares with the priors of `weld_twin_core.effects.plausible`, the noise estimated from
    what is left; nothing is chosen and nothing is judged.

    families: one number per joint each; none for the frames alone.
    align: frames that are fitted: 'base', 'tool'.
    """
    problem = Problem((usable(train),), align)
    start = initial_frames(problem, Model(robot, (robot.T_world_base,)))
    model = fit(problem, start, problem.unit_scale()).model
    effects = _members(robot, families)
    if not effects:
        return model
    model = model.with_found(effects)
    prior = 1.0 / np.concatenate([spreads(robot, effect) for effect in effects]) ** 2
    for _ in range(ROUNDS):
        freedom = float(min(prior.size, problem.size // 2))
        scale = robust_scale(problem, problem.residuals(model), freedom=freedom)
        model = fit(problem, model, scale, prior, iterations=6).model
    return model


def _members(robot: Robot, families: tuple[str, ...]) -> tuple[Effect, ...]:
    """Return a member of every family on every joint, at zero."""
    return tuple(
        REGISTRY[family](joint)  # type: ignore[call-arg]
        for family in families
        if family != 'joint_compliance' or robot.mass is not None
        for joint in robot.joint_names
    )
