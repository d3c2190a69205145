# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames fitted as nuisance, effects known beforehand, held-out data, and data of no use."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cells import SIGMA, effect, recorded, sites
from scipy.spatial.transform import Rotation
from small_arm import small_arm

from weld_twin_core.arm.catalog import load
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Measurements, Recording

FLOOR = np.sqrt(3.0) * SIGMA
SPRING = {'effect': 'joint_compliance', 'joint': 'shoulder_lift_joint', 'compliance': 1.2e-5}


def frame(seed):
    """Return a frame that an instrument and a probe may put anywhere."""
    rng = np.random.default_rng(seed)
    out = np.eye(4)
    out[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    out[:3, 3] = rng.uniform(-1.0, 1.0, 3) * (3.0 if seed < 10 else 0.2)
    return out


def spring(answer):
    (found,) = [f for f in answer.effects if f.effect.name == 'joint_compliance']
    return found


def holds(found, truth=1.2e-5):
    value = found.effect.compliance
    return abs(value - truth) < 4.0 * found.std['compliance'] + 0.02 * truth


def test_arbitrary_base_and_tool_frames_are_found_and_the_cause_with_them():
    robot, base, tool = load('ur5'), frame(1), frame(11)
    recording = recorded(robot.with_frames(base=base, tool=tool), [SPRING], static=70)
    answer = diagnose([recording], robot, align=frozenset({'base', 'tool'}), experiment=False)
    assert {('joint_compliance', 'shoulder_lift_joint')} in sites(answer)
    assert holds(spring(answer))
    np.testing.assert_allclose(answer.model.bases[0], base, atol=1e-4)
    np.testing.assert_allclose(answer.model.robot.T_flange_tool, tool, atol=1e-4)
    assert not any(c.site.effect in ('base_pose', 'tool_pose') for c in answer.candidates)
    assert answer.shrink.rms_after_m == pytest.approx(FLOOR, rel=0.1)


def test_two_recordings_each_have_a_base_frame_of_their_own():
    robot, bases = small_arm(), (frame(2), frame(3))
    recordings = [
        recorded(robot.with_frames(base=base), [SPRING], seed, static=40, name=f'set-up {seed}')
        for seed, base in enumerate(bases)
    ]
    answer = diagnose(recordings, robot, align=frozenset({'base'}), experiment=False)
    assert sites(answer) == [{('joint_compliance', 'shoulder_lift_joint')}]
    assert holds(spring(answer))
    for found, base in zip(answer.model.bases, bases, strict=True):
        np.testing.assert_allclose(found, base, atol=1e-4)


def test_an_effect_known_beforehand_is_not_diagnosed_again():
    robot = small_arm()
    known = effect('joint_compliance', joint='shoulder_lift_joint', compliance=1.2e-5)
    recording = recorded(robot, [SPRING], static=40, richness=0.0)
    answer = diagnose([recording], robot, known=[known], experiment=False)
    assert (answer.status, answer.effects) == ('none', ())
    assert answer.gap.rms_m == pytest.approx(FLOOR, rel=0.1)
    assert answer.as_dict()['model']['known'] == [known.to_mapping()]


def test_held_out_recordings_judge_the_shrink():
    robot = small_arm()
    seen, unseen = (
        recorded(robot, [SPRING], seed, static=n, name=name)
        for seed, n, name in ((1, 40, 'seen'), (2, 50, 'unseen'))
    )
    answer = diagnose([seen], robot, holdout=[unseen], experiment=False)
    shrink = answer.shrink
    assert shrink.held_out == 'unseen'
    assert shrink.rms_after_m == pytest.approx(FLOOR, rel=0.15)
    assert shrink.ratio == pytest.approx(shrink.rms_after_m / shrink.rms_before_m)
    assert shrink.ci95[0] < shrink.ratio < shrink.ci95[1] < 0.5


def made_up(**changes):
    t = np.arange(100) / 10.0
    motion = JointMotion(t, np.zeros((100, 6)))
    return replace(Recording('odd', motion, Measurements(t, np.zeros((100, 3)))), **changes)


@pytest.mark.parametrize('measured', [None, Measurements(np.zeros(0), np.zeros((0, 3)))])
def test_a_recording_without_measurements_is_refused_by_name(measured):
    with pytest.raises(DataError, match='odd holds no measured poses or points'):
        diagnose([made_up(measured=measured)], load('ur5'), experiment=False)


def test_clocks_that_do_not_overlap_are_unsound_with_both_spans():
    late = Measurements(1000.0 + np.arange(50) / 10.0, np.zeros((50, 3)))
    answer = diagnose([made_up(measured=late)], load('ur5'), experiment=False)
    (item,) = answer.unsound
    assert answer.status == 'unsound' and item.kind == 'clock'
    assert '0.000 to 9.900 s against 1000.000 to 1004.900 s' in item.sentence
