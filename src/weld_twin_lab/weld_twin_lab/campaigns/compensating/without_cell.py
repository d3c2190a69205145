# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Goals corrected and judged without nodes: as many as a cell would take hours for."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from weld_twin_core.arm.chain import forward
from weld_twin_core.arrays import Array
from weld_twin_core.errors import TwinError
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.goal_correction import GoalLimits, Refusal, Start, corrected_goal
from weld_twin_core.twin.goal_motion import Goal, course, fine_times
from weld_twin_core.twin.program_model import ProgramModel
from weld_twin_core.twin.reversals import approached
from weld_twin_core.twin.twin import Twin
from weld_twin_nodes.offline.correcting import program_model

from .drawn_cells import cell_of, drawn_goal, learned, true_effects

LIMITS = GoalLimits(acceleration=20.0)
"""As a compensator has them that is told nothing else."""


def judged(name: str, seed: int, goals: int) -> list[dict[str, Any]]:
    """Return what becomes of the goals of one arm that stands where each of them begins."""
    robot, causes, rng = cell_of(name, seed)
    with TemporaryDirectory() as place:
        file = Path(place) / 'diagnosis.json'
        file.write_text(learned(robot, causes, rng).text)
        try:
            model = program_model(robot, file)
        except TwinError:  # a compensator does not take it either
            return []
    true = ProgramModel(robot, true_effects(robot, causes))
    rows = []
    for _ in range(goals):
        goal, inside = drawn_goal(robot, rng)
        start = Start(goal.q[0], False, rng.choice([-1.0, 1.0], robot.n))
        corrected, best = (corrected_goal(each, goal, LIMITS, start) for each in (model, true))
        before, _ = _off(true, goal, goal, start)
        row = {'robot': name, 'arm': seed, 'after': '', 'inside': inside, 'before_m': before}
        row['best_m'] = before if isinstance(best, Refusal) else best.after
        if isinstance(corrected, Refusal):
            row |= {'verdict': 'refused', 'after_m': before, 'bound_m': None}
        else:
            after, worst = _off(true, corrected.goal.later(-corrected.waits), goal, start)
            row |= {'verdict': 'corrected', 'after_m': after, 'worst_m': worst}
            row |= {'bound_m': corrected.bound}
        rows.append(row)
    return rows


def _off(true: ProgramModel, run: Goal, goal: Goal, start: Start) -> tuple[float, float]:
    """Return how far the arm with the true causes is from where a goal means it, RMS and most [m]."""
    at: Array = fine_times(goal)
    way = Recording('goal', JointMotion(at, course(run, at).q))
    came = approached(way, start.came, start.q)
    real = Twin(true.robot, true.effects).poses(came).position[-at.size :]
    apart = real - forward(true.robot, course(goal, at).q)[:, :3, 3]
    squares = (apart**2).sum(axis=1)
    return float(np.sqrt(squares.mean())), float(np.sqrt(squares.max()))
