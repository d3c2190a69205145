# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Many draws of DH values against one robot rebuilt for each of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from SALib.analyze import sobol as salib_analyze
from SALib.sample import sobol as salib_sample

from weld_twin_core.arm import chain
from weld_twin_core.arm.robot import Robot
from weld_twin_core.errors import ModelError
from weld_twin_core.sensitivity.dh_draws import DhDraws, SeamDraws
from weld_twin_core.sensitivity.sobol import base_pair, mixed, sobol_estimates, sobol_half_widths

EXACT = 1e-13


def some_draws(robot: Robot, count: int, size: float) -> DhDraws:
    rng = np.random.default_rng(2)
    return DhDraws(
        *(getattr(robot, k) + size * rng.normal(size=(count, robot.n)) for k in DhDraws._fields)
    )


def rebuilt(robot: Robot, q: np.ndarray, draws: DhDraws) -> np.ndarray:
    nominal = chain.forward(robot, q)[:, :3, 3]
    out = []
    for row in zip(*draws, strict=True):
        other = replace(robot, **dict(zip(DhDraws._fields, row, strict=True)))
        out.append(chain.forward(other, q)[:, :3, 3] - nominal)
    return np.array(out)


@pytest.mark.parametrize('size', [1e-4, 0.3])
def test_deviations_of_draws_are_exact_on_a_smooth_seam(
    make_robot: Callable[..., Robot], smooth_seam: np.ndarray, size: float
) -> None:
    robot = make_robot(6, beta=False)
    draws = some_draws(robot, 30, size)
    seam = SeamDraws(robot, smooth_seam)
    assert len(seam.samples) < 20
    assert np.abs(seam.deviations(draws) - rebuilt(robot, smooth_seam, draws)).max() < EXACT


def test_deviations_of_draws_are_exact_on_points_that_have_nothing_in_common(
    make_robot: Callable[..., Robot],
) -> None:
    robot = make_robot(6, beta=False)
    q = np.random.default_rng(3).uniform(-3.0, 3.0, (200, 6))
    draws = some_draws(robot, 30, 1e-3)
    seam = SeamDraws(robot, q)
    assert len(seam.samples) == 200
    assert np.abs(seam.deviations(draws) - rebuilt(robot, q, draws)).max() < EXACT


def test_seven_joints_and_blocks_of_draws_change_nothing(
    make_robot: Callable[..., Robot], smooth_seam: np.ndarray
) -> None:
    robot = make_robot(7, beta=False)
    q = np.column_stack([smooth_seam, smooth_seam[:, 2]])[:40]
    draws = some_draws(robot, 700, 1e-3)
    seam = SeamDraws(robot, q)
    few = DhDraws(*(values[-5:] for values in draws))
    assert np.abs(seam.deviations(draws)[-5:] - rebuilt(robot, q, few)).max() < EXACT


def test_a_robot_the_draws_are_not_made_for_is_refused(
    make_robot: Callable[..., Robot], smooth_seam: np.ndarray
) -> None:
    for robot in (make_robot(6), make_robot(6, 'modified', beta=False)):
        with pytest.raises(ModelError, match='standard rows'):
            SeamDraws(robot, smooth_seam)


@pytest.mark.parametrize('groups', [None, list('ghgfh')])
def test_design_indices_and_intervals_are_those_of_salib(groups: list[str] | None) -> None:
    problem = {'num_vars': 5, 'names': list('abcde'), 'bounds': [[0.0, 1.0]] * 5}
    if groups:
        problem['groups'] = groups
    theirs = salib_sample.sample(problem, 64, calc_second_order=False, seed=7)
    ours = mixed(*base_pair(5, 64, 7), groups)
    assert np.abs(ours.reshape(theirs.shape) - theirs).max() == 0.0
    runs = theirs @ np.arange(5.0) + 3.0 * theirs[:, 0] * theirs[:, 4] ** 2
    found = salib_analyze.analyze(problem, runs, calc_second_order=False, seed=7)
    results = runs.reshape(64, -1)
    first, total = sobol_estimates(results)
    first_half, total_half = sobol_half_widths(results, 0.95, np.random.default_rng(7))
    assert np.abs(first - found['S1']).max() < 1e-12
    assert np.abs(total - found['ST']).max() < 1e-12
    assert np.abs(first_half - found['S1_conf']).max() < 1e-12
    assert np.abs(total_half - found['ST_conf']).max() < 1e-12
