# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Plain geometric calibration: all DH values by Levenberg and Marquardt, as textbooks have it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import rotation_matrix, transform
from weld_twin_core.arrays import Array
from weld_twin_core.recording import JointMotion

from ..course import Cause, ContestAnswer, ContestCase

Learn = Callable[[Array, Array, Array], tuple[Array, Array | None]]
"""
Takes features (N, k), errors of the nominal arm there (N, 3) [m] and the features asked for (M, k);
returns the errors there (M, 3) [m], and their standard deviations where it has any.
"""


def answer_of(case: ContestCase, learn: Learn, most: int | None = None) -> ContestAnswer:
    """Return the nominal arm plus what a learner adds from most samples; it names nothing."""
    count = case.measured.t.size
    rows = np.unique(np.linspace(0, count - 1, most or count).astype(int))
    known = features(case.train.joints, case.measured.t[rows])
    added, sigma = learn(known, off(case)[rows], features(case.ask.joints, case.times))
    there = nominal(case, case.ask.joints, case.times)
    return ContestAnswer(there + added, unknown=1.0, sigma=sigma)


def as_causes(sizes: Mapping[tuple[str, str | None], float]) -> tuple[Cause, ...]:
    """Return causes by their sizes, the largest first, each as likely as its share of the whole."""
    whole = sum(sizes.values())
    ranked = sorted(sizes.items(), key=lambda item: -item[1])
    return tuple(((*at, size / whole),) for at, size in ranked)


def nominal(case: ContestCase, motion: JointMotion, t: Array) -> Array:
    """Return where the nominal tool is, shape (M, 3) [m]."""
    q, _ = motion.at(t)
    return np.asarray(forward(case.robot, q)[:, :3, 3])


def off(case: ContestCase) -> Array:
    """Return measured minus nominal position, shape (M, 3) [m]."""
    measured = case.measured
    return np.asarray(measured.position - nominal(case, case.train.joints, measured.t))


def features(motion: JointMotion, t: Array) -> Array:
    """Return sine and cosine of the angles, and, of a motion, velocities and their signs."""
    q, qd = motion.at(t)
    columns = [np.sin(q), np.cos(q)]
    if not motion.static:
        columns += [qd, np.tanh(qd / max(1e-9, 0.02 * float(np.abs(qd).max(initial=0.0))))]
    return np.hstack(columns)


FAMILY = {'a': 'link_length', 'd': 'link_length', 'alpha': 'link_twist', 'theta': 'joint_offset'}
"""What a library of effects calls an error of each DH value."""
MOST = 600
"""Poses that are fitted: more add seconds and hardly any digits."""
SURE_AT = 4.0
"""Standard errors from which a value counts as off: one false in some hundred cases of 24."""
ALL = ('a', 'alpha', 'd', 'theta')


@dataclass(frozen=True)
class Fitted:
    names: tuple[tuple[str, int], ...]
    """DH value and row, or frame and -1."""
    values: Array
    errors: Array
    """Corrections, and their standard errors, shape (P,)."""
    effect: Array
    """How far each moves the tool, RMS, shape (P,) [m]."""
    robot: Robot


def geometry(case: ContestCase) -> ContestAnswer:
    """Return the values that are off, by how far they move the tool."""
    return answer_with(case, ALL)


def answer_with(case: ContestCase, free: tuple[str, ...]) -> ContestAnswer:
    fitted = fit(case, free)
    moved: dict[tuple[str, str | None], float] = defaultdict(float)
    for (name, row), value, error, effect in zip(
        fitted.names, fitted.values, fitted.errors, fitted.effect, strict=True
    ):
        if name in FAMILY and abs(value) > SURE_AT * error:
            moved[FAMILY[name], case.robot.joint_names[row]] += float(effect) ** 2
    causes = as_causes(moved)
    q, _ = case.ask.joints.at(case.times)
    predicted = forward(fitted.robot, q)[:, :3, 3]
    return ContestAnswer(predicted, causes, none=0.0 if causes else 1.0)


def fit(case: ContestCase, free: tuple[str, ...]) -> Fitted:
    measured = case.measured
    rows = np.unique(np.linspace(0, measured.t.size - 1, MOST).astype(int))
    q, _ = case.train.joints.at(measured.t[rows])
    seen = measured.position[rows]
    frames = [frame for frame in ('base', 'tool') if frame in case.align]
    names = tuple((name, row) for name in free for row in range(case.robot.n)) + tuple(
        (f'{frame}{k}', -1) for frame in frames for k in range(6)
    )

    def off(values: Array) -> Array:
        return np.asarray((forward(_moved(case.robot, names, values), q)[:, :3, 3] - seen).ravel())

    # DH values of an arm are degenerate (parallel axes): the method needs a little damping.
    damped = 1e-3
    solution = least_squares(
        lambda values: np.append(off(values), damped * values), np.zeros(len(names)), method='lm'
    )
    slope = solution.jac[: -len(names)]
    noise = float((solution.fun[: -len(names)] ** 2).mean())
    spread = np.linalg.pinv(solution.jac.T @ solution.jac) * noise
    effect = np.sqrt(((slope * solution.x) ** 2).sum(axis=0) / len(seen))
    errors = np.sqrt(np.maximum(np.diag(spread), 1e-30))
    return Fitted(names, solution.x, errors, effect, _moved(case.robot, names, solution.x))


def _moved(robot: Robot, names: tuple[tuple[str, int], ...], values: Array) -> Robot:
    change: dict[str, Any] = {name: np.array(getattr(robot, name)) for name in ALL}
    turned = {'base': np.zeros(6), 'tool': np.zeros(6)}
    for (name, row), value in zip(names, values, strict=True):
        if row < 0:
            turned[name[:-1]][int(name[-1])] = value
        else:
            change[name][row] += value
    base, tool = (transform(rotation_matrix(part[3:]), part[:3]) for part in turned.values())
    return replace(
        robot,
        **change,
        T_world_base=robot.T_world_base @ base,
        T_flange_tool=robot.T_flange_tool @ tool,
    )


def zero_offset(case: ContestCase) -> ContestAnswer:
    """Return the joint whose zero moves the tool most, without a doubt."""
    fitted = fit(case, ('theta',))
    row = int(fitted.effect[: case.robot.n].argmax())
    predicted = answer_with(case, ('theta',)).predicted
    return ContestAnswer(predicted, ((('joint_offset', case.robot.joint_names[row], 1.0),),))


DRAWS = 20
"""Of poses: a standard deviation of so many is good to a sixth."""


def bootstrap(case: ContestCase) -> ContestAnswer:
    """Return what `geometry` says, and by how much its predictions scatter beside what it leaves."""
    rng, measured = np.random.default_rng(0), case.measured
    asked, _ = case.ask.joints.at(case.times)
    predictions = []
    for _ in range(DRAWS):
        rows = np.sort(rng.choice(measured.t.size, measured.t.size))
        drawn = replace(case, train=case.train.with_measured(measured.take(np.unique(rows))))
        predictions.append(forward(fit(drawn, ALL).robot, asked)[:, :3, 3])
    seen, _ = case.train.joints.at(measured.t)
    remaining = measured.position - forward(fit(case, ALL).robot, seen)[:, :3, 3]
    sigma = np.sqrt(np.var(predictions, axis=0, ddof=1) + (remaining**2).mean())
    return replace(answer_with(case, ALL), sigma=sigma)


def never_knows(case: ContestCase) -> ContestAnswer:
    return ContestAnswer(nominal(case, case.ask.joints, case.times), unknown=1.0)
