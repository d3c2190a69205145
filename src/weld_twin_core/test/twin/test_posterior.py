# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Covariances of predicted poses: against draws of whole models, and by hand."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from weld_twin_core import DataError, JointMotion, ModelError, Recording, Robot, Twin, load
from weld_twin_core.diagnosis.predicting.allowed import elsewhere
from weld_twin_core.diagnosis.result import Shrink
from weld_twin_core.effects import REGISTRY, Quantization, ToolSlip
from weld_twin_core.twin.directions import Directions, Discrepancy
from weld_twin_core.twin.domain import Domain
from weld_twin_core.twin.features import Features, shown
from weld_twin_core.twin.posterior import Posterior, expected_poses, pose_covariances


def motion(robot, count=5, seed=1):
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1.5, 1.5, (count, robot.n))
    return Recording('m', JointMotion(np.arange(float(count)), q, None, True))


def everywhere(robot):
    full = tuple(((-10.0, 10.0),) for _ in range(robot.n))
    turns = tuple(not slides for slides in robot.prismatic)
    return Domain(robot.joint_names, full, (0.02,) * robot.n, turns)


def certain(robot):
    return Discrepancy(0.0, 0.0, np.zeros(robot.n), np.zeros(robot.n), 0.1)


def posterior(robot, what, covariance, mean=None, discrepancy=None):
    mean = np.zeros(what.count) if mean is None else mean
    return Posterior(what, mean, covariance, discrepancy or certain(robot), everywhere(robot))


def drawn(robot, effects, steps, recording):
    """Poses of one model after another, each frame and effect moved: nothing is linearised."""
    out = []
    for step in steps:
        base, tool = np.array(robot.T_world_base), np.array(robot.T_flange_tool)
        base[:3, :3] = Rotation.from_rotvec(step[3:6]).as_matrix() @ base[:3, :3]
        base[:3, 3] += step[:3]
        tool[:3, :3] = tool[:3, :3] @ Rotation.from_rotvec(step[9:12]).as_matrix()
        tool[:3, 3] += step[6:9]
        moved, at = [], 12
        for effect in effects:
            now = effect.fit.coordinates()
            moved.append(effect.fit.with_coordinates(now + step[at : at + now.size]))
            at += now.size
        twin = Twin(robot.with_frames(base=base, tool=tool), tuple(moved))
        out.append(twin.poses(recording))
    return out


def test_the_covariance_is_that_of_poses_of_drawn_models():
    robot = load('ur5')
    joint = robot.joint_names
    effects = (
        REGISTRY['joint_offset'](joint[1], 1e-3),
        REGISTRY['link_twist'](joint[2], -5e-4),
        REGISTRY['joint_compliance'](joint[1], 2e-5),
        REGISTRY['transmission_ripple'](joint[0], [3e-4, 1e-4], [1.0, 2.0], [0.3, -1.0]),
    )
    what = Directions(('base', 'tool'), 1, effects)
    rng = np.random.default_rng(0)
    half = rng.normal(size=(what.count, what.count)) * 3e-4 / np.sqrt(what.count)
    half[14] *= 0.02  # a compliance is some 1e-5 rad/(N m)
    mean = 1e-4 * rng.normal(size=what.count)
    mean[14] *= 0.02
    recording = motion(robot)
    known, twin = posterior(robot, what, half @ half.T, mean), Twin(robot, effects)
    got = pose_covariances(known, twin, recording, recording.joints.t)
    expected, about = expected_poses(known, twin, recording, recording.joints.t)
    middle = Twin(robot, effects).poses(recording)
    # Either way along each column: points whose mean and covariance are exactly those given.
    reach = np.sqrt(what.count) * half.T
    steps = mean + np.vstack([reach, -reach])
    off = []
    for poses in drawn(robot, effects, steps, recording):
        turn = Rotation.from_matrix(poses.rotation) * Rotation.from_matrix(middle.rotation).inv()
        off.append(np.hstack([poses.position - middle.position, turn.as_rotvec()]))
    off = np.array(off)
    sampled = np.einsum('dmi,dmj->mij', off, off) / len(steps)
    shift = off.mean(axis=0)
    np.testing.assert_allclose(expected.position - middle.position, shift[:, :3], atol=1e-6)
    turn = Rotation.from_matrix(expected.rotation) * Rotation.from_matrix(middle.rotation).inv()
    np.testing.assert_allclose(turn.as_rotvec(), shift[:, 3:], atol=1e-6)
    spread = sampled - np.einsum('mi,mj->mij', shift, shift)
    for mine, theirs in [*zip(got, sampled, strict=True), *zip(about, spread, strict=True)]:
        size = np.sqrt(np.diag(theirs))
        assert np.abs((mine - theirs) / np.outer(size, size)).max() < 0.02


STILL = Recording('m', JointMotion(np.zeros(1), np.zeros((1, 1)), None, True))


def one_joint(reach, **tool):
    joints = [{'name': 'j', 'a': reach, 'alpha': 0.0, 'd': 0.0}]
    return Robot.from_mapping({'name': 'one', 'joints': joints, **tool})


def test_turns_are_about_the_fixed_axes_of_the_world():
    """A tool that lies on its side: its own z axis points along the world's x."""
    aside = {'xyz': [0.5, 0, 0], 'quat_xyzw': [0, np.sqrt(0.5), 0, np.sqrt(0.5)]}
    robot, what = one_joint(0.0, tool=aside), Directions(('tool',), 1, ())
    # 2 mrad about the tool's own z axis
    known = posterior(robot, what, np.diag([0.0, 0.0, 0.0, 0.0, 0.0, 4e-6]))
    (got,) = pose_covariances(known, Twin(robot), STILL, np.zeros(1))
    np.testing.assert_allclose(got, np.diag([0.0, 0.0, 0.0, 4e-6, 0.0, 0.0]), atol=1e-15)


def test_a_turn_of_the_base_moves_the_tool_by_its_lever():
    robot, what = one_joint(0.8), Directions(('base',), 2, ())
    # 1 mrad about z, of the second set-up
    known = posterior(robot, what, np.diag([*np.zeros(11), 1e-6]))
    (got,) = pose_covariances(known, Twin(robot), STILL, np.zeros(1), setup=1)
    wanted = np.zeros((6, 6))
    wanted[1, 1], wanted[5, 5], wanted[1, 5], wanted[5, 1] = 0.64e-6, 1e-6, 0.8e-6, 0.8e-6
    np.testing.assert_allclose(got, wanted, atol=1e-15)
    assert np.abs(pose_covariances(known, Twin(robot), STILL, np.zeros(1))).max() == 0.0
    with pytest.raises(ModelError, match='no base frame 2'):
        pose_covariances(known, Twin(robot), STILL, np.zeros(1), setup=2)


def test_a_joint_gives_when_it_is_accelerated_as_far_as_its_spring_lets_it():
    """A turn of the first joint by a swing of 1 rad and 2 rad/s moves the tool by its lever."""
    robot, give = load('ur5'), 3e-5
    t = np.linspace(0.0, 3.0, 1501)
    q = np.tile([0.0, -1.0, 1.2, -0.5, 0.3, 0.0], (t.size, 1))
    q[:, 0] = np.sin(2.0 * t)
    swing = Recording('swing', JointMotion(t, q))
    at = np.array([0.5, 1.1, 2.3])
    what = Directions((), 1, (), gives=robot.n)
    covariance = np.zeros((robot.n, robot.n))
    covariance[0, 0] = give**2
    known = posterior(robot, what, covariance)
    twin = Twin(robot)
    sigma = np.sqrt(
        np.trace(known.pose_covariance(Features(twin, swing, at))[:, :3, :3], axis1=1, axis2=2)
    )
    lever = np.linalg.norm(twin.poses(swing, at).position[:, :2], axis=1)
    assert sigma == pytest.approx(give * 4.0 * np.abs(np.sin(2.0 * at)) * lever, rel=1e-3)
    still = motion(robot)
    assert not known.pose_covariance(Features(twin, still, still.joints.t)).any()


def test_a_corner_of_a_motion_is_no_endless_acceleration():
    """A joint that sets out at 1 rad/s from one millisecond to the next: no spring follows so fast."""
    robot = load('ur5')
    t = np.arange(0.0, 2.0, 1e-3)
    q = np.tile([0.0, -1.0, 1.2, -0.5, 0.3, 0.0], (t.size, 1))
    q[:, 0] = np.maximum(t - 1.0, 0.0)
    corner = Features(Twin(robot), Recording('corner', JointMotion(t, q)), t)
    # One radian per second within six hundredths of a second.
    assert np.abs(corner.acceleration).max() == pytest.approx(1.0 / 0.06, rel=0.02)
    assert np.abs(corner.acceleration[np.abs(t - 1.0) > 0.1]).max() < 1e-6


def test_a_model_is_less_sure_the_farther_it_is_from_what_was_recorded():
    robot = load('ur5')
    narrow = tuple(((-0.5, 0.5),) for _ in range(6))
    domain = Domain(robot.joint_names, narrow, (0.02,) * 6, (True,) * 6)
    rest = Discrepancy(2e-5, 3e-5, np.zeros(6), np.full(6, 1e-4), 0.1)
    known = Posterior(Directions((), 1, ()), np.zeros(0), np.zeros((0, 0)), rest, domain)
    q = np.zeros((4, 6))
    q[:, 0] = [0.0, 0.52, 0.57, 2.0]
    still = Recording('m', JointMotion(np.arange(4.0), q, None, True))
    got = pose_covariances(known, Twin(robot), still, still.joints.t)
    np.testing.assert_allclose(
        got[0], np.diag(np.repeat([4e-10, 9e-10], 3)), rtol=1e-12, atol=1e-24
    )
    # Within the margin nothing but the gear's fine errors is added.
    np.testing.assert_allclose(got[1, 5, 5], 9e-10 + 0.2**2 * 1e-8, rtol=1e-9)
    # Half way beyond it, and beyond the reach: a turn about joint 1, which is the world's z. All is
    # half as large again there, and twice as large.
    np.testing.assert_allclose(got[2, 5, 5], 1.5**2 * (9e-10 + 0.7**2 * 1e-8), rtol=1e-9)
    np.testing.assert_allclose(got[3, 5, 5], 2.0**2 * (9e-10 + 1e-8), rtol=1e-9)
    np.testing.assert_allclose(got[3, 2, 2], 2.0**2 * 4e-10, rtol=1e-9)
    # Faster than anything recorded is as far outside, wherever the joints are.
    fast = Recording('m', JointMotion(np.arange(4.0), np.zeros((4, 6)), np.full((4, 6), 2.0)))
    slow = replace(known, domain=replace(domain, speeds=(0.5,) * 6))
    got = pose_covariances(slow, Twin(robot), fast, fast.joints.t)
    np.testing.assert_allclose(got[:, 2, 2], 2.0**2 * 4e-10, rtol=1e-9)


def test_effects_at_the_middle_move_the_tool_as_far_as_the_models_in_the_middle_do():
    robot, joint = load('ur5'), load('ur5').joint_names[1]
    found = (
        REGISTRY['link_twist'](joint, 4e-4),
        REGISTRY['transmission_ripple'](joint, 2e-4, 2.0, 0.3),
        REGISTRY['backlash'](joint, 5e-4),
    )
    wave = found[1].search.with_orders(np.array([1.0, 2.0]))
    kinds = (REGISTRY['joint_offset'](joint, 0.0), found[0], wave)
    what = Directions(('base', 'tool'), 2, kinds)
    known = posterior(robot, what, np.diag(np.full(what.count, 1e-10)))
    own = [3e-5, -2e-5, 1e-5, 2e-5, -1e-5, 3e-5]
    mean = np.concatenate([np.linspace(-4e-5, 4e-5, what.frame_count), own])
    known = replace(known, mean=mean, middle=0.5)
    effects, rest = known.centred(found, 1)
    np.testing.assert_allclose(rest.mean, 0.5 * mean, rtol=1e-9)
    assert found[2] in effects
    still = Recording('m', JointMotion(np.arange(7.0), np.linspace(-1.0, 1.0, 42).reshape(7, 6)))
    fitted = Twin(robot, found)
    features = Features(fitted, still, still.joints.t)
    foretold = 0.5 * np.tensordot(mean, what.columns(features, 1), axes=(0, 0))[:3].T
    moved = Twin(robot, effects).poses(still).position - fitted.poses(still).position
    np.testing.assert_allclose(moved, foretold, atol=2e-8)
    same, nothing = replace(known, middle=0.0).centred(found)
    assert (same, nothing.mean.tolist()) == (found, mean.tolist())


def test_a_covariance_that_cannot_be_is_refused():
    robot = load('ur5')
    what = Directions(('base',), 1, ())
    with pytest.raises(DataError, match='not symmetric'):
        posterior(robot, what, np.triu(np.ones((6, 6))))
    with pytest.raises(DataError, match='negative variance'):
        _ = posterior(robot, what, np.ones((6, 6)) - 0.5 * np.eye(6)).factor


def test_drawn_models_have_the_covariance_told_and_are_off_alike_along_a_path():
    robot = load('ur5')
    effects = (REGISTRY['joint_offset'](robot.joint_names[1], 1e-3),)
    what = Directions(('base', 'tool'), 1, effects)
    rng = np.random.default_rng(0)
    half = rng.normal(size=(what.count, what.count)) * 3e-4
    rest = Discrepancy(2e-4, 3e-4, np.full(6, 1e-4), np.full(6, 2e-4), 0.1)
    known = posterior(robot, what, half @ half.T, 2e-4 * rng.normal(size=what.count), rest)
    recording = motion(robot)
    seen = Features(Twin(robot, effects), recording, recording.joints.t)
    off = known.drawn(seen, count=20_000)[:, 0]
    sampled = np.einsum('mdi,mdj->mij', off, off) / off.shape[1]
    told = known.pose_covariance(seen)[:, :3, :3]
    for mine, theirs in zip(told, sampled, strict=True):
        size = np.sqrt(np.diag(mine))
        assert np.abs((mine - theirs) / np.outer(size, size)).max() < 0.04
    # A path that comes back to a posture comes back to what each model is off by there.
    back = Recording(
        'back', JointMotion(np.arange(10.0), np.tile(recording.joints.q, (2, 1)), None, True)
    )
    again = known.drawn(Features(Twin(robot, effects), back, back.joints.t))
    np.testing.assert_allclose(again[:5], again[5:], atol=1e-12)
    # Where no frame is fitted to it, the arm's own errors alone count.
    frames = np.zeros((what.count, what.count))
    frames[:12, :12] = 1e-6 * np.eye(12)
    of_frames = posterior(robot, what, frames)
    same, own = np.abs(of_frames.drawn(seen)).max(axis=(0, 2, 3))
    assert own == 0.0 and same > 1e-3


def test_a_motion_to_come_is_not_late_by_the_clock_of_the_instrument():
    robot = load('ur5')
    effects = (
        REGISTRY['joint_offset'](robot.joint_names[1], 1e-3),
        REGISTRY['time_delay'](0.0),
        REGISTRY['joint_offset'](robot.joint_names[2], 0.0),
    )
    what = Directions((), 1, effects)
    late = posterior(robot, what, np.diag([1e-8, 1e-4, 4e-8]))
    t = np.linspace(0.0, 1.0, 51)
    moving = Recording('m', JointMotion(t, np.outer(np.sin(3.0 * t), np.ones(6))))
    seen = Features(Twin(robot, effects), moving, t)
    bare = posterior(robot, Directions((), 1, effects[::2]), np.diag([1e-8, 4e-8]))
    told = late.of_the_arm().pose_covariance(seen)
    np.testing.assert_allclose(told, bare.pose_covariance(seen), rtol=1e-9, atol=1e-18)
    assert np.trace(late.pose_covariance(seen)[0, :3, :3]) > 100.0 * np.trace(told[0, :3, :3])


def test_a_tip_that_wore_while_it_was_recorded_does_not_wear_on_in_a_program():
    robot = load('ur5')
    zero, wear = REGISTRY['joint_offset'](robot.joint_names[1], 1e-3), REGISTRY['wear'](2e-6)
    what = Directions((), 1, (zero, wear))
    known = replace(posterior(robot, what, np.diag([1e-10, 1e-12, 1e-8])), middle=1.0)
    effects, _ = known.of_the_arm().centred((zero,), 0)
    assert [effect.name for effect in effects] == ['joint_offset']


def test_what_may_be_the_arms_instead_of_the_instruments_is_no_less_the_arms():
    """
    An instrument was found to read 60 ppm short where it is an upper arm that is too short.

    What is measured is the same either way. What the arm does on its own is not.
    """
    robot, scale = load('ur5'), 6e-5
    arm = REGISTRY['link_length'](robot.joint_names[1], 0.0)
    stretched = Recording('m', JointMotion(np.arange(2.0), np.zeros((2, 6))))
    seen = Features(Twin(robot, (arm,)), stretched, stretched.joints.t)
    short = -scale * (-0.425 - 0.39225)  # the two links of a UR5 lie along x of its base
    what = Directions((), 1, (REGISTRY['measurement_scale'](-scale), arm))
    allowed = posterior(robot, what, np.diag([1e-16, 1e-16]), np.array([scale, short]))
    for told, off in ((allowed, 0.0), (allowed.of_the_arm(), short)):
        np.testing.assert_allclose(told.drawn(seen)[0, 0, :, 0].mean(), off, atol=1e-7)


def test_the_size_of_one_of_two_that_take_each_other_s_place_is_known_given_the_other():
    robot = load('ur5')
    joint = robot.joint_names[2]
    zero, tilt = REGISTRY['joint_offset'](joint, 8e-4), REGISTRY['axis_parallelism'](joint, 0.0)
    what = Directions((), 1, (zero, tilt))
    rng = np.random.default_rng(0)
    # Models that hold the one or the other, or shares of both: their sum alone is measured.
    share, total = rng.uniform(size=4000), 8e-4 + 3e-5 * rng.normal(size=4000)
    steps = np.stack([share * total - 8e-4, (1.0 - share) * total], axis=1)
    known = posterior(robot, what, np.cov(steps.T), steps.mean(axis=0))
    assert known.doubt(zero)[0] > 3e-4
    assert known.doubt(zero, {('axis_parallelism', joint)})[0] == pytest.approx(3e-5, rel=0.3)
    assert known.doubt(zero, {('link_twist', joint)}) == known.doubt(zero)


def test_what_the_other_was_found_to_be_would_be_the_size_of_the_one():
    """All of 8e-4 was fitted as the tilt; were the zero at work in its place, it would be that large."""
    robot = load('ur5')
    joint = robot.joint_names[2]
    zero, tilt = REGISTRY['joint_offset'](joint, 0.0), REGISTRY['axis_parallelism'](joint, 8e-4)
    step = 3e-4 * np.random.default_rng(0).normal(size=4000)
    what = Directions((), 1, (zero, tilt))
    known = posterior(robot, what, np.cov(np.stack([step, -step])) + 1e-10 * np.eye(2))
    assert known.doubt(zero, {('axis_parallelism', joint)})[0] == pytest.approx(8e-4, rel=0.05)
    # Of the tilt, the zero being nothing, it is known as closely as it was measured.
    assert known.doubt(tilt, {('joint_offset', joint)})[0] < 3e-5


def test_on_a_path_a_tool_strays_as_far_as_a_stretch_of_the_recordings_did():
    robot = load('ur5')
    rest = Discrepancy(1e-5, 1e-5, np.zeros(6), np.zeros(6), 0.1, None, np.array([0.0, 1e-3]))
    known = posterior(robot, Directions((), 1, ()), np.zeros((0, 0)), None, rest)
    recording = motion(robot)
    seen = Features(Twin(robot), recording, recording.joints.t)
    off = np.linalg.norm(known.drawn(seen)[:, 0], axis=2)
    # Every other model strays, at one place each.
    assert np.all((off > 9e-4).sum(axis=0) == np.tile([0, 1], 200))


@pytest.mark.parametrize(
    ('law', 'count'),
    [
        (ToolSlip(xyz=[0.0, 3e-4, 0.0], time=2.05), 1),
        (Quantization('shoulder_pan_joint', 1e-3), 40),
    ],
)
def test_a_jump_comes_early_or_late_as_seldom_as_its_place_was_recorded_often(law, count):
    """Of count jumps after n that fitted, one is amiss with count / (count + n + 1): Laplace's rule."""
    robot = load('ur5')
    t = np.linspace(0.0, 4.0, 201)
    q = np.array([0.3, -1.2, 1.4, 0.2, 0.5, -0.3]) + 1e-2 * t[:, None] * np.eye(6)[0]
    recording = Recording('path', JointMotion(t, q))
    seen = Features(Twin(robot, [law]), recording, t)
    # An encoder that reads one step more has the tool so far around the first axis.
    x, y, _ = Twin(robot).poses(recording).position[0] - robot.T_world_base[:3, 3]
    moved = 3e-4 if count == 1 else 1e-3 * np.hypot(x, y)
    # One below the noise shows as little as it stands out of it.
    assert shown(seen, 1e-9) == count
    assert shown(seen, moved) == pytest.approx(count / 3.0, rel=2e-3)
    for before in (1.0, 400.0):
        rest = Discrepancy(0.0, 0.0, np.zeros(6), np.zeros(6), 1.0, jumps=before)
        known = posterior(robot, Directions((), 1, ()), np.zeros((0, 0)), discrepancy=rest)
        worst = np.linalg.norm(known.drawn(seen, count=4000)[:, 0], axis=2).max(axis=0)
        amiss = worst > 0.0
        assert amiss.mean() == pytest.approx(count / (count + before + 1.0), abs=0.025)
        assert np.quantile(worst[amiss], 0.1) == pytest.approx(moved, rel=2e-3)


def test_the_shrink_elsewhere_reaches_as_far_as_the_model_may_be_off_there():
    robot = load('ur5')
    known = replace(posterior(robot, Directions((), 1, ()), np.zeros((0, 0))), anywhere_m=4e-4)
    told = Shrink(1e-3, 3e-4, 0.3, (0.28, 0.32), 'stretches', elsewhere_ci95=(0.25, 0.35))
    assert elsewhere(told, known).elsewhere_ci95 == pytest.approx((0.25, 0.5))
    assert elsewhere(told, replace(known, anywhere_m=1e-5)).elsewhere_ci95 == (0.25, 0.35)


def test_coordinates_are_named_alike_whatever_else_is_fitted():
    offset, ripple = REGISTRY['joint_offset']('j2', 0.0), REGISTRY['transmission_ripple']('j2')
    wave = ripple.search.with_orders(np.array([1.0, 2.5]))
    coupled = REGISTRY['joint_coupling']('j3', 'j2', 0.0)
    what = Directions(
        ('base', 'tool'), 2, (offset, wave, coupled), (np.zeros(0), np.array([-0.5, 0.0, 0.5])), 2
    )
    axes = ('x', 'y', 'z', 'turn_x', 'turn_y', 'turn_z')
    frames = [f'{frame}.{axis}' for frame in ('base 0', 'base 1', 'tool') for axis in axes]
    assert what.names() == [
        *frames,
        'joint_offset j2 0',
        *(f'transmission_ripple j2 {wave}' for wave in ('1 sin', '1 cos', '2.5 sin', '2.5 cos')),
        'joint_coupling j3<j2 0',
        'give of joint 1',
        'give of joint 2',
        *(f'curve of joint 2 at {place} by 0.5' for place in ('-0.500', '0.000', '0.500')),
    ]
    assert len(what.names()) == what.count
