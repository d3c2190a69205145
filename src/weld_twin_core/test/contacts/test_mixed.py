# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A pin, two square faces of a block and a ballbar together name a wrong zero."""

from dataclasses import replace

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.arm.chain import forward
from weld_twin_core.contacts import Artefact, Contact, Contacts, Tie
from weld_twin_core.motion.inverse.newton import reaching

OFFSET = 0.002
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
