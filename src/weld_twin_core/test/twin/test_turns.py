# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where joints have just turned around, and what is left by models that are wrong or lack something."""

from dataclasses import replace

import numpy as np
import pytest

from weld_twin_core import JointMotion, Measurements, Recording, effect_from_mapping, forward, load
from weld_twin_core.diagnosis.algebra.fit import effect_precision, fit, robust_scale
from weld_twin_core.diagnosis.algebra.noise_floor import noise_floor
from weld_twin_core.diagnosis.algebra.problem import Model, Problem
from weld_twin_core.diagnosis.predicting.allowed import allowed
from weld_twin_core.effects import JointOffset
from weld_twin_core.twin.directions import Directions, Discrepancy
from weld_twin_core.twin.domain import Domain
from weld_twin_core.twin.features import Features
from weld_twin_core.twin.goal_correction import Start, corrected_goal
from weld_twin_core.twin.goal_motion import Goal, just_turned
from weld_twin_core.twin.posterior import Posterior, pose_covariances
from weld_twin_core.twin.program_model import ProgramModel

HOME = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
WIDTH = 7e-4
ZERO = JointOffset('shoulder_lift_joint', 0.0)


def test_a_joint_has_just_turned_for_a_milliradian_after_its_turn():
    t = np.arange(0.0, 6.0, 0.01)
    q = np.zeros((t.size, 2))
    q[:, 0] = 0.01 * np.abs(t - 2.0)  # turns at 2 s, and goes 0.01 rad a second
    q[:, 1] = 1e-3 * t
    q[100:200, 1] = q[100, 1]  # stands still, and goes on
    noisy = q + 2e-6 * np.random.default_rng(1).normal(size=q.shape)
    for motion in (JointMotion(t, q), JointMotion(t, noisy)):
        turned = just_turned(motion, t)
        assert not turned[:, 1].any()
        expected = (t >= 2.0) & (t < 2.1)
        assert (turned[:, 0] != expected).sum() <= 2
    assert not just_turned(JointMotion(t, q, None, True), t).any()  # stations


def played(q, width):
    """Return where a joint is behind a gap that it crosses, sample by sample."""
    out, at = np.empty_like(q), q[0]
    for k, value in enumerate(q):
        at = min(max(at, value - 0.5 * width), value + 0.5 * width)
        out[k] = at
    return out


def swinging(rng):
    """Return stamps and a motion of all joints."""
    t = np.arange(0.0, 40.0, 0.02)
    return t, HOME + 0.5 * np.sin(np.outer(t, rng.uniform(0.5, 1.3, 6)) + rng.uniform(0.0, 6.0, 6))


def fitted(robot, t, q, real, effect, rng):
    """Return an effect fitted to what an instrument sees of joints, and how well it does."""
    return fitted_to(robot, JointMotion(t, q), forward(robot, real)[:, :3, 3], effect, rng)


def fitted_to(robot, joints, places, effect, rng):
    """Return the same of places that the tool was at."""
    seen = Measurements(joints.t, places + rng.normal(scale=2e-5, size=places.shape))
    problem = Problem((Recording('free', joints, seen),))
    start = Model(robot, (robot.T_world_base,), (), (effect,))
    precision = effect_precision(start)
    scale = robust_scale(problem, problem.residuals(start))
    model = fit(problem, start, scale, precision).model
    residuals = problem.residuals(model)
    scale, floor = robust_scale(problem, residuals), noise_floor(problem, residuals)
    return problem, model, scale, precision, floor


def test_a_joint_that_shakes_is_not_taken_for_the_noise_of_the_instrument():
    """A link sticks and jumps from sample to sample: white as noise, but along one lever alone."""
    robot, rng = load('ur5'), np.random.default_rng(5)
    t, q = swinging(rng)
    jumps = 3e-4 * rng.uniform(-1.0, 1.0, (2, t.size))
    real, again = q.copy(), q.copy()
    real[:, 1] += jumps[0]
    again[:, 1] += jumps[1]
    made = fitted(robot, t, q, real, ZERO, rng)
    posterior = allowed(*made)
    assert np.flatnonzero(posterior.discrepancy.gears).tolist() == [1]
    twin, motion = made[1].twin(0), Recording('again', JointMotion(t, q))
    error = forward(robot, again)[:, :3, 3] - twin.poses(motion).position
    covariance = pose_covariances(posterior, twin, motion, t)[:, :3, :3]
    size = np.einsum('mi,mi->m', error, np.linalg.solve(covariance, error[..., None])[..., 0])
    assert 0.85 < (size < 6.251).mean() <= 1.0  # 90 % of chi squared with three freedoms
    assert np.sqrt(np.trace(covariance, axis1=1, axis2=2).mean()) < 2.0 * np.sqrt(
        (error**2).sum(axis=1).mean()
    )


def stopping(rng, gives):
    """
    Return stamps, a motion whose speed changes every second, and where a spring has the second joint.

    A mass on a spring of 12 Hz follows the joint, which it holds back as far as ``gives`` says.
    """
    fine, each = np.arange(0.0, 40.0, 1e-3), rng.uniform(-0.4, 0.4, (40, 6))
    speed = np.repeat(each - each.mean(axis=0), 1000, axis=0)
    ramp = np.ones(80) / 80.0  # a speed is reached in eight hundredths of a second
    speed = np.stack([np.convolve(v, ramp, 'same') for v in speed.T], axis=1)
    q = HOME + np.cumsum(speed, axis=0) * 1e-3
    pull, off, swing = np.gradient(speed[:, 1], 1e-3), np.zeros(fine.size), 0.0
    turn = 2.0 * np.pi * 12.0
    for k in range(1, fine.size):
        swing += 1e-3 * (-gives * turn**2 * pull[k] - turn**2 * off[k - 1] - 0.2 * turn * swing)
        off[k] = off[k - 1] + 1e-3 * swing
    real = q.copy()
    real[:, 1] += off
    return fine[::20], q[::20], real[::20]


def test_a_tool_that_swings_is_less_sure_where_joints_were_just_accelerated():
    robot, rng = load('ur5'), np.random.default_rng(11)
    t, q, real = stopping(rng, 6e-5)
    assert allowed(*fitted(robot, t, q, q, ZERO, rng)).discrepancy.swings == 0.0
    made = fitted(robot, t, q, real, ZERO, rng)
    posterior = allowed(*made)
    assert 6e-6 < posterior.discrepancy.swings < 6e-5
    # How far it strays on another motion is told, and where no joint changes its speed it does not.
    t, q, real = stopping(rng, 6e-5)
    twin, seen = made[1].twin(0), Recording('again', JointMotion(t, q))
    off = np.linalg.norm(forward(robot, real)[:, :3, 3] - twin.poses(seen).position, axis=1)
    features = Features(twin, seen, t)
    silent = replace(posterior, discrepancy=replace(posterior.discrepancy, swings=0.0))
    told, untold = (
        np.linalg.norm(each.drawn(features)[:, 0], axis=2) for each in (posterior, silent)
    )
    assert off.max() < np.quantile(told.max(axis=0), 0.95) < 1.5 * off.max()
    still = features.shaken.max(axis=1) < 0.2
    assert 0.2 < still.mean() < 0.9
    np.testing.assert_allclose(told[still].mean(), untold[still].mean(), rtol=0.05)
    assert np.median(told[~still]) > 1.3 * np.median(untold[~still])


def test_white_noise_hides_less_of_an_arm_than_chance_might():
    """A part of the noise may be the arm's as an error of its may be: next to nothing, most likely."""
    robot, every = load('ur5'), []
    for seed in reversed(range(5)):  # of two in ten some neighbours err alike by chance
        rng = np.random.default_rng(seed)
        t, q = swinging(rng)
        every.append(allowed(*fitted(robot, t, q, q, ZERO, rng)).discrepancy.position)
    hides, uneven = np.median(every), q.copy()
    uneven[:, 1] += 3e-5 * np.sin(150.0 * q[:, 1])  # finer than any wave or curve
    rest = allowed(*fitted(robot, t, q, uneven, ZERO, rng)).discrepancy
    shows = np.hypot(rest.position, 0.5 * rest.gears[1])
    # Of 2,000 samples with 20 um, 128 at a time, one standard error of a variance is (0.8 um)^2.
    assert 0.0 < hides**2 < 0.5 * 0.8e-6**2
    assert 3e-6 < shows < 3e-5  # 3e-5 rad at half a metre are 11 um RMS


def loose(robot, rng, count):
    """Return stations, and where a tool is that falls to its lower side by up to 0.2 mm."""
    q = HOME + rng.uniform(-0.6, 0.6, (count, 6))
    pose = forward(robot, q)
    fallen = 2e-4 * np.tanh(pose[:, 2, 0] / 0.1)
    return JointMotion(5.0 * np.arange(count), q, None, True), pose[:, :3, 3] + (
        fallen[:, None] * pose[:, :3, 0]
    )


def test_what_a_cause_without_a_name_leaves_of_stations_is_no_noise():
    """Lone stations do not tell what a model lacks from noise; that it lacks something does."""
    robot, held = load('ur5'), {False: [], True: []}
    for seed in range(4):
        rng = np.random.default_rng(seed)
        made = fitted_to(robot, *loose(robot, rng, 40), ZERO, rng)
        joints, places = loose(robot, rng, 300)
        twin, again = made[1].twin(0), Recording('again', joints)
        error = places - twin.poses(again).position
        for nameless, own in held.items():
            posterior = allowed(*made, nameless=nameless)
            covariance = pose_covariances(posterior, twin, again, joints.t)[:, :3, :3]
            size = np.einsum(
                'mi,mi->m', error, np.linalg.solve(covariance, error[..., None])[..., 0]
            )
            own.append((size < 6.251).mean())  # 90 % of chi squared with three freedoms
    assert np.mean(held[False]) < 0.9 < np.mean(held[True]) < 0.98


@pytest.mark.parametrize(
    ('law', 'sure'),
    [
        ({'effect': 'backlash', 'width': WIDTH}, True),
        ({'effect': 'friction', 'windup': 0.5 * WIDTH, 'travel': 0.7 * WIDTH}, False),
    ],
)
def test_a_law_of_lost_motion_that_does_not_hold_shows_where_joints_turn(law, sure):
    robot, rng = load('ur5'), np.random.default_rng(5)
    t, q = swinging(rng)
    real = q.copy()
    real[:, 2] = played(q[:, 2], WIDTH)
    effect = effect_from_mapping({**law, 'joint': 'elbow_joint'})
    turns = allowed(*fitted(robot, t, q, real, effect, rng)).discrepancy.turns
    assert not np.delete(turns, 2).any()
    # Any part of what is lost is as likely: the standard deviation of even chances over the gap.
    assert (turns[2] == pytest.approx(WIDTH / np.sqrt(3.0), rel=0.1)) is not sure
    if sure:  # as much as noise of 0.02 mm hides at half a metre
        assert 0.0 < turns[2] < 1e-4


def test_what_is_not_known_of_a_turn_counts_in_the_bound_of_goals_that_turn():
    robot, turns = load('ur5'), np.array([4e-4, 0.0, 0.0, 0.0, 0.0, 0.0])
    domain = Domain(robot.joint_names, (((-4.0, 4.0),),) * 6, (0.02,) * 6, (True,) * 6)
    rest = Discrepancy(1e-5, 1e-6, np.zeros(6), np.zeros(6), 1.0, turns)
    known = Posterior(Directions((), 1, ()), np.zeros(0), np.zeros((0, 0)), rest, domain)
    off = JointOffset('shoulder_lift_joint', 5e-4)
    t = np.linspace(0.0, 2.0, 21)
    q = np.tile(HOME, (21, 1))
    q[:, 0] += 0.1 * np.sin(0.25 * np.pi * t) ** 2
    sure = replace(known, discrepancy=replace(rest, turns=None))
    bounds = {}
    for came in (1.0, -1.0):
        start = Start(q[0], False, came * np.ones(6))
        for law, posterior in (('known', sure), ('open', known)):
            model = ProgramModel(robot, (off,), posterior)
            bounds[law, came] = corrected_goal(model, Goal(t, q), None, start).bound
    assert bounds['known', -1.0] == bounds['known', 1.0] == bounds['open', 1.0]
    lever = np.hypot(*forward(robot, HOME)[:2, 3])
    assert bounds['open', -1.0] == pytest.approx(1.645 * 4e-4 * lever, rel=0.1)
