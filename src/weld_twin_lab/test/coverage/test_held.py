# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Regions are counted as a statistician would: against draws from the very covariance."""

from __future__ import annotations

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_lab.coverage.held import inside_region
from weld_twin_lab.coverage.oracle import oracle_sigma
from weld_twin_lab.coverage.table import page, summaries


def test_nine_of_ten_draws_lie_in_their_region():
    rng = np.random.default_rng(2)
    half = rng.normal(size=(4000, 3, 3)) * 1e-4
    covariance = half @ np.swapaxes(half, 1, 2)
    sigma = rng.uniform(1e-5, 5e-5, 4000)
    true = (half @ rng.normal(size=(4000, 3, 1)))[..., 0]
    errors = true + sigma[:, None] * rng.normal(size=(4000, 3))
    # 4,000 draws: 0.9 within three times sqrt(0.09 / 4000).
    assert abs(inside_region(errors, covariance, sigma).mean() - 0.9) < 0.0143
    assert inside_region(errors, 0.25 * covariance, 0.5 * sigma).mean() < 0.6


def test_the_table_tells_parts_apart():
    one = {
        'poses': 10,
        'held': 0.9,
        'flagged': 0.0,
        'held_unflagged': 0.9,
        'mean_error_m': 1e-4,
        'median_sigma_m': 5e-5,
    }
    entries = [
        {'name': 'a', 'source': 'ur5', 'group': 'unseen', 'status': 'unknown', 'inside': one},
        {
            'name': 'b',
            'source': 'ur5',
            'group': 'unseen',
            'status': 'unknown',
            'inside': {**one, 'held': 0.5, 'poses': 30},
            'outside': one,
        },
        {'name': 'c', 'source': 'plant', 'group': 'unseen', 'refused': 'no pose'},
    ]
    inside, outside = summaries(entries)
    assert (inside['recordings'], inside['held'], inside['worst']) == (2, 0.7, 0.5)
    assert inside['held_of_all_poses'] == 0.6
    assert outside['held'] == 0.9
    assert '| b | unknown | outside | 10 | 90% |' in page(entries)


def test_one_who_knows_the_cause_is_as_sure_as_its_mean_is():
    robot = Robot.from_mapping(
        {'name': 'one', 'joints': [{'name': 'j', 'a': 0.8, 'alpha': 0.0, 'd': 0.0}]}
    )
    rng = np.random.default_rng(3)
    count, noise, off = 25, 2e-5, 1e-3
    q = rng.uniform(-2.0, 2.0, (count, 1))
    seen = 0.8 * np.column_stack([np.cos(q + off), np.sin(q + off), 0.0 * q])
    seen += rng.normal(scale=noise, size=seen.shape)
    t = np.arange(float(count))
    train = Recording('train', JointMotion(t, q, static=True), Measurements(t, seen))
    truth = {
        'causes': [{'effect': 'joint_offset', 'joint': 'j', 'offset': off}],
        'align': [],
        'sigma_m': noise,
    }
    # Every station shows the zero by the same lever that it moves the tool with.
    sigma = oracle_sigma(robot, (), truth, (train, train), t)
    assert abs(sigma / (noise / np.sqrt(count)) - 1.0) < 1e-6
    truth['causes'] = [{'effect': 'no formula of ours', 'joint': 'j'}]
    assert oracle_sigma(robot, (), truth, (train, train), t) is None
