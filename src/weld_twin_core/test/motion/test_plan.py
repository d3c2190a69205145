# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Planned motions of every bundled robot on every bundled seam."""

import tracemalloc

import numpy as np
import pytest
from drawn_robots import pinocchio_model

from weld_twin_core.arm import catalog
from weld_twin_core.arm.chain import forward
from weld_twin_core.errors import PathError
from weld_twin_core.motion.paths import KINDS, Torch, Weave, default_seam
from weld_twin_core.motion.planned_motion import plan
from weld_twin_core.motion.profiles import Constant, Smooth

EACH = [
    (name, kind)
    for k, name in enumerate(('ur5', 'abb_irb120', 'abb_irb1600', 'kuka_kr6_r900', 'fanuc_m10ia'))
    for kind in (KINDS if name == 'ur5' else (KINDS[k % 6], KINDS[(k + 3) % 6]))
]
"""One arm on every seam, and every build on two of them."""


@pytest.mark.parametrize(
    ('robot', 'kind'),
    [*EACH, ('ur10', 'weave'), ('franka_panda', 'weave'), ('franka_panda', 'spline')],
    indirect=['robot'],
)
def test_every_build_follows_bundled_seams_without_jumps(robot, kind):
    seam = default_seam(robot, kind)
    planned = plan(robot, seam, 'aggressive', 60.0, fit=True)
    q = planned.motion.q
    np.testing.assert_allclose(forward(robot, q), planned.poses, atol=1e-9)
    assert ((q >= robot.lower) & (q <= robot.upper)).all()
    steps = np.abs(np.diff(q, axis=0)) / np.diff(planned.motion.t)[:, None]
    assert (steps <= robot.max_velocity * 1.001).all()
    assert planned.s[0] == 0.0
    assert planned.s[-1] == pytest.approx(seam.length)
    np.testing.assert_allclose(planned.poses[:, :3, 3], planned.seam.position)


def test_joint_velocity_is_the_slope_of_the_positions(robot):
    seam = default_seam(robot, 'spline')
    planned = plan(robot, seam, Smooth(0.05), 500.0)
    q, t = planned.motion.q, planned.motion.t
    # Fourth-order central differences.
    slope = (8 * (q[3:-1] - q[1:-3]) - (q[4:] - q[:-4])) / (12 * (t[1] - t[0]))
    np.testing.assert_allclose(planned.motion.qd[2:-2], slope, atol=2e-6)


def test_the_aggressive_plan_reverses_the_joints_that_carry_the_seam():
    robot = catalog.load('ur5')
    planned = plan(robot, default_seam(robot), 'aggressive', 250.0)
    for joint in (0, 1, 2, 3):
        speed = planned.motion.qd[:, joint]
        direction = np.sign(speed[np.abs(speed) > 1e-4])
        assert (np.diff(direction) != 0).sum() >= 10


@pytest.mark.parametrize('name, joint', [('ur5', 4), ('abb_irb120', 3), ('kuka_kr6_r900', 3)])
def test_a_joint_the_seam_does_not_need_stays_exactly_at_rest(name, joint):
    robot = catalog.load(name)
    planned = plan(robot, default_seam(robot), 'aggressive')
    assert len(np.unique(planned.motion.q[:, joint])) == 1
    assert not planned.motion.qd[:, joint].any()


@pytest.mark.parametrize('name', ['ur5', 'ur10'])
def test_the_elbow_stays_above_the_table_the_arm_stands_on(name):
    robot = catalog.load(name)
    pin, model = pinocchio_model(robot)
    data = model.createData()
    for q in plan(robot, default_seam(robot)).motion.q[::100]:
        pin.forwardKinematics(model, data, q)
        assert min(data.oMi[joint].translation[2] for joint in range(1, 7)) >= 0.0


def test_the_same_place_on_the_seam_is_the_same_posture_each_time():
    robot = catalog.load('franka_panda')
    planned = plan(robot, default_seam(robot), 'aggressive')
    order = np.argsort(planned.s)
    s, q = planned.s[order], planned.motion.q[order]
    # Neighbours on the seam, visited at quite different times, are no farther apart than it takes.
    apart = np.abs(np.diff(q, axis=0)).max(axis=1)
    assert (apart <= 5.0 * np.diff(s) + 1e-9).all()


def test_too_fast_a_motion_is_refused_with_the_joint_the_place_and_the_limit():
    robot = catalog.load('ur5')
    sentence = (
        r"joint '\w+' would need a velocity of [\d.]+ rad/s at t = [\d.]+ s \([\d.]+ m along the "
        r'seam\), its limit is 3.14; slow the profile down'
    )
    with pytest.raises(PathError, match=sentence):
        plan(robot, default_seam(robot), Constant(3.0))


def test_too_abrupt_a_motion_is_refused_and_fitted_on_request():
    robot = catalog.load('ur5')
    seam = default_seam(robot, 'weave')
    with pytest.raises(PathError, match=r'would need an acceleration of [\d.]+ rad/s\^2'):
        plan(robot, seam, 'aggressive')
    fitted = plan(robot, seam, 'aggressive', fit=True)
    assert fitted.report.slowed > 1.0
    assert fitted.report.velocity_use.max() <= 1.0
    assert fitted.report.acceleration_use.max() <= 1.0
    rate = np.abs(np.gradient(fitted.motion.qd, fitted.motion.t, axis=0))
    assert (rate <= robot.max_acceleration).all()


def test_a_motion_within_the_limits_is_not_slowed():
    robot = catalog.load('abb_irb1600')
    planned = plan(robot, default_seam(robot), Smooth(0.02), fit=True)
    assert planned.report.slowed == 1.0
    assert planned.report.duration == pytest.approx(planned.length / 0.02, abs=0.01)


def test_a_leaning_torch_and_a_zigzag_are_followed():
    robot = catalog.load('fanuc_m10ia')
    seam = Weave(default_seam(robot), 0.003, 0.01, 'zigzag')
    planned = plan(robot, seam, Smooth(0.01), torch=Torch(work=0.4, travel=0.2))
    assert planned.report.residual < 1e-9
    wire = planned.poses[:, :3, 2]
    np.testing.assert_allclose((wire * planned.seam.tangent).sum(axis=1), np.sin(0.2), atol=1e-12)


def test_a_senseless_rate_is_refused():
    robot = catalog.load('ur5')
    with pytest.raises(PathError, match=r'sample rate must be positive, got 0\.0 Hz'):
        plan(robot, default_seam(robot), rate_hz=0.0)


@pytest.mark.parametrize(
    ('profile', 'rate'),
    [(Smooth(), 1e9), (Smooth(speed=1e-9), 1e5), (Constant(speed=1e-300), 1.0)],
)
def test_an_endless_motion_is_refused_before_it_takes_memory(profile, rate):
    robot = catalog.load('ur5')
    tracemalloc.start()
    try:
        with pytest.raises(PathError, match=r'would take .* samples, and 2,000,000 are the most'):
            plan(robot, default_seam(robot, 'line'), profile, rate)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 50e6


def test_a_seam_that_slows_down_endlessly_is_refused_where_it_would_pass_the_limit():
    robot = catalog.load('ur5')
    seam = default_seam(robot, 'line')
    whole = plan(robot, seam, Smooth(), 50.0, fit=True).motion.t.size
    assert plan(robot, seam, Smooth(), 50.0, fit=True, most_samples=whole).motion.t.size == whole
    with pytest.raises(PathError, match=f'and {whole - 2:,} are the most'):
        plan(robot, seam, Smooth(), 50.0, fit=True, most_samples=whole - 2)
