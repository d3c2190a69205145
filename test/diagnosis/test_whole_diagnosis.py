# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole engine on recordings of the independent plant, whose flaws are known."""

import gc

import numpy as np
import pytest
from diagnosis_cells import SIGMA, recorded, shaken, sites, solved
from small_arm import small_arm

from weld_twin_core import JointMotion, Measurements, Recording, Twin, default_seam, plan
from weld_twin_core.arm.catalog import load
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.diagnosis.algebra.fit import Fit
from weld_twin_core.effects import AxisCompliance, BearingTilt, JointOffset, ServoLag, ToolSag

SINGLE = {
    'backlash': dict(joint='elbow_joint', width=8e-4),
    'servo_lag': dict(joint='elbow_joint', time_constant=8e-3),
    'joint_offset': dict(joint='elbow_joint', offset=-6e-4),  # away from where the load pulls
    'time_delay': dict(delay=6e-3),
    'tool_pose': dict(xyz=(4e-4, -3e-4, 2e-4), rotvec=(6e-4, 0.0, -8e-4)),
    'joint_compliance': dict(joint='shoulder_lift_joint', compliance=1.2e-5),
}
AT_REST = {'joint_compliance': {'static': 60}}
"""What is seen at stations; of what moves alone a path tells."""
FLOOR = np.sqrt(3.0) * SIGMA


def flaw(name, **values):
    """Return an effect as a key of `solved`."""
    return (name, *(item for pair in values.items() for item in pair))


def near(found, truth):
    """Return whether every parameter is within four standard errors and 2 % of the truth."""
    entry = found.as_dict()
    return {
        key: bool(
            np.all(
                np.abs(np.asarray(entry['parameters'][key]) - value)
                <= 4.0 * np.asarray(entry['std'].get(key, 0.0)) + 0.02 * np.max(np.abs(value))
            )
        )
        for key, value in truth.items()
        if key != 'joint'
    }


@pytest.mark.parametrize('name', SINGLE)
def test_a_single_cause_is_named_on_its_joint_with_its_size(name):
    truth = SINGLE[name]
    answer = solved(flaw(name, **truth), **AT_REST.get(name, {}))
    assert answer.status == 'identified', answer.reasons
    assert sites(answer) == [{(name, truth.get('joint'))}]
    (found,) = answer.effects
    right = near(found, truth)
    assert all(right.values()), (right, found.as_dict())
    assert answer.causes[0].place[0][0] == found.effect.at
    assert answer.causes[0].dependence[0][0] == found.effect.on
    assert answer.confidence > 0.9
    assert answer.shrink.rms_after_m == pytest.approx(FLOOR, rel=0.1)


def test_a_large_wobble_with_a_high_spot_is_one_cause():
    robot, rng = small_arm(), np.random.default_rng(5)
    t = np.arange(0.0, 40.0, 0.05)
    q = 1.2 * np.sin(2.0 * np.pi * (0.05 + 0.013 * np.arange(3)) * t[:, None]) + [0, -1, 1]
    wobble = BearingTilt('shoulder_pan_joint', (5e-4, 2e-4, 0.0, 1e-4), (4e-5, -3e-5, 0.0, 2e-5))
    moved = Recording('run', JointMotion(t, q))
    seen = Twin(robot, [wobble]).poses(moved)
    position = seen.position + SIGMA * rng.normal(size=seen.position.shape)
    answer = diagnose(moved.with_measured(Measurements(t, position)), robot, experiment=False)
    assert sites(answer) == [{('bearing_tilt', 'shoulder_pan_joint')}], answer.reasons
    assert answer.effects[0].effect.second == pytest.approx([4e-5, -3e-5, 0.0, 2e-5], abs=6e-6)


@pytest.mark.parametrize(
    'cause',
    [
        AxisCompliance('lbr_A3', 5e-6),
        ToolSag(2e-4 * np.array([1.0, 0.2, 0.0, 0.1, 0.7, -0.3, 0.0, -0.4, 0.1])),
    ],
    ids=lambda cause: cause.name,
)
def test_what_gives_across_an_axis_and_at_the_tool_is_no_error_of_other_joints(cause):
    robot, rng = load('kuka_iiwa14'), np.random.default_rng(3)
    q = np.array([0.3, 0.7, 0.2, -1.2, 0.4, 0.9, 0.2]) + rng.uniform(-0.9, 0.9, (60, 7))
    stations = Recording('stations', JointMotion(np.arange(60.0), q, static=True))
    seen = Twin(robot, [cause, JointOffset('lbr_A4', 8e-4)]).poses(stations).position
    measured = Measurements(stations.joints.t, seen + SIGMA * rng.normal(size=seen.shape))
    answer = diagnose(stations.with_measured(measured), robot, align='base,tool', experiment=False)
    named = sites(answer)
    assert {(cause.name, cause.site)} in named and len(named) == 2, (named, answer.reasons)
    assert any(('joint_offset', 'lbr_A4') in group for group in named)
    assert all(one.probability > 0.9 for one in answer.causes if one.effect is not None)


@pytest.mark.parametrize('measured', [True, False])
def test_growth_with_warmth_is_named_on_another_kind_of_arm(measured):
    curve = {} if measured else {'rise': 10.0, 'time_constant': 3.0}
    growth = flaw('thermal_growth', coefficient=5e-5, **curve)
    answer = solved(growth, robot='kuka_kr6_r900', warm=measured)
    assert sites(answer) == [{('thermal_growth', None)}]
    assert answer.effects[0].effect.on == ('temperature' if measured else 'time')
    sizes = {'coefficient': 5e-5} if measured else {'coefficient': 5e-5, 'warming_time': 3.0}
    assert all(near(answer.effects[0], sizes).values())


def test_without_a_flaw_nothing_is_named():
    answer = solved()
    assert (answer.status, answer.effects, answer.indistinguishable) == ('none', (), ())
    assert answer.gap.rms_m == pytest.approx(FLOOR, rel=0.1)
    assert answer.gap.noise_floor_m == pytest.approx(FLOOR, rel=0.1)
    assert answer.contributions is None  # there is nothing to be thought away
    assert answer.shrink.ratio == pytest.approx(1.0, abs=0.02)


def test_a_cause_taken_out_of_the_library_stays_unknown_and_nothing_stands_in_for_it():
    play = flaw('backlash', joint='elbow_joint', width=1.5e-3)
    answer = solved(play, exclude=('backlash',))
    assert answer.status == 'unknown'
    assert answer.effects == ()
    assert answer.unexplained.above_noise
    assert any('elbow_joint' in name for name in answer.unexplained.structure)
    assert answer.absent['backlash'] == 'excluded by the user'
    assert not any(c.site.effect == 'backlash' for c in answer.candidates)


def test_offsets_of_parallel_links_are_named_together():
    # axes 2, 3 and 4 of this arm are parallel: their d values do exactly the same
    answer = solved(flaw('link_offset', joint='elbow_joint', dd=4e-4), robot='ur5')
    parallel = {('link_offset', f'{j}_joint') for j in ('shoulder_lift', 'elbow', 'wrist_1')}
    assert answer.status == 'ambiguous'
    assert sites(answer) == [parallel]
    (found,) = answer.effects
    assert all(near(found, {'dd': 4e-4}).values())


def test_an_offset_of_the_first_joint_and_a_turn_of_the_base_are_named_together():
    answer = solved(flaw('base_pose', xyz=(0.0, 0.0, 0.0), rotvec=(0.0, 0.0, 5e-4)))
    assert answer.status == 'ambiguous'
    (group,) = sites(answer)
    assert {('joint_offset', 'shoulder_pan_joint'), ('base_pose', None)} <= group
    (found,) = answer.effects
    assert (found.effect.name, found.effect.site) in group


def test_positions_alone_are_enough_for_play():
    truth = dict(joint='elbow_joint', width=8e-4)
    answer = solved(flaw('backlash', **truth), orientation=False)
    assert sites(answer) == [{('backlash', 'elbow_joint')}]
    assert all(near(answer.effects[0], truth).values())
    assert answer.gap.orientation_rms_rad is None


def test_what_stands_in_for_two_causes_gives_way_once_one_of_them_is_found():
    """On this seam friction of joint_a5 fits best alone, and no machine has it beside the lag."""
    robot = load('kuka_kr16_2')
    seam = plan(robot, default_seam(robot, 'weave'), 'aggressive', rate_hz=50.0, fit=True)
    commanded = Recording('seam', seam.motion)
    flaws = [ServoLag('joint_a2', time_constant=6e-3), JointOffset('joint_a5', offset=1.1e-3)]
    real = Twin(robot, flaws).poses(commanded)
    rng = np.random.default_rng(21)
    position = real.position + rng.normal(scale=3e-5, size=real.position.shape)
    turned = shaken(real.rotation, 3e-5, rng)
    measured = Measurements(seam.motion.t, position, turned)
    answer = diagnose(commanded.with_measured(measured), robot, experiment=False)
    assert {(e.effect.name, e.effect.site) for e in answer.effects} == {
        ('servo_lag', 'joint_a2'), ('joint_offset', 'joint_a5')
    }  # fmt: skip
    assert answer.shrink.rms_after_m == pytest.approx(np.sqrt(3.0) * 3e-5, rel=0.1)


def test_a_diagnosis_that_is_over_holds_no_memory():
    def fits():
        gc.collect()
        return sum(isinstance(one, Fit) for one in gc.get_objects())

    arm = small_arm()
    before = fits()
    true = [{'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': 2e-3}]
    answer = diagnose([recorded(arm, true, 3, seconds=3.0)], arm, experiment=False)
    assert answer.effects
    del answer
    assert fits() <= before
