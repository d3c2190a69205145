# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What was recorded, how a motion outside of it is told, and how little is corrected there."""

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core import JointMotion, Measurements, Recording, Signal, Twin, compensate, load
from weld_twin_core.contacts import Artefact, Contact, Contacts
from weld_twin_core.effects import REGISTRY
from weld_twin_core.motion.inverse.newton import reaching
from weld_twin_core.twin.domain import Domain

UR5 = load('ur5')


def recorded(q, **more):
    t = np.linspace(0.0, 10.0, len(q))
    measured = Measurements(t, np.zeros((len(q), 3)))
    return Recording('m', JointMotion(t, q, None, more.pop('static', False)), measured, **more)


def swinging(reach, count=400):
    """Every joint swings about zero; joint 4 by its own reach."""
    t = np.linspace(0.0, 10.0, count)
    q = np.outer(np.sin(t), np.ones(6))
    q[:, 3] *= reach
    return q


def test_a_joint_beyond_its_range_is_told_by_name_and_distance():
    domain = Domain.of([recorded(swinging(0.5))], UR5)
    found = domain.outside(swinging(1.46), np.zeros((400, 6)))
    assert {o.why.split(' is ')[0] for o in found} == {'wrist_1_joint'}
    assert found[0].why == 'wrist_1_joint is 0.96 rad beyond what was recorded'
    flagged = np.zeros(400, bool)
    for first, last, _ in found:
        flagged[first : last + 1] = True
    truly = np.abs(swinging(1.46)[:, 3]) > 0.5
    # One degree of tolerance at either side of the range.
    assert not (flagged & ~truly).any()
    assert np.abs(swinging(1.46)[truly & ~flagged, 3]).max() < 0.525


def test_a_motion_is_inside_again_and_so_is_a_full_turn_but_no_hole():
    domain = Domain.of([recorded(swinging(0.5))], UR5)
    again = recorded(swinging(0.5))
    assert domain.outside(again.joints.q, again.joints.velocity) == []
    q = np.concatenate([swinging(0.1)[:200] * 0.1 - 1.0, swinging(0.1)[:200] * 0.1 + 1.0])
    domain = Domain.of([recorded(q)], UR5)
    away = domain.beyond(np.array([np.zeros(6), np.full(6, 1.0 + 2.0 * np.pi)]))
    assert np.abs(away[0] - 0.9).max() < 0.1
    assert away[1].max() == 0.0


def test_from_few_stations_a_joint_may_go_as_far_again_as_it_went():
    q = np.linspace(0.0, 0.3, 15)[:, None] * np.ones(6)
    domain = Domain.of([recorded(q, static=True)], UR5)
    assert not domain.outside(np.full((1, 6), 0.55))
    assert len(domain.outside(np.full((1, 6), 0.65))) == 6


def test_further_stations_of_the_same_kind_are_rarely_outside():
    rng = np.random.default_rng(4)
    for count in (15, 30, 120):
        told = []
        for _ in range(20):
            q = rng.uniform(-2.0, 2.0, (count + 200, 6))
            domain = Domain.of([recorded(q[:count], static=True)], UR5)
            told.append((domain.beyond(q[count:]) > domain.margins).any(axis=1).mean())
        assert np.mean(told) <= 0.05


def test_speed_load_and_temperature_beyond_are_told():
    t = np.linspace(0.0, 10.0, 400)
    wrench = np.zeros((400, 6))
    wrench[:, 2] = -20.0
    known = recorded(
        swinging(0.5),
        wrench=Signal(t, wrench),
        temperature=Signal(t, np.linspace(20.0, 25.0, 400)),
    )
    domain = Domain.of([known], UR5)
    speed = known.joints.velocity
    assert domain.outside(known.joints.q, speed, wrench, np.full(400, 26.0)) == []
    (fast,) = domain.outside(known.joints.q, 3.0 * speed)[:1]
    assert 'rad/s' in fast.why and 'was recorded' in fast.why
    # Slower than others ever were, and yet three times as fast as it was itself.
    (slow,) = domain.outside(known.joints.q, speed * [1.0, 1.0, 1.0, 1.8, 1.0, 1.0])[:1]
    assert slow.why.startswith('wrist_1_joint moves at up to 0.9 rad/s, at most 0.5')
    (heavy,) = domain.outside(known.joints.q, speed, 3.0 * wrench)
    assert heavy.why == 'the force on the tool is up to 60 N, at most 20 N was recorded'
    (warm,) = domain.outside(known.joints.q, speed, None, np.full(400, 31.0))
    assert '6 K beyond the 20.0 to 25.0 degC' in warm.why


def test_motion_after_stations_at_rest_is_told():
    domain = Domain.of([recorded(swinging(0.5), static=True)], UR5)
    moving = recorded(swinging(0.5))
    assert (
        'only stations at rest' in domain.outside(moving.joints.q, moving.joints.velocity)[0].why
    )
    assert domain.outside(moving.joints.q) == []


DOMAIN = Domain(UR5.joint_names, tuple(((-1.0, 1.0),) for _ in range(6)), (0.02,) * 6, (True,) * 6)


def test_all_where_it_was_recorded_and_the_best_share_far_outside():
    q = np.zeros((3, 6))
    q[:, 2] = [1.0, 1.05, 2.0]
    correction = np.tile([3e-4, 0.0, 4e-4], (3, 1))  # half a millimetre
    covariance = np.tile(np.diag([4e-8, 2e-8, 2.5e-9]) * 4.0, (3, 1, 1))  # root of trace 0.5 mm
    share = DOMAIN.trust(q, correction, covariance)
    assert share[0] == 1.0
    assert 0.5 < share[1] < 1.0
    assert abs(share[2] - 0.5) < 1e-9


def test_the_share_goes_over_without_a_jump():
    q = np.zeros((2001, 6))
    q[:, 4] = np.linspace(0.9, 1.3, 2001)
    still = np.tile([1e-4, 0.0, 0.0], (2001, 1))
    share = DOMAIN.trust(q, still, np.tile(np.eye(3) * 1e-6, (2001, 1, 1)))
    assert np.abs(np.diff(share)).max() < 5e-3
    assert share[-1] < 0.01


def test_commands_take_off_their_share_and_no_more():
    effects = (REGISTRY['joint_offset']('elbow_joint', 2e-3),)
    q = np.tile([0.1, -1.2, 1.5, -1.8, -1.5, 0.3], (3, 1))
    recording = Recording('m', JointMotion(np.arange(3.0), q, None, True))
    result = compensate(UR5, effects, recording, trust=np.array([1.0, 0.25, 0.0]))
    nominal = Twin(UR5).poses(recording).position
    real = Twin(UR5, effects).poses(Recording('c', result.motion)).position
    off = np.linalg.norm(real - nominal, axis=1)
    whole = np.linalg.norm(Twin(UR5, effects).poses(recording).position - nominal, axis=1)
    assert whole.min() > 5e-4
    np.testing.assert_allclose(off / whole, [0.0, 0.75, 1.0], atol=1e-6)


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


def test_the_model_is_believed_as_far_as_a_single_place_or_several_vouch(robot):
    assert reasons(robot, [[0.5, 0.1, 0.3]], [0.5, 0.15, 0.3]) == []
    (why,) = reasons(robot, [[0.5, 0.1, 0.3]], [0.5, 0.4, 0.3])
    assert why == (
        'the tool is 0.3 m from the nearest place that was touched, and the model was tested to '
        '0.1 m'
    )
    places = [[0.5, 0.1, 0.3], [0.5, -0.1, 0.3], [0.5, 0.1, 0.55]]
    assert reasons(robot, places, [0.5, -0.3, 0.3]) == []
    (why,) = reasons(robot, places, [0.5, -0.4, 0.3])
    assert why.endswith('the model was tested to 0.25 m')


def test_what_an_instrument_measured_knows_no_places(robot):
    q = ELBOW_UP[None] + np.linspace(0.0, 0.5, 9)[:, None]
    motion = wt.JointMotion(np.arange(9.0), q, static=True)
    assert Domain.of([wt.Recording('tracker', motion)], robot).spots is None
