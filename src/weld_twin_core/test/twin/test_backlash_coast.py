# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Play in which the arm rests ahead: the mirror image of play about the command."""

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.effects import effect_from_mapping
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.twin import Twin

ROBOT = catalog.load('ur5')
JOINT = 'elbow_joint'


def moved(form, angles):
    q = np.zeros((len(angles), 6))
    q[:, 2] = angles
    motion = Recording('r', JointMotion(np.arange(float(len(angles))), q, static=True))
    effect = effect_from_mapping(
        {'effect': 'backlash', 'joint': JOINT, 'width': 2e-4, 'form': form}
    )
    return Twin(ROBOT, (effect,)).joints(motion)[:, 2] - angles


def test_it_rests_half_a_gap_further_in_the_direction_it_came():
    angles = np.array([0.0, 0.5, 1.0, 0.2, 0.9])
    np.testing.assert_allclose(moved('coast', angles)[1:], [1e-4, 1e-4, -1e-4, 1e-4], atol=1e-15)


def test_it_mirrors_play_while_the_gap_is_crossed():
    angles = np.cumsum(np.random.default_rng(1).normal(scale=1e-4, size=200))
    np.testing.assert_allclose(moved('coast', angles), -moved('play', angles), atol=1e-15)


def test_the_derivative_by_width_is_that_of_differences():
    angles = np.array([0.0, 0.5, 1.0, 0.2, 0.9])
    q = np.zeros((5, 6))
    q[:, 2] = angles
    motion = Recording('r', JointMotion(np.arange(5.0), q, static=True))

    def twin(width):
        entry = {'effect': 'backlash', 'joint': JOINT, 'width': width, 'form': 'coast'}
        return Twin(ROBOT, (effect_from_mapping(entry),))

    _, slope = twin(2e-4).linearise(motion)
    ends = [twin(w).poses(motion).position for w in (1.9e-4, 2.1e-4)]
    np.testing.assert_allclose(slope[:, :3, 0], (ends[1] - ends[0]) / 2e-5, atol=1e-5)
