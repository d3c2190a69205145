# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Postures that are not what they are called: told of, and not fitted."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.contacts import Artefact, Contact, Contacts, Tie
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


def test_a_slip_is_named_and_not_fitted(sound, robot):
    q = np.array(sound.joints.q)
    q[30, 1] += 0.02
    found, mended, _ = told(replace(sound, joints=replace(sound.joints, q=q)), robot)
    assert len(mended) == 1
    assert mended[0].startswith("Posture 3 of 'c' is ")
    assert mended[0].endswith('off: the contact slipped.')
    assert sum(found.problem.samples) == 3 * EACH - 1


def test_a_place_that_was_moved_counts_as_two(sound, robot):
    q = np.array(sound.joints.q)
    q[36:, 0] += 0.01
    found, mended, _ = told(replace(sound, joints=replace(sound.joints, q=q)), robot)
    assert len(mended) == 1
    assert mended[0].startswith("Postures 9 to 14 of 'c' rest ")
    assert 'its place was moved while it was measured' in mended[0]
    assert sum(found.problem.samples) == 3 * EACH


def test_swapped_files_are_not_mended(sound, robot):
    swapped = dict.fromkeys(range(EACH), 'c') | dict.fromkeys(range(2 * EACH, 3 * EACH), 'a')
    _, mended, wrong = told(with_labels(sound, swapped), robot)
    assert mended == []
    assert len(wrong) == 1
    assert wrong[0].startswith("'a' and 'b' are 50 mm apart by the artefact and ")


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
