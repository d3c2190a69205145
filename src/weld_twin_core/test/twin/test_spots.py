# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Far from the places that were touched a prediction says so."""

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.contacts import Artefact, Contact, Contacts
from weld_twin_core.motion.inverse.newton import reaching
from weld_twin_core.twin.domain import Domain

ELBOW_UP = np.array([0.2, -1.0, 1.4, -1.9, -1.5, 0.0])


@pytest.fixture(scope='module')
def robot():
    return wt.load('ur5')


def touched(robot, at):
    """Return one posture that touches a pin somewhere."""
    start = ELBOW_UP + np.random.default_rng(1).normal(0.0, 0.3, (40, 6))
    found, good = reaching(robot, np.tile(at, (40, 1)), start)
    q = found[good][:1]
    contacts = Contacts(Artefact((Contact('pin'),)), ('pin',))
    return wt.Recording('pin', wt.JointMotion([0.0], q, static=True), contacts=contacts)


def reasons(robot, places, at):
    """Return why a posture at a point lies outside, as far as places are the reason."""
    domain = Domain.of([touched(robot, place) for place in places], robot)
    found = domain.outside(touched(robot, at).joints.q)
    return [item.why for item in found if 'place that was touched' in item.why]


def test_beside_a_single_place_the_model_is_believed_and_far_from_it_not(robot):
    assert reasons(robot, [[0.5, 0.1, 0.3]], [0.5, 0.15, 0.3]) == []
    (why,) = reasons(robot, [[0.5, 0.1, 0.3]], [0.5, 0.4, 0.3])
    assert why == (
        'the tool is 0.3 m from the nearest place that was touched, and the model was tested to '
        '0.1 m'
    )


def test_three_places_vouch_as_far_as_from_each_to_the_next(robot):
    places = [[0.5, 0.1, 0.3], [0.5, -0.1, 0.3], [0.5, 0.1, 0.55]]
    assert reasons(robot, places, [0.5, -0.3, 0.3]) == []
    (why,) = reasons(robot, places, [0.5, -0.4, 0.3])
    assert why.endswith('the model was tested to 0.25 m')


def test_what_an_instrument_measured_knows_no_places(robot):
    q = ELBOW_UP[None] + np.linspace(0.0, 0.5, 9)[:, None]
    motion = wt.JointMotion(np.arange(9.0), q, static=True)
    assert Domain.of([wt.Recording('tracker', motion)], robot).spots is None
