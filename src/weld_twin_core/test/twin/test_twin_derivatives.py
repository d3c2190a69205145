# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Derivatives of the poses by every parameter against central differences."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from usual_effects import usual

from weld_twin_core import Effect, JointMotion, Recording, Stage, Twin, effect_from_mapping
from weld_twin_core.effects import REGISTRY

CLOCKS = ('time_delay', 'clock_rate')
WITHOUT = {'quantization', 'measurement_noise'}
ENTRIES = usual(without=WITHOUT)
# How a payload moves the flank or the bend that a load lies on is a product, and not a small one.
FLANKS = {
    name
    for name, kind in REGISTRY.items()
    if (kind.of, kind.stage) == ('joint', Stage.LINK) and 'load' in kind.needs
}
SPRUNG = ('payload', 'hose_pull')  # they show through a spring
# No product of two of these displacements exists, so the sum of their derivatives is exact.
SEPARATE = ('joint_offset', 'link_length', 'link_twist', 'base_pose', 'tool_pose', 'gear_ratio')
SEPARATE += ('transmission_ripple', 'backlash', 'hysteresis', 'gear_ratio_by_direction')
SEPARATE += ('friction', 'servo_lag', 'vibration')


def effect(name, **more):
    return effect_from_mapping({'effect': name, **ENTRIES[name], **more})


def differences(robot, effects, recording, at):
    """
    Yield each component with the derivative of position and of orientation by it.

    The steps of one effect are draws of it; `test_twin` compares draws with a loop over them.
    """
    components = Twin(robot, tuple(effects)).components()
    for number, chosen in enumerate(effects):
        own = [each for each in components if each.effect == number]
        places = [(p.name, i) for p, i in chosen.components()]
        rows = np.tile(chosen.vector(), (2 * len(own), 1))
        for k, component in enumerate(own):
            place = places.index((component.parameter.name, component.index))
            rows[2 * k : 2 * k + 2, place] += np.array([1.0, -1.0]) * step_of(component)
        if own:
            drawn = [*effects[:number], chosen.with_vector(rows), *effects[number + 1 :]]
            poses = Twin(robot, tuple(drawn)).poses(recording, at)
        for k, component in enumerate(own):
            after, before = poses.rotation[2 * k], poses.rotation[2 * k + 1]
            spin = Rotation.from_matrix(after @ np.swapaxes(before, -1, -2)).as_rotvec()
            way = poses.position[2 * k] - poses.position[2 * k + 1]
            yield component, way / (2 * step_of(component)), spin / (2 * step_of(component))


def step_of(component):
    """Return the step of a central difference."""
    # A response rings through many periods, so it bends quickly with frequency.
    return component.parameter.typical * (1e-5 if component.parameter.unit == 'Hz' else 1e-4)


def worst(robot, effects, recording, at, relative, absolute=0.0):
    """
    Return the largest difference over what it may be, and the component that it is of.

    ``absolute`` [m] is what a derivative times the typical size may be off. The poses that come
    with derivatives are those without.
    """
    twin = Twin(robot, tuple(effects))
    poses, found = twin.linearise(recording, at)
    assert found.shape == (len(at), 6, len(twin.components()))
    np.testing.assert_array_equal(poses.position, twin.poses(recording, at).position)
    out = []
    for k, (component, position, spin) in enumerate(differences(robot, effects, recording, at)):
        name = f'{effects[component.effect].name} {component.parameter.name} {component.index}'
        room = absolute / component.parameter.typical
        scale = np.abs(position).max()
        moved = np.abs(found[:, :3, k] - position).max() / (relative * scale + room + 1e-9)
        allowed = relative * max(1.0, scale) + room + 1e-6
        turned = np.abs(found[:, 3:, k] - spin).max() / allowed
        out.append((max(moved, turned), name))
    return max(out)


@pytest.mark.parametrize('name', ENTRIES)
def test_derivative_by_every_parameter_alone(name, build, make_recording, stamps):
    recording = make_recording(build)
    effects = [effect(name)]
    if name in SPRUNG:
        effects.append(effect('joint_compliance'))
    excess, name = worst(build, effects, recording, stamps(recording), 2e-6)
    assert excess <= 1.0, name


@pytest.mark.parametrize(
    'other', [effect('servo_lag', damping=0.4), effect('backlash', form='coast')]
)
def test_derivative_of_other_forms(other, robot, make_recording, stamps):
    recording = make_recording(robot)
    excess, name = worst(robot, [other], recording, stamps(recording), 1e-5)
    assert excess <= 1.0, name


def test_derivatives_of_effects_together_are_exact(build, make_recording, stamps):
    recording = make_recording(build)
    # The delay sees all other joint motion through its velocity.
    effects = [effect(name) for name in SEPARATE]
    excess, name = worst(
        build, [*effects, effect('time_delay')], recording, stamps(recording), 2e-5
    )
    assert excess <= 1.0, name


def test_memory_effects_in_series_on_one_joint_pass_derivatives_on(arm, make_recording, stamps):
    recording = make_recording(arm)
    effects = [
        effect(name, joint='j1')
        for name in ('servo_lag', 'vibration', 'backlash', 'gear_ratio', 'transmission_ripple')
    ]
    excess, name = worst(arm, effects, recording, stamps(recording), 2e-5)
    assert excess <= 1.0, name


def smaller(chosen, share):
    """Return an effect with a share of its displacement."""
    linear = [p.linear for p, _ in chosen.components()]
    return chosen.with_vector(chosen.vector() * np.where(linear, share, 1.0))


@pytest.mark.parametrize('robot', ['standard', 'modified positioner'], indirect=True)
def test_all_effects_together_are_off_by_products_of_small_displacements_only(
    robot, make_recording, stamps
):
    """What is left out of a derivative is as large as the other effects are, and shrinks with them."""
    recording = make_recording(robot)
    effects = [effect(name) for name in ENTRIES if name not in FLANKS]
    (half, name), (eighth, _) = (
        worst(
            robot, [smaller(e, share) for e in effects], recording, stamps(recording), 5e-3, 2e-7
        )
        for share in (0.5, 0.125)
    )
    assert half <= 1.0 and eighth <= 0.3 * half, name


def test_while_a_wide_gap_is_crossed_the_derivative_stays_with_the_side_left(arm):
    t = np.linspace(0.0, 20.0, 1003)
    recording = Recording('slow', JointMotion(t, np.sin(t)[:, None] * np.ones(6)))
    excess, name = worst(arm, [effect('backlash', width=0.3)], recording, t, 1e-6)
    assert excess <= 1.0, name


def test_a_closed_gap_opens_to_the_side_it_trails(arm, make_recording, stamps):
    recording = make_recording(arm, 200)
    at = recording.joints.t
    tiny = 1e-7
    _, found = Twin(arm, (effect('backlash', width=0.0),)).linearise(recording, at)
    opened = Twin(arm, (effect('backlash', width=tiny),)).poses(recording, at).position
    nominal = Twin(arm).poses(recording, at).position
    np.testing.assert_allclose(found[..., :3, 0], (opened - nominal) / tiny, atol=1e-5)


@pytest.mark.parametrize('name', [name for name in ENTRIES if name not in CLOCKS])
def test_a_numerical_derivative_stands_in_for_a_missing_closed_form(name, arm, make_recording):
    twin = Twin(arm, (effect('joint_compliance'),))
    recording = make_recording(arm)
    memory = name in ('servo_lag', 'vibration', 'backlash')
    view = twin.joint_view(recording) if memory else twin.evaluate(recording).view
    closed, numerical = effect(name).gradient(view), Effect.gradient(effect(name), view)
    assert len(closed) == len(numerical)
    for ours, theirs in zip(closed, numerical, strict=True):
        assert (ours is None) == (theirs is None)
        for channel in ours or ():
            scale = np.abs(ours[channel]).max()
            np.testing.assert_allclose(
                theirs[channel],
                np.broadcast_to(ours[channel], theirs[channel].shape),
                atol=1e-5 * scale + 1e-8,
            )


def test_the_instants_of_the_joint_stamps_do_not_move_with_the_measurement_clock(
    arm, make_recording
):
    recording = make_recording(arm)
    _, found = Twin(arm, (effect('time_delay'), effect('joint_offset'))).linearise(recording)
    assert found.shape[-1] == 2
    assert not found[..., 0].any()
    assert found[..., 1].any()
