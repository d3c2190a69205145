# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The touches that are proposed can be made, and tell what they are said to tell."""

import numpy as np

import weld_twin_core as wt
from weld_twin_core.arm.chain import forward
from weld_twin_core.contacts import Artefact, Contact, Contacts
from weld_twin_core.diagnosis.advice.next_touches import (
    Design,
    again,
    chosen,
    next_touches,
    scatter,
)
from weld_twin_core.diagnosis.algebra.motions import plain_causes
from weld_twin_core.diagnosis.algebra.problem import Scale
from weld_twin_core.diagnosis.frames.aligned import aligned
from weld_twin_core.motion.inverse.newton import reaching

PLACES = {'low': [0.45, 0.1, 0.2], 'left': [0.1, 0.5, 0.35], 'right': [0.35, -0.35, 0.3]}
SIGMA = 1e-4
EACH = 8


def touched(robot, labels, rng):
    """Return touches of some places in postures that look much alike."""
    q, names = [], []
    for label in labels:
        start = np.array([0.2, -1.0, 1.4, -1.9, -1.5, 0.0]) + rng.normal(0.0, 0.25, (40, 6))
        found, good = reaching(robot, np.tile(PLACES[label], (40, 1)), start)
        q.append(found[good][:EACH])
        names += [label] * len(q[-1])
    every = np.concatenate(q)
    motion = wt.JointMotion(np.arange(float(len(every))), every, static=True)
    artefact = Artefact(tuple(Contact(label) for label in labels))
    recording = wt.Recording('touches', motion, contacts=Contacts(artefact, tuple(names)))
    problem, model = aligned(recording, robot, '', ())
    return problem, model, Scale(SIGMA, 1.0, tuple(np.ones(m) for m in problem.samples))


def test_three_places_are_touched_again_where_they_are(robot):
    problem, model, scale = touched(robot, PLACES, np.random.default_rng(3))
    motion = next_touches(problem, model, (), scale)['motion']
    q = np.array(motion['q'])
    assert len(q) == len(motion['contact']) == 12
    where = np.array([PLACES.get(label, [np.nan] * 3) for label in motion['contact']])
    np.testing.assert_allclose(forward(robot, q)[:, :3, 3], where, atol=1e-6)
    assert ((q >= robot.lower) & (q <= robot.upper)).all()


def test_of_two_places_the_next_is_a_third_one(robot):
    problem, model, scale = touched(robot, ['low', 'left'], np.random.default_rng(3))
    wanted = next_touches(problem, model, (), scale)
    assert set(wanted['motion']['contact']) == {'new place'}
    points = forward(robot, np.array(wanted['motion']['q']))[:, :3, 3]
    assert np.ptp(points, axis=0).max() < 1e-6
    for label in ('low', 'left'):
        assert np.linalg.norm(points[0] - PLACES[label]) > 0.2


def test_explanations_that_a_pin_does_not_part_are_parted_by_the_postures_proposed(robot):
    """The sizes that differ stand out by what is told once the postures are measured too."""
    problem, model, scale = touched(robot, PLACES, np.random.default_rng(3))
    one = (wt.effects.JointOffset('elbow_joint', offset=3e-3),)
    other = (wt.effects.LinkLength('elbow_joint', da=1e-3),)
    apart = next_touches(problem, model, (one, other), scale)
    alike = next_touches(problem, model, (), scale)
    assert apart['expected_separation_sigma'] > 1.0
    assert alike['expected_separation_sigma'] is None
    assert apart['motion']['q'] != alike['motion']['q']


def test_touches_fitted_without_any_rest_are_no_reason_to_fail(robot):
    problem, model, _ = touched(robot, PLACES, np.random.default_rng(3))
    exact = Scale(1e-9, 1.0, tuple(np.ones(m) for m in problem.samples))
    assert len(next_touches(problem, model, (), exact)['motion']['q']) == 12


def test_what_is_foreseen_is_what_least_squares_give(robot):
    """The spread left after some touches against the normal equations of all of them."""
    problem, model, scale = touched(robot, PLACES, np.random.default_rng(3))
    effects = plain_causes(robot, problem.features(model)[0].view, ('constant',))
    design = Design.of(problem, model, effects, scale)
    touches = [design.touchable(k, recording) for k, recording in again(problem, model)]
    rows = np.concatenate([each.rows for each in touches])
    order, after = chosen(design, rows, scatter(touches, design.errors), 5)
    taken = rows[order].reshape(-1, rows.shape[2])

    expected = np.linalg.inv(np.linalg.inv(design.root @ design.root.T) + taken.T @ taken)
    size = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(
        after[-1].root @ after[-1].root.T / np.outer(size, size),
        expected / np.outer(size, size),
        atol=1e-4,
    )
