# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The twin in bulk, live and over draws: three roads to the same poses."""

from dataclasses import FrozenInstanceError, dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from usual_effects import usual

from weld_twin_core.arm.robot import Robot
from weld_twin_core.effects import (
    REGISTRY,
    Effect,
    MemoryEffect,
    Parameter,
    Stage,
    View,
    effect_from_mapping,
    effects_from_list,
    register,
)
from weld_twin_core.errors import DataError, ModelError
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.twin import Twin


def effect(name, **values):
    return effect_from_mapping({'effect': name, **values})


def everything():
    """Return every kind of effect that acts without the measurement clock, some twice."""
    return (
        effect('servo_lag', joint='j1', time_constant=0.02),
        effect('servo_lag', joint='j2', time_constant=0.05, damping=0.4),
        effect('vibration', joint='j1', frequency=5.0, damping=0.1, gain=0.4),
        effect('hysteresis', joint='j3', amplitude=2e-3, travel=0.05),
        effect('friction', joint='j3', windup=2e-3, asymmetry=0.2, travel=0.05),
        effect('backlash', joint='j1', width=2e-3),
        effect('backlash', joint='j2', width=1e-3),
        effect('backlash', joint='j2', width=3e-2),
        effect('backlash', joint='j0', width=1e-3, form='reversal'),
        effect('gear_ratio', joint='j0', scale=1e-3),
        effect('quantization', joint='j3', step=1e-3),
        effect('joint_compliance', joint='j1', compliance=1e-5),
        effect('payload', mass=2.0, com=[0.0, 0.0, 0.1]),
        effect('tool_pose', xyz=[1e-3, 0, 0], rotvec=[0, 1e-2, 0]),
        effect('thermal_growth', coefficient=1e-5),
        effect('drift', xyz_rate=[1e-5, 0, 0]),
        effect('cartesian_compliance', compliance=[1e-6, 1e-6, 1e-6]),
        effect('measurement_scale', scale=1e-4),
        effect('measurement_noise', sigma=1e-4),
    )


def test_live_steps_give_the_poses_of_the_batch(build, make_recording):
    recording = make_recording(build)
    twin = Twin(build, everything())
    batch, joints, live = twin.poses(recording), twin.joints(recording), twin.live()
    for k, t in enumerate(recording.joints.t):
        found, pose = live.step(
            t,
            recording.joints.q[k],
            recording.joints.qd[k],
            recording.wrench.at(t),
            float(recording.temperature.at(t)),
        )
        np.testing.assert_allclose(found, joints[k], atol=1e-12)
        np.testing.assert_allclose(pose.position, batch.position[k], atol=1e-12)
        np.testing.assert_allclose(pose.rotation, batch.rotation[k], atol=1e-12)


MEMORY = {
    'play': effect('backlash', joint='j2', width=0.2),
    'reversal': effect('backlash', joint='j2', width=0.2, form='reversal'),
    'lag': effect('servo_lag', joint='j2', time_constant=0.05),
    'vibration': effect('vibration', joint='j2', frequency=3.0, damping=0.05, gain=0.5),
}
joint_angle = st.floats(-3, 3).map(lambda x: round(x, 2))


@pytest.mark.parametrize('name', MEMORY)
@settings(max_examples=40, deadline=None)
@given(
    samples=st.lists(st.tuples(st.floats(1e-3, 2.0), joint_angle), min_size=1, max_size=40),
    cuts=st.lists(st.integers(1, 40), max_size=6),
)
def test_a_motion_in_pieces_is_the_motion_in_one(name, samples, cuts):
    memory, robot = MEMORY[name], _six_joints()
    steps, angles = np.array(samples).T
    t, q = np.cumsum(steps), np.zeros((len(samples), 6))
    q[:, 2] = angles
    whole = memory.run(View(robot, t, t, q, 0 * q))[0]['q', 2]
    state, parts = None, []
    for index in np.split(np.arange(len(t)), sorted({c for c in cuts if c < len(t)})):
        view = View(robot, t[index], t[index], q[index], 0 * q[index])
        shift, state = memory.run(view, state)
        parts.append(shift['q', 2])
    np.testing.assert_allclose(np.concatenate(parts), whole, atol=1e-9)


def _six_joints():
    return Robot.from_mapping({'joints': [{'name': f'j{i}'} for i in range(6)]})


DRAWN = usual()


@pytest.mark.parametrize(
    ('robot', 'draws'),
    [
        ('modified gantry', 4),  # three would be as many as coordinates, and a mix-up unnoticed
        ('positioner', 3),  # which must be no mix-up either
    ],
    indirect=['robot'],
)
@pytest.mark.parametrize('name', DRAWN)
def test_draws_of_an_effect_are_a_loop_over_draws(name, robot, draws, make_recording, stamps):
    """Compare draws of an effect that are taken together with one after the other."""
    recording, one = make_recording(robot, 25), effect(name, **DRAWN[name])
    values = one.vector() * np.linspace(0.4, 1.0, draws)[:, None]
    drawn = one.with_vector(values)
    np.testing.assert_array_equal(drawn.vector(), values)
    # The fellows look at time, wrench and temperature, and have memory before and after.
    fellows = (
        effect('servo_lag', joint='j1', time_constant=0.02),
        effect('joint_compliance', joint='j1', compliance=1e-5),
        effect('cartesian_compliance', compliance=[1e-5, 2e-5, 3e-5]),
        effect('thermal_growth', coefficient=1e-4),
        effect('drift', xyz_rate=[1e-3, 0, 0]),
    )
    for at in (None, stamps(recording)):
        twin = Twin(robot, (*fellows, drawn))
        together = twin.poses(recording, at)
        count = len(recording.joints.t if at is None else at)
        assert together.position.shape == (draws, count, 3)
        assert together.rotation.shape == (draws, count, 3, 3)
        for k in range(draws):
            alone = Twin(robot, (*fellows, one.with_vector(values[k]))).poses(recording, at)
            np.testing.assert_allclose(together.position[k], alone.position, atol=1e-13)
            np.testing.assert_allclose(together.rotation[k], alone.rotation, atol=1e-13)


def test_derivatives_of_draws_are_a_loop_over_draws(arm, make_recording, stamps):
    recording = make_recording(arm)
    singles = [
        (effect(name, **DRAWN[name]))
        for name in ('backlash', 'servo_lag', 'payload', 'joint_compliance', 'base_pose')
    ]
    factors = np.linspace(0.4, 1.0, 3)
    drawn = [one.with_vector(one.vector() * factors[:, None]) for one in singles]
    _, together = Twin(arm, tuple(drawn)).linearise(recording, stamps(recording))
    for k, factor in enumerate(factors):
        alone = [one.with_vector(one.vector() * factor) for one in singles]
        _, expected = Twin(arm, tuple(alone)).linearise(recording, stamps(recording))
        np.testing.assert_allclose(together[k], expected, rtol=1e-9, atol=1e-12)


def test_draws_that_do_not_fit_together_are_refused(arm):
    first = effect('joint_offset', joint='j1').with_vector(np.zeros((3, 1)))
    second = effect('joint_offset', joint='j2').with_vector(np.zeros((4, 1)))
    with pytest.raises(ModelError, match=r'different numbers of draws: \[3, 4\]'):
        Twin(arm, (first, second))


def test_order_of_effects_does_not_matter_across_stages(build, make_recording, stamps):
    recording = make_recording(build)
    effects = [e for e in everything() if e.name != 'backlash']
    at = stamps(recording)
    forth = Twin(build, tuple(effects)).poses(recording, at)
    last_stage_first = sorted(effects, key=lambda e: -e.stage)
    back = Twin(build, tuple(last_stage_first)).poses(recording, at)
    np.testing.assert_allclose(forth.position, back.position, atol=1e-15)


def test_live_memory_survives_a_change_of_effects_and_not_a_reset(arm):
    gap = effect('backlash', joint='j1', width=0.2)
    live = Twin(arm, (gap,)).live()
    up, down = np.full(6, 1.0), np.full(6, 0.95)
    live.step(0.0, np.zeros(6))
    assert live.step(1.0, up)[0][1] == pytest.approx(0.9)
    live.twin = Twin(arm, (effect('joint_offset', joint='j0', offset=0.1), gap))
    joints, _ = live.step(2.0, down)
    np.testing.assert_allclose(joints[:2], [1.05, 0.9])
    live.reset()
    assert live.step(0.0, down)[0][1] == pytest.approx(0.95)


def test_live_refuses_to_go_back_in_time_or_to_count_joints_wrong(arm):
    live = Twin(arm).live()
    live.step(2.0, np.zeros(6))
    with pytest.raises(DataError) as error:
        live.step(1.5, np.zeros(6))
    assert str(error.value) == (
        'the joint state at 1.500000 s is 0.5 s before the one already seen; '
        'reset the twin after a jump back in time'
    )
    with pytest.raises(DataError, match=r"^robot 'ur5' needs 6 joint positions, got \(5,\)$"):
        live.step(3.0, np.zeros(5))


@dataclass(frozen=True, eq=False)
class Sagging(Effect):
    """A user's own effect: the tool sinks with its height, steeply."""

    depth: object = 0.0

    name = 'sagging_test'
    of = 'robot'
    stage = Stage.POSE
    parameters = (Parameter('depth', '1/m', typical=1e-3),)

    def displace(self, view):
        return {('pose', 2): -self.number('depth') * view.frames.position[..., 2] ** 2}


@pytest.fixture
def registered():
    """Register effects for one test only."""
    known = dict(REGISTRY)
    yield register
    REGISTRY.clear()
    REGISTRY.update(known)


def test_an_effect_of_the_users_own_works_like_a_bundled_one(
    registered, arm, make_recording, stamps
):
    registered(Sagging)
    (mine,) = effects_from_list([{'effect': 'sagging_test', 'depth': 1e-2}], arm)
    recording = make_recording(arm)
    at = stamps(recording)
    nominal = Twin(arm).poses(recording, at).position
    poses, found = Twin(arm, (mine,)).linearise(recording, at)
    np.testing.assert_allclose(
        poses.position[:, 2], nominal[:, 2] - 1e-2 * nominal[:, 2] ** 2, atol=1e-15
    )
    np.testing.assert_allclose(found[:, 2, 0], -(nominal[:, 2] ** 2), atol=1e-9)
    assert mine.to_mapping() == {'effect': 'sagging_test', 'depth': 1e-2}


def test_registering_makes_the_frozen_dataclass_that_an_effect_is(registered):
    @registered
    class Sinking(Sagging):
        depth: float = 2e-3
        name = 'sinking_test'

    assert Sinking(1e-3).depth == 1e-3
    assert Sinking().depth == 2e-3
    with pytest.raises(FrozenInstanceError):
        Sinking().depth = 0.0
    before = vars(Sagging)['__init__']
    assert registered(Sagging) is Sagging
    assert vars(Sagging)['__init__'] is before


def test_registering_what_breaks_the_contract_is_refused(registered):
    registered(Sagging)
    with pytest.raises(ModelError, match=r"^an effect named 'backlash' is registered already$"):
        registered(type('Other', (Sagging,), {'name': 'backlash'}))
    with pytest.raises(ModelError, match='acts in stage PLAY, which runs in order of time'):
        registered(type('Sagging', (Sagging,), {'name': 'x', 'stage': Stage.PLAY}))
    with pytest.raises(ModelError, match=r"^effect 'x' is a spring in a joint; name its"):
        registered(type('Sagging', (Sagging,), {'name': 'x', 'stage': Stage.ELASTIC}))
    parameters = (Parameter('height', 'm'),)
    with pytest.raises(ModelError, match=r"^effect 'x' declares 'height' but has no such field$"):
        registered(type('Sagging', (Sagging,), {'name': 'x', 'parameters': parameters}))
    assert issubclass(REGISTRY['backlash'], MemoryEffect)


@pytest.mark.parametrize('count', [1, 2, 3])
def test_the_shortest_recordings_work_with_every_effect(arm, count):
    q = np.linspace(0.0, 0.1, count)[:, None] * np.ones(6)
    recording = Recording('short', JointMotion(np.arange(count) * 0.1, q))
    effects = [e for e in everything() if e.name != 'thermal_growth']
    poses, found = Twin(arm, tuple(effects)).linearise(recording, np.array([-1.0, 0.05, 9.0]))
    assert np.isfinite(poses.position).all()
    assert np.isfinite(found).all()
