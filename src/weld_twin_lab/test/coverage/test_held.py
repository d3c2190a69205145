# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Regions and promises hold as often as they say, of sealed cells and of a corrected arm."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from weld_twin_core.arm import catalog
from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.robot import Robot
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.diagnosis.predicting.planned import (
    JUDGED,
    SPREAD,
    clear_postures,
    plan_stations,
)
from weld_twin_core.effects.dated import of_the_robot
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_core.twin.compensation import compensate
from weld_twin_core.twin.posterior import largest_sigma
from weld_twin_core.twin.twin import Twin
from weld_twin_lab.blind.blind_cell import BlindCell, Take
from weld_twin_lab.blind.cause_sizes import small_errors
from weld_twin_lab.blind.making import Lot, SealedCase, one_arm
from weld_twin_lab.coverage.sealed import inside_region, of_case, oracle_sigma
from weld_twin_lab.coverage.study import page, promise_table, summaries
from weld_twin_lab.plant.exponentials import Command
from weld_twin_lab.plant.plant import run
from weld_twin_lab.plant.tracker import Tracker

LOT = Lot('single', 'one', 'stations', ('joint_offset',), (1,))
TAKE = Take(Command(np.zeros(1), np.zeros((1, 1)), True), 0)


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
    one = {'poses': 10, 'held': 0.9, 'flagged': 0.0, 'held_unflagged': 0.9}
    one |= {'mean_error_m': 1e-4, 'median_sigma_m': 5e-5}
    of, worse = {'source': 'ur5', 'group': 'unseen', 'status': 'unknown'}, {**one, 'held': 0.5}
    entries = [
        {'name': 'a', **of, 'inside': one},
        {'name': 'b', **of, 'inside': {**worse, 'poses': 30}, 'outside': one},
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
    true = 0.8 * np.column_stack([np.cos(q + off), np.sin(q + off), 0.0 * q])
    seen = true + rng.normal(scale=noise, size=true.shape)
    t = np.arange(float(count))
    train, exact = (
        Recording('train', JointMotion(t, q, static=True), Measurements(t, places))
        for places in (seen, true)
    )
    every = np.ones(count, dtype=bool)
    causes = [{'effect': 'joint_offset', 'joint': 'j', 'offset': off}]
    cell = BlindCell(robot, Tracker(sigma=noise))
    case = SealedCase(LOT, cell, causes, [], [], (), TAKE, TAKE, TAKE, False)
    # Every station shows the zero by the same lever that it moves the tool with.
    told = oracle_sigma(case, (train, exact), every)
    assert abs(told['formal_sigma_m'] / (noise / np.sqrt(count)) - 1.0) < 1e-6
    assert told['oracle_sigma_m'] >= told['formal_sigma_m']
    # All of them off by 0.3 mm: so large a region holds them, and none that is smaller.
    shifted = exact.with_measured(Measurements(t, true + [0.0, 0.0, 3e-4]))
    missed = oracle_sigma(case, (train, shifted), every)['oracle_sigma_m']
    assert abs(missed * np.sqrt(chi2.ppf(0.9, 3)) / 3e-4 - 1.0) < 0.01
    unknown = replace(case, causes=[{'effect': 'no formula of ours', 'joint': 'j'}])
    assert oracle_sigma(unknown, (train, exact), every) == {}


def test_promises_of_a_sealed_cell_hold_where_the_tool_really_is_and_are_sharp():
    told = of_case(97101, 12)
    assert told is not None
    inside = told['inside']
    assert inside['held'] > 0.9
    assert inside['formal_sigma_m'] <= inside['oracle_sigma_m']
    assert inside['median_sigma_m'] < 4.0 * inside['oracle_sigma_m']
    (shrink,) = told['promises']['shrink, inside']
    (low, high), true = shrink['ci90'], shrink['true']
    assert low <= true <= high
    assert 'parameters' in promise_table([told])
    # As a program: what is off before is known better than it is large, and less is off after.
    ((before,), (after,)) = (told['promises'][f'path {when}'] for when in ('before', 'after'))
    assert np.ptp(before['ci90']) < before['true']
    assert after['true'] < before['true'] and after['ci90'][1] < before['ci90'][0]


def test_a_hose_of_a_sealed_arm_hangs_where_it_hung_in_the_recording():
    robot = load('ur5')
    q = np.linspace(-0.4, 0.8, 5)[:, None] * np.ones((1, robot.n))
    train = Take(Command(np.arange(5.0), q, True), 0)
    hose = {'effect': 'dress_pack', 'joint': 'elbow_joint', 'amplitude': 1e-3}
    case = SealedCase(
        LOT, BlindCell(robot, Tracker()), [hose], [], [], (), train, train, train, False
    )
    (own,) = one_arm(case).causes
    assert np.allclose([own['middle'], own['reach']], [0.2, 0.6])


NOISE, TOLERANCE, STATIONS = 3e-5, 2e-4, 16


def _with_middle_frames(robot, step):
    """Return a robot with the frames of the middle of the allowed models, base first (12,)."""
    base, tool = np.array(robot.T_world_base), np.array(robot.T_flange_tool)
    base[:3, :3] = Rotation.from_rotvec(step[3:6]).as_matrix() @ base[:3, :3]
    tool[:3, :3] = tool[:3, :3] @ Rotation.from_rotvec(step[9:12]).as_matrix()
    base[:3, 3] += step[:3]
    tool[:3, 3] += step[6:9]
    return robot.with_frames(base=base, tool=tool)


def test_a_corrected_arm_keeps_what_its_plan_promised():
    """Measured at the stations of the plan, corrected, and driven where it never was."""
    robot, rng = catalog.load('kuka_kr6_r900'), np.random.default_rng(12)
    flaws = small_errors(robot, rng)

    def driven(q, noise):
        t = 1.0 + np.arange(float(len(q)))
        tracker = Tracker(sigma=noise, orientation=False)
        seen = run(robot.to_mapping(), flaws, Command(t, q, static=True), tracker, rng)
        return JointMotion(t, q, static=True), Measurements(t, seen.position)

    plan = plan_stations(robot, STATIONS, TOLERANCE, NOISE)
    seen = Recording('plan', *driven(plan.q, NOISE))
    found = diagnose(seen, robot, align='base,tool', experiment=False)
    model, posterior = found.model, found.posterior
    effects, _ = posterior.centred(model.found)
    bare = _with_middle_frames(model.twin(0).robot, np.array(posterior.mean[:12]))
    others = clear_postures(robot, SPREAD)[JUDGED:]
    still = Recording('others', JointMotion(np.arange(float(len(others))), others, static=True))
    wanted = Twin(bare).poses(still).position
    commands = compensate(bare, of_the_robot(effects), still).motion.q

    def off(q):
        miss = driven(q, 0.0)[1].position - wanted
        return miss, float(largest_sigma(np.einsum('mi,mj->ij', miss, miss)[None] / len(q))[0])

    (_, before), (miss, kept) = off(others), off(commands)
    promised = float(plan.sigma[-1])
    assert kept < promised < 3.0 * kept, 'what is promised is kept, and no empty words'
    assert kept < 0.5 * before
    assert np.mean(np.linalg.norm(miss, axis=1) < TOLERANCE) >= plan.within[-1] - 0.05
