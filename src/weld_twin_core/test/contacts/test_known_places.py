# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A block whose size or place is known, felt with the wire: then the base shows."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.arm.rotation import rotation_matrix
from weld_twin_core.contacts import Artefact, Contacts, lengths, places
from weld_twin_core.diagnosis.answer.contact_spreads import _base_hidden
from weld_twin_core.diagnosis.frames.aligned import aligned, other_causes
from weld_twin_core.diagnosis.predicting.allowed import left_open
from weld_twin_core.effects import REGISTRY
from weld_twin_core.errors import DataError
from weld_twin_core.motion.inverse.newton import reaching
from weld_twin_core.twin.posterior import expected_poses, largest_sigma

SIZE = [0.3, 0.24, 0.2]
AT = [0.45, 0.1, 0.2]
NOISE = 3e-5
EACH = 12
GEOMETRY = {'joint_offset', 'link_length', 'link_offset', 'link_twist', 'tool_pose', 'base_pose'}
OTHERS = REGISTRY.keys() - GEOMETRY
"""Kinds that need not be tried beside those of the geometry: the fewer, the sooner."""


def block(**more):
    """Return a block of which the size is known, and more."""
    return Artefact.from_mapping({'blocks': {'block': {'size': SIZE, 'sigma': 5e-5, **more}}})


def felt(real, artefact, rng):
    """Return touches of all six faces by an arm as it really is, with a little noise."""
    q, labels = [], []
    for axis in range(3):
        for sign, name in ((1.0, '+'), (-1.0, '-')):
            points = AT + rng.uniform(-0.45, 0.45, (60, 3)) * SIZE
            points[:, axis] = AT[axis] + sign * 0.5 * SIZE[axis]
            found, good = reaching(real, points, rng.uniform(-2.0, 2.0, (60, 6)))
            q.append(found[good][:EACH])
            labels += [f'block {name}{"xyz"[axis]}'] * len(q[-1])
    every = np.concatenate(q)
    every = every + rng.normal(0.0, NOISE, every.shape)
    motion = wt.JointMotion(np.arange(float(len(every))), every, static=True)
    return wt.Recording('block', motion, contacts=Contacts(artefact, tuple(labels)))


def moved(robot, shift):
    """Return the arm with its base moved by some metres."""
    base = np.array(robot.T_world_base)
    base[:3, 3] += shift
    return robot.with_frames(base=base)


def named(diagnosis):
    """Return the causes that were named."""
    return [(item.effect.name, item.effect.site) for item in diagnosis.effects]


def test_a_base_put_back_wrongly_shows_on_a_block_at_a_known_place(robot):
    rng, shift = np.random.default_rng(1), np.array([0.003, -0.002, 0.0])
    recording = felt(moved(robot, shift), block(at=AT), rng)

    diagnosis = wt.diagnose(recording, robot, exclude=OTHERS, experiment=False)

    assert named(diagnosis) == [('base_pose', None)]
    np.testing.assert_allclose(diagnosis.effects[0].effect.xyz, shift, atol=2e-4)
    assert not any('base' in text for text in diagnosis.contacts.not_seen)


def test_the_same_block_at_an_unknown_place_says_nothing_of_the_base(robot):
    recording = felt(robot, block(), np.random.default_rng(1))

    problem, model = aligned(recording, robot, 'base', ())
    elsewhere = model.moved(0, np.array([0.003, -0.002, 0.0, 0.01, 0.0, 0.02]))

    # A normal may point to either side.
    off = [np.abs(problem.residuals(each)[0]) for each in (model, elsewhere)]
    np.testing.assert_allclose(off[0], off[1], atol=1e-9)
    assert 'base_pose' in other_causes(problem)
    assert problem.align == frozenset()
    open_ = left_open(problem, model)
    assert open_[:3] == ('base x', 'base y', 'base z') and len(open_) == 6
    fitted = SimpleNamespace(
        problem=problem, final=SimpleNamespace(model=model), scale=problem.unit_scale()
    )
    assert _base_hidden(fitted) == ('where the base stands',)


def test_a_base_that_is_not_known_is_found_beside_the_cause(robot):
    rng, shift = np.random.default_rng(2), np.array([0.02, 0.03, -0.01])
    bent = replace(robot, theta=robot.theta + 0.002 * (np.arange(6) == 2))
    recording = felt(moved(bent, shift), block(at=AT), rng)

    diagnosis = wt.diagnose(recording, robot, align='base', exclude=OTHERS, experiment=False)

    assert named(diagnosis) == [('joint_offset', 'elbow_joint')]
    base = diagnosis.model.bases[0]
    np.testing.assert_allclose(base[:3, 3] - robot.T_world_base[:3, 3], shift, atol=3e-4)


def test_pins_at_known_places_tell_together_where_the_base_stands(robot):
    """Each pin alone leaves the turn about it open; all of them are touched by one arm on one base."""
    rng = np.random.default_rng(6)
    bent = replace(robot, theta=robot.theta + 0.002 * (np.arange(6) == 2))
    real = moved(bent, np.array([0.02, 0.03, -0.01]))
    pins = np.array([[0.5, 0.1, 0.2], [0.3, -0.4, 0.4], [-0.2, 0.5, 0.3], [0.4, 0.4, 0.6]])
    known = {
        f'pin {k}': {'kind': 'point', 'at': at.tolist(), 'sigma': 5e-5}
        for k, at in enumerate(pins)
    }
    q, labels = [], []
    for name, at in zip(known, pins, strict=True):
        postures, good = reaching(real, np.tile(at, (60, 1)), rng.uniform(-2.0, 2.0, (60, 6)))
        q.append(postures[good][:EACH])
        labels += [name] * len(q[-1])
    every = np.concatenate(q) + rng.normal(0.0, NOISE, (len(labels), 6))
    motion = wt.JointMotion(np.arange(float(len(every))), every, static=True)
    contacts = Contacts(Artefact.from_mapping({'contacts': known}), tuple(labels))

    recording = wt.Recording('pins', motion, contacts=contacts)
    found = wt.diagnose(recording, robot, align='base', exclude=OTHERS, experiment=False)

    others = np.concatenate([part[:4] + 0.1 for part in q])
    still = wt.Recording('others', wt.JointMotion(np.arange(16.0), others, static=True))
    told, covariance = expected_poses(found.posterior, found.model.twin(0), still, still.joints.t)
    off = told.position - wt.Twin(real).poses(still).position
    sigma = largest_sigma(covariance)
    assert sigma.max() < 1e-3
    assert (np.linalg.norm(off, axis=1) < 3.0 * sigma).all()


def test_faces_of_a_block_lie_as_far_apart_as_its_size(robot):
    rng = np.random.default_rng(3)
    recording = felt(robot, block(), rng)
    points = wt.Twin(robot).poses(recording, recording.joints.t).position
    # The arm is 1 % too large: faces felt one by one lie too far apart, the block stays a block.
    large = 1.01 * points

    alone = {item.tie.between: item.measured for item in lengths(recording.contacts, large)[::5]}
    where = {s.contact.label: s for s in places(recording.contacts, large).surfaces}

    assert alone['block +x', 'block -x'] == pytest.approx(1.01 * SIZE[0], abs=2e-4)
    for axis, side in zip('xyz', SIZE, strict=True):
        plus, minus = where[f'block +{axis}'], where[f'block -{axis}']
        assert abs(plus.axis @ (plus.point - minus.point)) == pytest.approx(side, abs=1e-6)
        assert np.abs(np.cross(plus.axis, minus.axis)).max() < 1e-6


def test_what_ties_a_block_together_has_the_right_derivatives(robot):
    rng = np.random.default_rng(4)
    recording = felt(robot, block(at=AT, turn=[0.01, 0.02, 0.03]), rng)
    points = wt.Twin(robot).poses(recording, recording.joints.t).position
    here = places(recording.contacts, points)
    off, change, sigma = here.ties()
    unit = 1e-6 * rng.normal(size=change.shape[1])

    there, _, _ = here.moved(unit).ties()

    assert sigma.shape == off.shape
    np.testing.assert_allclose((there - off) * 1e6, change @ unit * 1e6, atol=1e-4)


def test_a_block_that_is_turned_has_its_faces_turned():
    turned = block(at=AT, turn=[0.0, 0.0, np.pi / 2])
    face = turned.named('block +x')
    np.testing.assert_allclose(face.axis, [0.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(face.at, AT + rotation_matrix([0, 0, np.pi / 2]) @ [0.15, 0, 0])
    again = Artefact.from_mapping(turned.as_mapping())
    assert (again.contacts, set(again.ties)) == (turned.contacts, set(turned.ties))


def test_one_touch_of_a_known_pin_counts(robot):
    artefact = Artefact.from_mapping({'contacts': {'pin': {'kind': 'point', 'at': AT}}})
    q, _ = reaching(robot, np.array([AT]), np.array([[0.2, -1.0, 1.4, -1.9, -1.5, 0.0]]))
    motion = wt.JointMotion([0.0], q, static=True)
    recording = wt.Recording('pin', motion, contacts=Contacts(artefact, ('pin',)))

    problem, model = aligned(recording, moved(robot, [0.001, 0.0, 0.0]), '', ())

    np.testing.assert_allclose(problem.residuals(model)[0][:, 0], [-0.001, 0.0, 0.0], atol=1e-8)


@pytest.mark.parametrize(
    ('entry', 'message'),
    [
        ({'contacts': {'a': {'kind': 'plane', 'at': [0, 0, 1]}}}, 'that is known has at and axis'),
        ({'contacts': {'a': {'at': [0, 0]}}}, r"at of contact 'a' must be three numbers, got"),
        ({'blocks': {'b': {'size': [0.1, 0.0, 0.1]}}}, 'three positive lengths'),
        ({'blocks': {'b': {'length': 0.1}}}, "block 'b' has a size, sigma, square, and at and"),
    ],
)
def test_a_known_place_that_is_not_whole_is_refused(entry, message):
    with pytest.raises(DataError, match=message):
        Artefact.from_mapping(entry)
