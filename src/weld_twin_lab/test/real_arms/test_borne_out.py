# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Unseen data bear out what is told, and teach belief from what is not told as well."""

from types import SimpleNamespace

import numpy as np
import pytest

from weld_twin_core import effects
from weld_twin_core.arm import catalog
from weld_twin_core.diagnosis.calibration.calibrated import Statement
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_core.twin.twin import Twin
from weld_twin_lab.real_arms.borne_out import borne_out
from weld_twin_lab.real_arms.rows import ArmRow
from weld_twin_lab.real_arms.study import _examples, reported_claims

CAUSES = [
    {
        'probability': probability,
        'rest': False,
        'share': 0.4,
        'sure': False,
        'names': [[kind, 'elbow_joint', probability]],
    }
    for kind, probability in (('link_twist', 0.9), ('joint_offset', 0.33))
]


def stations(seed, robot, real):
    """Return forty stations of an arm with errors, measured with 10 um of noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(40.0)
    motion = JointMotion(t, rng.uniform(-1.5, 1.5, size=(t.size, robot.n)), static=True)
    commanded = Recording('stations', motion)
    poses = Twin(robot, real).poses(commanded)
    noise = rng.normal(scale=1e-5, size=poses.position.shape)
    return commanded.with_measured(Measurements(t, poses.position + noise))


@pytest.fixture(scope='module')
def row():
    """Return an arm with a twist and a zero, of which other stations are known."""
    robot = catalog.load('ur5')
    twist = effects.LinkTwist('elbow_joint', 2e-3)
    zero = effects.JointOffset('elbow_joint', offset=1e-3)
    fitted, other = (stations(seed, robot, [twist, zero]) for seed in (1, 2))
    return ArmRow('made', robot, ('base', 'tool'), fitted, other)


def test_what_is_told_is_held_against_what_is_told_alone(row):
    sets = [['link_twist'], ['joint_offset']]
    _, both = borne_out(row, [], sets, {'link_twist'})
    _, alone = borne_out(row, [], sets[:1], {'link_twist'})
    assert both[0] == alone[0], 'a kind that is not told stood in for one that is'
    assert both[1][1].out, 'a kind that is not told is judged beside those that are'
    _, told = borne_out(row, [], sets[:1], {'link_twist', 'joint_offset'})
    assert told[0][1].median > alone[0][1].median, 'with the zero told, less is left beside'


@pytest.mark.parametrize('name', ['name', 'name of many'])
def test_belief_learns_from_names_that_were_believed_too_little(name):
    named = reported_claims({'causes': CAUSES}, least=0.0)
    assert [claim['kinds'] for claim in reported_claims({'causes': CAUSES})] == [['link_twist']]
    for claim in named:
        claim['against_told'] = {'out': claim['kinds'] == ['joint_offset']}
    said = [Statement(name, k, {'left': 0.6}, c['probability']) for k, c in enumerate(CAUSES)]
    learned = _examples(SimpleNamespace(statements=said), CAUSES, named)
    assert [(right, told) for _, _, right, told, _ in learned] == [(False, 0.9), (True, 0.33)]
