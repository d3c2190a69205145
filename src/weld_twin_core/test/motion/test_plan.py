# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Time laws, and planned motions of every build on bundled seams."""

import tracemalloc
from itertools import pairwise

import numpy as np
import pytest
from drawn_robots import pinocchio_model
from scipy.integrate import cumulative_trapezoid, quad

from weld_twin_core import PathError, catalog, default_seam, forward, plan
from weld_twin_core.motion.paths import KINDS, Torch, Weave
from weld_twin_core.motion.profiles import (
    PROFILES,
    Aggressive,
    Constant,
    SCurve,
    Smooth,
    Trapezoid,
    named,
)

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


LENGTHS = (0.5, 0.01, 1e-4)


@pytest.mark.parametrize('length', LENGTHS)
@pytest.mark.parametrize('name', PROFILES)
def test_speed_integrates_to_the_way_and_acceleration_to_the_speed(name, length):
    law = named(name).law(length)
    breaks = law.x
    way = sum(quad(law.derivative(), a, b)[0] for a, b in pairwise(breaks))
    assert way == pytest.approx(length, rel=1e-9)
    assert law(breaks[-1]) == pytest.approx(length, rel=1e-12)
    # Dense, so the trapezoidal rule is exact to the jumps of the acceleration.
    timing = named(name).sample(length, breaks[-1] / 200_000)
    speed = timing.sd[0] + cumulative_trapezoid(timing.sdd, timing.t, initial=0.0)
    np.testing.assert_allclose(speed[:-2], timing.sd[:-2], atol=1e-3 * timing.sd.max())


@pytest.mark.parametrize('length', LENGTHS)
@pytest.mark.parametrize('name', PROFILES)
def test_samples_are_even_and_end_at_the_end(name, length):
    timing = named(name).sample(length, 0.004)
    np.testing.assert_allclose(np.diff(timing.t), 0.004)
    assert timing.s[0] == 0.0
    assert timing.s[-1] == pytest.approx(length, rel=1e-12)
    assert timing.s.min() >= -1e-12
    assert timing.s.max() <= length * (1 + 1e-12)


def test_a_trapezoid_takes_the_hand_time_and_a_short_one_never_cruises():
    # 0.1 s up, 0.4 m at 1 m/s, 0.1 s down.
    law = Trapezoid(1.0, 10.0).law(0.5)
    assert law.x[-1] == pytest.approx(0.6)
    assert law(0.1) == pytest.approx(0.05)
    # Triangle: peak sqrt(a L) = 0.1 m/s, 2 x 0.1 s.
    law = Trapezoid(1.0, 1.0).law(0.01)
    assert law.x[-1] == pytest.approx(0.2)
    assert law(0.1, 1) == pytest.approx(0.1)


@pytest.mark.parametrize('length', [1.0, 0.05, 0.002])
@pytest.mark.parametrize('speed, acceleration, jerk', [(0.1, 0.5, 5.0), (0.1, 5.0, 5.0)])
def test_an_s_curve_keeps_speed_acceleration_and_jerk(length, speed, acceleration, jerk):
    law = SCurve(speed, acceleration, jerk).law(length)
    t = np.linspace(0.0, law.x[-1], 5001)
    assert law(t, 1).max() <= speed * (1 + 1e-9)
    assert law(t, 1).min() >= -1e-9
    assert np.abs(law(t, 2)).max() <= acceleration * (1 + 1e-9)
    inside = t[~np.isclose(t[:, None], law.x, atol=1e-9).any(axis=1)]
    assert np.abs(law(inside, 3)).max() <= jerk * (1 + 1e-9)
    # Acceleration has no step, and the ends are at rest.
    before, after = law(law.x[1:-1] - 1e-9, 2), law(law.x[1:-1] + 1e-9, 2)
    np.testing.assert_allclose(before, after, atol=1e-6)
    np.testing.assert_allclose(law(law.x[[0, -1]], 1), 0.0, atol=1e-9)


def test_the_smooth_law_is_at_rest_at_both_ends_and_peaks_at_15_8_of_the_mean():
    law = Smooth(0.02).law(0.3)
    np.testing.assert_allclose([law(x, k) for x in law.x for k in (1, 2)], 0.0, atol=1e-15)
    assert law(law.x[-1] / 2, 1) == pytest.approx(0.02 * 15 / 8)


def test_the_aggressive_law_turns_where_told_at_its_acceleration():
    # Three advances of 0.1 m, of which the first two go 0.05 m too far and come back.
    timing = Aggressive(0.3, 3.0, reversals=4, back=0.5).sample(0.3, 1e-4)
    turns = np.flatnonzero(np.diff(np.sign(timing.sd[1:-1])) != 0) + 1
    turns = turns[np.append(np.diff(turns) > 1, True)]
    np.testing.assert_allclose(timing.s[turns], [0.15, 0.1, 0.25, 0.2], atol=1e-6)
    assert np.abs(timing.sd).max() <= 0.3 + 1e-12
    assert np.abs(timing.sdd).max() == pytest.approx(3.0)


@pytest.mark.parametrize(
    'make, sentence',
    [
        (lambda: Smooth(-1.0), 'smooth profile: speed must be a positive number, got -1.0'),
        (
            lambda: SCurve(jerk=float('inf')),
            'scurve profile: jerk must be a positive number, got inf',
        ),
        (lambda: Aggressive(back=1.5), 'aggressive profile: back must be at most 1, got 1.5'),
        (lambda: named('quick'), "no profile is called 'quick'; there are constant, trapezoid"),
    ],
)
def test_a_wrong_profile_is_refused(make, sentence):
    with pytest.raises(PathError, match=sentence):
        make()
