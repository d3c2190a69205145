# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Kinds of contact together, and a tracker on one day beside a pin on another: one diagnosis of all."""

from dataclasses import replace

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.arm.chain import forward
from weld_twin_core.contacts import Artefact, Contact, Contacts, Tie
from weld_twin_core.diagnosis.soundness import gate
from weld_twin_core.diagnosis.soundness.touches import touches
from weld_twin_core.motion.inverse.newton import reaching

PINS = {'low': [0.45, 0.1, 0.2], 'left': [0.1, 0.5, 0.35], 'right': [0.35, -0.35, 0.3]}
EACH = 12
STATIONS = 25
TRACKER, SLACK = 2e-5, 1.5e-4
OFFSET = 0.002
GEOMETRY = {'joint_offset', 'link_length', 'link_offset', 'link_twist', 'tool_pose', 'base_pose'}
OTHERS = sorted(wt.effects.REGISTRY.keys() - GEOMETRY)
"""Kinds that need not be tried beside those of the geometry: the fewer, the sooner."""


@pytest.fixture(scope='module')
def real(robot):
    """Return the arm with an elbow whose zero is wrong."""
    return replace(robot, theta=robot.theta + OFFSET * (np.arange(6) == 2))


def touched(real, seed=1):
    """Return a recording of rough touches of three pins."""
    rng = np.random.default_rng(seed)
    q, labels = [], []
    for label, place in PINS.items():
        points = place + rng.normal(0.0, SLACK, (80, 3))
        found, good = reaching(real, points, rng.uniform(-2.0, 2.0, (80, 6)))
        q.append(found[good][:EACH])
        labels += [label] * len(q[-1])
    every = np.concatenate(q)
    motion = wt.JointMotion(np.arange(float(len(every))), every, static=True)
    artefact = Artefact(tuple(Contact(label) for label in PINS))
    return wt.Recording('pins', motion, contacts=Contacts(artefact, tuple(labels)))


def tracked(real, reflector=(0.0, 0.0, 0.0), seed=2):
    """Return stations under a tracker that stands somewhere, its reflector off the tool point."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1.5, 1.5, (STATIONS, 6))
    points = forward(real, q)
    points = points[:, :3, 3] + points[:, :3, :3] @ np.array(reflector)
    points = points + [3.0, -1.0, 0.5] + rng.normal(0.0, TRACKER, points.shape)
    t = np.arange(float(STATIONS))
    return wt.Recording(
        'tracker', wt.JointMotion(t, q, static=True), measured=wt.Measurements(t, points)
    )


def test_pins_and_a_tracker_name_the_elbow_together_whatever_carried_the_reflector(
    robot, real, monkeypatch
):
    beside, looked_at = (0.0, 0.05, -0.02), []

    def noted(*asked):
        looked_at.append(touches(*asked))
        return looked_at[-1]

    monkeypatch.setattr(gate, 'touches', noted)
    diagnosis = wt.diagnose(
        [touched(real), tracked(real, beside)],
        robot,
        align='base',
        may_change='tool_pose',
        exclude=OTHERS,
        experiment=False,
    )

    named = [(item.effect.name, item.effect.site) for item in diagnosis.effects]
    assert named == [('joint_offset', 'elbow_joint')]
    assert diagnosis.effects[0].effect.offset == pytest.approx(OFFSET, abs=2e-5)
    assert [item.label for item in diagnosis.contacts.touched] == list(PINS)
    assert diagnosis.contacts.spread_after_m == pytest.approx(SLACK * np.sqrt(8 / np.pi), rel=0.2)
    assert 'where the base stands' not in diagnosis.contacts.not_seen
    # Rough touches count by what they are worth.
    (found,) = looked_at
    instrument, *pins = found.problem.loose
    assert instrument == 1.0 and not found.unsound
    np.testing.assert_allclose(pins, SLACK / TRACKER, rtol=0.35)
    base = diagnosis.model.bases[0]
    np.testing.assert_allclose(
        base[:3, 3] - robot.T_world_base[:3, 3], [3.0, -1.0, 0.5], atol=3e-4
    )
    (change,) = diagnosis.changed
    assert (change.recording, change.effect.name) == (1, 'tool_pose')
    np.testing.assert_allclose(change.effect.xyz, beside, atol=3e-4)


BLOCK = Artefact(
    (Contact('pin'), Contact('top', 'plane'), Contact('side', 'plane'), Contact('bar', 'length')),
    (Tie(('top', 'side'), np.pi / 2, 5e-4, 'angle'),),
)


def reached(robot, points, rng, most):
    """Return postures in which the tool point is at each of some points, at most so many."""
    q, good = reaching(robot, points, rng.uniform(-2.0, 2.0, (len(points), 6)))
    return q[good][:most]


def targets(rng):
    """Yield what is touched, and where: the faces and the ball of the bar at many points."""
    yield 'pin', np.tile([0.4, 0.1, 0.2], (60, 1)), 14
    flat = rng.uniform([0.3, -0.2, 0.15], [0.5, 0.2, 0.3], (60, 3))
    yield 'top', flat * [1.0, 1.0, 0.0] + [0.0, 0.0, 0.15], 25
    yield 'side', flat * [0.0, 1.0, 1.0] + [0.5, 0.0, 0.0], 25
    ways = rng.normal(size=(60, 3))
    ways *= 0.15 / np.linalg.norm(ways, axis=1)[:, None]
    yield 'bar', np.array([0.1, 0.5, 0.2]) + ways, 25


def pinned(postures):
    """Return exact touches of a pin."""
    motion = wt.JointMotion(np.arange(float(len(postures))), postures, static=True)
    contacts = Contacts(Artefact((Contact('other'),)), ('other',) * len(postures))
    return wt.Recording('elsewhere', motion, contacts=contacts)


def test_kinds_of_contact_together_name_the_elbow(robot):
    rng = np.random.default_rng(1)
    real = replace(robot, theta=robot.theta + OFFSET * (np.arange(6) == 2))
    q, labels, values = [], [], []
    for label, points, most in targets(rng):
        found = reached(real, points, rng, most)
        far = np.linalg.norm(forward(real, found)[:, :3, 3] - [0.1, 0.5, 0.2], axis=1)
        q.append(found + rng.normal(0.0, 3e-5, found.shape))
        labels += [label] * len(found)
        values += list(far if label == 'bar' else 0.0 * far)
    postures = np.concatenate(q)
    motion = wt.JointMotion(np.arange(float(len(postures))), postures, static=True)
    touched = Contacts(BLOCK, tuple(labels), np.array(values))
    other = reached(real, np.tile([-0.2, 0.45, 0.3], (60, 1)), rng, 12)

    diagnosis = wt.diagnose(
        wt.Recording('block', motion, contacts=touched),
        robot,
        holdout=[pinned(other)],
        exclude=OTHERS,
        experiment=False,
    )

    (named,) = diagnosis.effects
    assert (named.effect.name, named.effect.site) == ('joint_offset', 'elbow_joint')
    assert named.effect.offset == pytest.approx(OFFSET, abs=5e-5)
    assert diagnosis.contacts.held_out_spread_m < 0.1 * diagnosis.contacts.spread_before_m
    (square,) = diagnosis.contacts.lengths
    assert abs(square.after - np.pi / 2) < abs(square.before - np.pi / 2)
    # Judged on another pin, which took no part: exact touches of it hardly scatter any more.
    assert diagnosis.shrink.held_out == 'elsewhere'
    assert diagnosis.shrink.rms_before_m > 3e-4
    assert diagnosis.shrink.ratio < 0.1
