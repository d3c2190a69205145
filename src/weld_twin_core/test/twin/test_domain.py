# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What was recorded, and how a motion outside of it is told."""

from __future__ import annotations

import numpy as np

from weld_twin_core.arm.catalog import load
from weld_twin_core.recording import JointMotion, Measurements, Recording, Signal
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


def test_the_same_motion_again_lies_inside():
    domain = Domain.of([recorded(swinging(0.5))], UR5)
    again = recorded(swinging(0.5))
    assert domain.outside(again.joints.q, again.joints.velocity) == []


def test_a_hole_in_the_range_is_outside_and_a_full_turn_is_not():
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
