# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What one piece of work costs, larger and larger: each size in a process of its own.

`python -m weld_twin_lab.benchmark.growing KIND SIZE` prints seconds and bytes as JSON.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from time import process_time

import numpy as np

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.robot import Robot
from weld_twin_core.diagnosis.advice.experiment import next_experiment
from weld_twin_core.diagnosis.algebra.problem import Model, Problem
from weld_twin_core.diagnosis.hypotheses.library import candidate_kinds
from weld_twin_core.diagnosis.pipeline import diagnose
from weld_twin_core.effects import Backlash, JointOffset
from weld_twin_core.motion.paths.bundled import default_seam
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.sensitivity import default_tolerances, model, planned_study

from .arms import arm_of
from .costs import own_peak
from .waiting_data import JOINT_RATE, POSE_RATE, moving, seen, stations

Work = Callable[[], object]
SHORT = 20.0
"""Seconds of motion where something else grows."""
FAMILIES = ('joint_offset', 'link_length', 'link_twist')
"""Tolerances of a study of DH values alone, which is run exactly."""


def _minutes(size: float) -> Work:
    recording, robot = moving(60.0 * size), load('ur5')
    return lambda: diagnose(recording, robot)


def _stations(size: float) -> Work:
    recording, robot = stations(int(size)), load('ur10')
    return lambda: diagnose(recording, robot, align='base')


def _joints(size: float) -> Work:
    robot = arm_of(int(size))
    recording = _swinging(robot)
    return lambda: diagnose(recording, robot)


def _effects(size: float) -> Work:
    recording, robot = moving(SHORT), load('ur5')
    kinds = [kind.name for kind in candidate_kinds((), frozenset())]
    return lambda: diagnose(recording, robot, exclude=kinds[int(size) :])


def _candidates(size: float) -> Work:
    recording, robot = moving(SHORT), load('ur5')
    problem = Problem((recording,))
    sites = [(kind, name) for kind in (Backlash, JointOffset) for name in robot.joint_names]
    listed = [(kind(name),) for kind, name in sites[: int(size)]]
    now = Model(robot, (robot.T_world_base,))
    return lambda: next_experiment(problem, now, listed, problem.unit_scale())


def _draws(size: float) -> Work:
    return _drawn(int(size), exact=False)


def _exact_draws(size: float) -> Work:
    return _drawn(int(size), exact=True)


def _drawn(count: int, *, exact: bool) -> Work:
    robot = load('ur5')
    study = planned_study(robot, default_seam(robot), 'smooth')
    tolerances = default_tolerances(robot, FAMILIES)
    run = model(study, tolerances, exact=exact)
    unit = np.random.default_rng(3).random((count, len(tolerances)))
    return lambda: run.at_probabilities(unit)


def _swinging(robot: Robot) -> Recording:
    """Return an arm whose joints swing at rates of their own, the second with play."""
    t = np.arange(round(SHORT * JOINT_RATE) + 1) / JOINT_RATE
    own = np.arange(robot.n)
    q = 0.3 + 0.5 * np.sin(t[:, None] * (0.4 + 0.17 * own) + own)
    at = 0.003 + np.arange(round(SHORT * POSE_RATE) - 1) / POSE_RATE
    play = Backlash(robot.joint_names[1], width=5e-4)
    return seen(Recording('swinging', JointMotion(t, q)), robot, [play], at)


KINDS: dict[str, tuple[Callable[[float], Work], tuple[float, ...]]] = {
    'minutes of recording': (_minutes, (0.5, 1.0, 2.0, 4.0, 8.0)),
    'stations': (_stations, (100, 300, 1000, 3000)),
    'joints': (_joints, (2, 3, 4, 5, 6, 7, 8)),
    'effects in the library': (_effects, (4, 8, 16, 24, 32)),
    'candidates': (_candidates, (2, 3, 4, 6, 8)),
    'draws': (_draws, (1e3, 1e4, 1e5, 1e6)),
    'draws, each exact': (_exact_draws, (1e3, 1e4, 1e5)),
}
"""What grows, and how far: the largest still take seconds."""


def cost(kind: str, size: float) -> dict[str, float]:
    """Return processor seconds of the work, and the largest memory of this process [bytes]."""
    work = KINDS[kind][0](size)
    start = process_time()
    work()
    seconds = process_time() - start
    return {'size': size, 'seconds': seconds, 'bytes': own_peak()}


if __name__ == '__main__':
    print(json.dumps(cost(sys.argv[1], float(sys.argv[2]))))
