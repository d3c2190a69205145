# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Monte Carlo and Sobol studies over draws of the DH values."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from scipy.special import ndtri

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.kernels.draws import DhDraws, SeamDraws
from weld_twin_core.kernels.saltelli import base_pair, mixed, sobol_estimates, sobol_half_widths

from .arms import DH_KEYS, SIZE, random_positions, smooth_motion, turn_x, turn_z
from .kinematics import OWN
from .race import Contender, Workload

POINTS = 200
"""Points of a seam, as the sensitivity study has."""
BASE = 1024
"""Rows of the base design; the study runs as many, times the inputs and two."""
FEW = 16
"""Draws the peer is timed on; every draw costs it the same."""
EXACT = 1e-12
"""Difference [m] that rounding may leave between two ways to the same pose."""
CONFIDENCE = 0.95
"""Of the intervals; SALib's own default."""
ESTIMATES = ('S1', 'ST', 'S1_conf', 'ST_conf')


def studies(robot: Robot, draws: int, base: int, with_pinocchio: bool) -> Iterator[Workload]:
    """Yield the workloads."""
    yield _monte_carlo(robot, smooth_motion(robot, POINTS), 'smooth seam', draws, with_pinocchio)
    scattered = random_positions(robot, POINTS, seed=3)
    yield _monte_carlo(robot, scattered, 'arbitrary points', draws, with_pinocchio)
    yield _sobol(robot, base, with_pinocchio)


def drawn(robot: Robot, normal: Array) -> DhDraws:
    """Return draws of all DH values from standard normal ones, shape (D, 4 n)."""
    parts = np.split(SIZE * normal, len(DH_KEYS), axis=1)
    return DhDraws(*(getattr(robot, k) + part for k, part in zip(DH_KEYS, parts, strict=True)))


def _monte_carlo(robot: Robot, q: Array, where: str, draws: int, with_pinocchio: bool) -> Workload:
    some = drawn(robot, np.random.default_rng(4).normal(size=(draws, 4 * robot.n)))

    def own() -> Array:
        return SeamDraws(robot, q).largest(some)

    contenders = [Contender(OWN, own, draws)]
    if with_pinocchio:
        few = DhDraws(*(values[:FEW] for values in some))
        peer = rebuilding(robot, q)
        gap = float(np.abs(peer(few) - own()[:FEW]).max())
        contenders.append(Contender('pinocchio', lambda: peer(few), FEW, gap))
    title = f'largest deviation of {draws:,} draws along {len(q)} points, {where}'
    return Workload(title, 'draw', contenders, EXACT)


def rebuilding(robot: Robot, q: Array) -> Callable[[DhDraws], Array]:
    """Return what Pinocchio needs: its model told of every draw, then a loop over the points."""
    import pinocchio as pin

    from .peers.pinocchio_peer import chain_model

    model, tool = chain_model(robot)
    data = model.createData()
    end = robot.T_flange_tool

    def points() -> Array:
        out = np.empty((len(q), 3))
        for one, point in zip(q, out, strict=True):
            pin.forwardKinematics(model, data, one)
            point[:] = pin.updateFramePlacement(model, data, tool).translation
        return out

    nominal = points()

    def largest(draws: DhDraws) -> Array:
        out = np.empty(len(draws.theta))
        for k, (theta, d, a, alpha) in enumerate(zip(*draws, strict=True)):
            for i in range(robot.n):
                link = turn_z(theta[i], d[i]) @ turn_x(alpha[i], a[i])
                if i + 1 < robot.n:
                    model.jointPlacements[i + 2] = pin.SE3(link)
                else:
                    model.frames[tool].placement = pin.SE3(link @ end)
            away = points() - nominal
            out[k] = np.sqrt((away * away).sum(axis=1).max())
        return out

    return largest


def _sobol(robot: Robot, base: int, with_pinocchio: bool) -> Workload:
    inputs = 4 * robot.n
    runs = base * (inputs + 2)
    q = smooth_motion(robot, POINTS)

    def own() -> tuple[Array, ...]:
        first, second = (
            np.hstack(drawn(robot, ndtri(part))) for part in base_pair(inputs, base, seed=1)
        )
        draws = DhDraws(
            *np.split(mixed(first, second).reshape(runs, inputs), len(DH_KEYS), axis=1)
        )
        results = SeamDraws(robot, q).largest(draws).reshape(base, inputs + 2)
        rng = np.random.default_rng(1)
        return *sobol_estimates(results), *sobol_half_widths(results, CONFIDENCE, rng)

    contenders = [Contender(OWN, own, runs)]
    if with_pinocchio:
        few = drawn(robot, ndtri(base_pair(inputs, FEW, seed=1)[0]))
        peer = rebuilding(robot, q)
        gap = np.abs(peer(few) - SeamDraws(robot, q).largest(few)).max()
        contenders.append(Contender('pinocchio', lambda: peer(few), FEW, float(gap)))
        contenders.append(_salib(robot, q, base, own()))
    return Workload(
        f'Sobol first and total, {inputs} inputs, {runs:,} runs of {POINTS} points',
        'run',
        contenders,
        1e-9,
        'SALib draws and estimates, Pinocchio runs the model: their sum counts',
        ('pinocchio', 'SALib'),
    )


def _salib(robot: Robot, q: Array, base: int, wanted: tuple[Array, ...]) -> Contender:
    """Return SALib's part: the design and the estimates."""
    from SALib.analyze import sobol as analyze
    from SALib.sample import sobol as sample

    inputs = 4 * robot.n
    names = [str(k) for k in range(inputs)]
    problem = {'num_vars': inputs, 'names': names, 'bounds': [[0.0, 1.0]] * inputs}

    def design() -> Array:
        return np.asarray(sample.sample(problem, base, calc_second_order=False, seed=1))

    def estimates(results: Array) -> dict[str, Array]:
        found: dict[str, Array] = analyze.analyze(
            problem, results, calc_second_order=False, seed=1
        )
        return found

    results = SeamDraws(robot, q).largest(drawn(robot, ndtri(design())))
    found = estimates(results)
    gap = max(np.abs(found[k] - v).max() for k, v in zip(ESTIMATES, wanted, strict=True))
    return Contender('SALib', lambda: (design(), estimates(results)), results.size, float(gap))
