# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Touches: the next ones proposed, and mistakes in them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.arm.chain import forward
from weld_twin_core.contacts import Artefact, Contact, Contacts, Tie
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
from weld_twin_core.diagnosis.soundness.touches import _loose, touches
from weld_twin_core.diagnosis.unseen.groups import all_groups
from weld_twin_core.motion.inverse.newton import reaching

SOCKETS = {'a': [0.45, 0.1, 0.3], 'b': [0.45, 0.15, 0.3], 'c': [-0.1, 0.5, 0.4]}
EACH = 14


@pytest.fixture(scope='module')
def sound(robot):
    """Return touches of three sockets, two of them a known distance apart, 0.1 mm of noise."""
    rng = np.random.default_rng(11)
    q, labels = [], []
    for label, place in SOCKETS.items():
        found, good = reaching(robot, np.tile(place, (80, 1)), rng.uniform(-2.0, 2.0, (80, 6)))
        q.append(found[good][:EACH] + rng.normal(0.0, 5e-5, (EACH, 6)))
        labels += [label] * EACH
    artefact = Artefact(tuple(Contact(label) for label in SOCKETS), (Tie(('a', 'b'), 0.05, 1e-4),))
    motion = wt.JointMotion(np.arange(3.0 * EACH), np.concatenate(q), static=True)
    return wt.Recording('touches', motion, contacts=Contacts(artefact, tuple(labels)))


def told(recording, robot):
    """Return the sentences of what is wrong, mended and not."""
    found = touches(*aligned(recording, robot, '', ()))
    return found, [item.sentence for item in found.unsound], [m.sentence for m in found.mistakes]


def with_labels(recording, changed):
    """Return the recording with other labels at some postures."""
    labels = list(recording.contacts.labels)
    for k, label in changed.items():
        labels[k] = label
    contacts = Contacts(recording.contacts.artefact, tuple(labels))
    return replace(recording, contacts=contacts)


def test_sound_touches_are_left_alone(sound, robot):
    found, mended, wrong = told(sound, robot)
    assert (mended, wrong) == ([], [])
    assert sum(found.problem.samples) == 3 * EACH


def test_a_posture_in_the_other_socket_is_named_and_not_fitted(sound, robot):
    found, mended, wrong = told(with_labels(sound, {3: 'b'}), robot)
    assert wrong == []
    assert len(mended) == 1
    assert mended[0].startswith("Posture 1 of 'b' rests in 'a', 50.")
    assert sum(found.problem.samples) == 3 * EACH - 1


@pytest.mark.parametrize(
    ('moved', 'joint', 'step', 'begin', 'end', 'lost'),
    [
        (slice(30, 31), 1, 0.02, "Posture 3 of 'c' is ", 'off: the contact slipped.', 1),
        (slice(36, None), 0, 0.01, "Postures 9 to 14 of 'c' rest ", 'while it was measured', 0),
    ],
)
def test_a_slip_is_not_fitted_and_a_place_that_was_moved_counts_as_two(
    sound, robot, moved, joint, step, begin, end, lost
):
    q = np.array(sound.joints.q)
    q[moved, joint] += step
    found, (mended,), _ = told(replace(sound, joints=replace(sound.joints, q=q)), robot)
    assert mended.startswith(begin) and end in mended
    assert sum(found.problem.samples) == 3 * EACH - lost


def test_swapped_files_are_not_mended(sound, robot):
    swapped = dict.fromkeys(range(EACH), 'c') | dict.fromkeys(range(2 * EACH, 3 * EACH), 'a')
    _, mended, wrong = told(with_labels(sound, swapped), robot)
    assert mended == []
    assert len(wrong) == 1
    assert wrong[0].startswith("'a' and 'b' are 50 mm apart by the artefact and ")


def test_a_length_that_was_measured_from_edge_to_edge_is_told_and_not_fitted(sound, robot):
    """A few postures fit an arm as it is wanted: the length is held against what they tell alone."""
    few = np.flatnonzero(np.arange(3 * EACH) % EACH < 5)
    touched = sound.contacts.take(few)
    wrong_length = Artefact(touched.artefact.contacts, (Tie(('a', 'b'), 0.055, 1e-4),))
    motion = replace(sound.joints, t=sound.joints.t[few], q=sound.joints.q[few])
    contacts = replace(touched, artefact=wrong_length)
    _, mended, (wrong,) = told(replace(sound, joints=motion, contacts=contacts), robot)
    assert mended == []
    assert wrong.startswith("'a' and 'b' are 55 mm apart by the artefact and ")
    by_postures = float(wrong.split('artefact and ')[1].split(' mm')[0])
    assert by_postures == pytest.approx(50.0, abs=0.5)


def test_touches_that_no_arm_makes_are_told_and_not_explained(sound, robot):
    """Places of a drawing in mm, or in the frame of the table."""
    contacts = sound.contacts
    for at, told_apart in (
        ({k: 1e3 * np.array(p) for k, p in SOCKETS.items()}, True),
        ({k: np.array([p[1] + 0.3, -p[0], p[2] + 0.8]) for k, p in SOCKETS.items()}, True),
        (SOCKETS, False),
    ):
        known = Artefact(tuple(Contact(k, at=tuple(map(float, p))) for k, p in at.items()))
        placed = replace(sound, contacts=replace(contacts, artefact=known))
        _, mended, wrong = told(placed, robot)
        assert mended == []
        assert [m.startswith('No place of what was touched and no ') for m in wrong] == [
            True
        ] * told_apart


def test_recordings_of_one_instrument_have_one_noise_and_touches_their_own():
    touched = SimpleNamespace(freedom=90)  # of 120 numbers: the noise is twice what is left
    problem = SimpleNamespace(given=(0, 1, 2), contact=[None, None, touched].__getitem__)
    rows = [np.full((6, 60), 1e-4), np.full((6, 40), 4e-4), np.full((6, 40), 5e-4)]
    assert _loose(problem, rows) == pytest.approx((1.0, 1.0, 10.0))


def test_contacts_have_no_instrument_that_could_be_at_fault(sound, robot):
    problem, model = aligned(sound, robot, 'tool', ())
    scale = problem.unit_scale()
    places = {group.at for group in all_groups(problem, model, scale)}
    assert places >= set(robot.joint_names[1:-1])
    assert 'instrument' not in places


PLACES = {'low': [0.45, 0.1, 0.2], 'left': [0.1, 0.5, 0.35], 'right': [0.35, -0.35, 0.3]}
SIGMA = 1e-4
TOUCHES = 8


def touched(robot, labels, rng):
    """Return touches of some places in postures that look much alike."""
    q, names = [], []
    for label in labels:
        start = np.array([0.2, -1.0, 1.4, -1.9, -1.5, 0.0]) + rng.normal(0.0, 0.25, (40, 6))
        found, good = reaching(robot, np.tile(PLACES[label], (40, 1)), start)
        q.append(found[good][:TOUCHES])
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


def test_what_no_touch_sees_is_no_reason_to_fail(robot):
    """A tool that turned as time went on moves no tool point."""
    problem, model, scale = touched(robot, PLACES, np.random.default_rng(3))
    turned = wt.effects.FrameCurve((0.0,) * 6, (0.0,) * 6, (0.0, 20.0), 'time', 'tool')
    motion = next_touches(problem, model.with_found((turned,)), (), scale)['motion']
    assert len(motion['q']) == 12


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
