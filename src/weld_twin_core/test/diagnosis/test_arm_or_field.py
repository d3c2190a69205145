# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A field of the instrument, and an arm that never tilts its hand: one thing, told as a set."""

from types import SimpleNamespace

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.diagnosis.algebra.noise_floor import WIDEST, noise_floor
from weld_twin_core.diagnosis.algebra.problem import Model, Problem
from weld_twin_core.diagnosis.frames.alignment import refined
from weld_twin_core.diagnosis.levels.curved import arm_first
from weld_twin_core.diagnosis.levels.free_form import FreeForm, Part
from weld_twin_core.diagnosis.unseen.groups import Group
from weld_twin_core.effects import JointOffset, LinkLength, LinkTwist

ERRORS = (
    JointOffset('shoulder_lift_joint', 6e-4),
    LinkLength('elbow_joint', 5e-4),
    LinkTwist('shoulder_pan_joint', 4e-4),
)
NOISE = 3e-5


@pytest.fixture
def rng():
    return np.random.default_rng(3)


def postures(rng, *, tilting):
    """Return postures of a UR5; where the hand never tilts, wrists undo what the arm turns."""
    q = np.tile([0.2, -1.3, 1.6, 0.0, -np.pi / 2, 0.0], (150, 1))
    q += rng.uniform(-0.5, 0.5, q.shape) * ([1, 1, 1, 1, 1, 1] if tilting else [1, 1, 1, 0, 0, 0])
    if not tilting:
        q[:, 3] = -0.5 * np.pi - q[:, 1] - q[:, 2]
        q[:, 5] = q[:, 0]
    return wt.JointMotion(5.0 * np.arange(150), q, static=True)


def posed(motion, position):
    """Return what `arm_first` asks of a search: the problem, and the nominal model in its frames."""
    robot = wt.load('ur5')
    seen = wt.Recording('rec', motion, wt.Measurements(motion.t, position))
    problem = Problem((seen,), frozenset({'base', 'tool'}))
    model = refined(problem, Model(robot, (robot.T_world_base,)))
    return SimpleNamespace(problem=problem, baseline=SimpleNamespace(model=model))


def blamed(found):
    """Return the places of what was first told as a field of the instrument."""
    field = Group('instrument', 'place', (), np.zeros((0, 0)), np.zeros(0))
    form = FreeForm((Part(field, 10.0, ((field, 1.0),), 0.7),), 0.7, 5.0)
    (part,) = arm_first(found, form).parts
    return part.weight_of('at')


def test_where_the_hand_never_tilts_the_arm_comes_first_and_the_instrument_stays_in_the_set(rng):
    motion = postures(rng, tilting=False)
    seen = wt.Twin(wt.load('ur5'), ERRORS).poses(wt.Recording('rec', motion), motion.t).position
    places = blamed(posed(motion, seen + NOISE * rng.standard_normal(seen.shape)))
    assert next(iter(places)) != 'instrument' and 0.0 < places['instrument'] <= 0.25
    assert sum(places.values()) == pytest.approx(1.0)


def test_a_field_that_no_arm_makes_stays_with_the_instrument(rng):
    motion = postures(rng, tilting=True)
    seen = wt.Twin(wt.load('ur5')).poses(wt.Recording('rec', motion), motion.t).position
    far = (seen - seen.mean(axis=0)) / seen.std(axis=0)
    bent = 3e-4 * np.stack([far[:, 1] * far[:, 2], far[:, 0] ** 2, far[:, 0] * far[:, 1]], axis=1)
    noise = NOISE * rng.standard_normal(seen.shape)
    assert blamed(posed(motion, seen + bent + noise)) == {'instrument': 1.0}


def test_noise_read_off_a_misfit_is_no_wider_than_an_instrument_has_and_never_than_the_gap(rng):
    found = posed(postures(rng, tilting=True), rng.standard_normal((150, 3)))
    heap = np.where(np.arange(150) < 75, 8e-3, -8e-3) * np.ones((3, 1))
    floor = noise_floor(found.problem, [heap])
    assert not floor.independent and floor.sigma <= WIDEST
    small = 0.02 * heap
    assert noise_floor(found.problem, [small]).sigma <= np.sqrt((small**2).mean())
