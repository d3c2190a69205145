# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Of all kinds of error fitted together, those are named that unseen stations need, on their joints."""

from dataclasses import replace

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.diagnosis.beliefs import Beliefs
from weld_twin_core.diagnosis.frames.aligned import aligned
from weld_twin_core.diagnosis.hypotheses.search import search
from weld_twin_core.diagnosis.many.small_errors import many_small
from weld_twin_core.diagnosis.many.weighed_families import weighed_families
from weld_twin_core.diagnosis.unseen.unseen_stretches import Unseen
from weld_twin_core.effects import REGISTRY, BearingTilt

KINDS = (
    'joint_offset',
    'link_length',
    'link_offset',
    'link_twist',
    'joint_compliance',
    'gear_ratio',
)
TURNS = ('theta_offset', 'alpha')
MIDDLE = np.array([0.0, -1.2, 1.3, -1.2, -1.5, 0.0])
GRAVITY = np.array([0.0, 0.0, -9.80665])


class Arm:
    """An arm of its own: rows multiplied out one by one, springs bent by the weight of the links."""

    def __init__(self, robot):
        self.rows = robot.to_mapping()['joints']
        self.links = robot.to_mapping()['links']

    def frames(self, q, rows):
        out = [np.eye(4)]
        for angle, row in zip(q, rows, strict=True):
            (ct, ca), (st, sa) = (
                f([angle + row['theta_offset'], row['alpha']]) for f in (np.cos, np.sin)
            )
            a, d = row['a'], row['d']
            turn = [[ct, -st * ca, st * sa], [st, ct * ca, -ct * sa], [0.0, sa, ca]]
            step = np.eye(4)
            step[:3, :3], step[:3, 3] = turn, [a * ct, a * st, d]
            out.append(out[-1] @ step)
        return out

    def torque(self, q, rows):
        """Return the torque of the links' weight about every axis [N m]."""
        frames, out = self.frames(q, rows), np.zeros(len(q))
        for k, link in enumerate(self.links):
            centre = frames[k + 1] @ np.append(link['com'], 1.0)
            for i in range(k + 1):
                axis, origin = frames[i][:3, 2], frames[i][:3, 3]
                out[i] += axis @ np.cross(centre[:3] - origin, link['mass'] * GRAVITY)
        return out

    def point(self, q, changes=(), springs=None):
        """Return where the tool is with wrong numbers of rows, and with springs [rad/(N m)]."""
        rows = [dict(row) for row in self.rows]
        for joint, key, by in changes:
            rows[joint][key] += by
        bent = np.array(q)
        for _ in range(3 if springs is not None else 0):
            bent = q + springs * self.torque(bent, rows)
        return self.frames(bent, rows)[-1][:3, 3]


def told(half, **drawn):
    """Return the kinds that are named for an arm measured at stations, by their names."""
    families = weighed(half, **drawn).families
    return {f.effect: f for f in families if f.missed(Beliefs().family_worth)}


def weighed(half, *, springs=None, changes=(), align='base,tool', count=60, seed=1, beside=()):
    """Return all kinds as they are weighed for an arm measured at stations."""
    robot = wt.load('ur10')
    rng = np.random.default_rng(seed)
    q = MIDDLE + rng.uniform(-1.0, 1.0, (count, 6)) * half
    arm, t = Arm(robot), 5.0 * np.arange(count)
    place = np.array([arm.point(each, changes, springs) for each in q])
    place += 2e-5 * rng.standard_normal(place.shape)
    stations = wt.Recording(
        'stations', wt.JointMotion(t, q, static=True), wt.Measurements(t, place)
    )
    problem, start = aligned([stations], robot, align, ())
    start = start.with_found(beside)
    rest = [name for name in REGISTRY if name not in KINDS]
    few = search(problem, start, [*rest, *KINDS], Beliefs(), lambda text: None)
    fit, scale, precision = many_small(problem, start, rest, Beliefs(), lambda text: None)
    many = replace(few, final=fit, scale=scale, precision=precision, candidate_sets=(), dense=True)
    unseen = Unseen.of(problem, scale, fit, precision)
    return weighed_families(many, unseen, Beliefs())


def test_sag_of_two_axes_among_dozens_of_small_errors_is_named_with_its_joints():
    rng = np.random.default_rng(5)
    small = [
        (k, key, size * rng.standard_normal())
        for k in range(6)
        for key, size in (('a', 4e-5), ('d', 4e-5), ('theta_offset', 5e-5), ('alpha', 5e-5))
    ]
    springs = np.array([0.0, 8e-6, 1.2e-5, 0.0, 0.0, 0.0])
    found = told(1.2, springs=springs, changes=small, count=90)
    sag = found['joint_compliance']
    joints = [site.joint for site, share in sag.needed if share > 0.1]
    assert sorted(joints) == ['elbow_joint', 'shoulder_lift_joint']
    assert sag.growth > 0.5
    assert sag.share == max(each.share for each in found.values()) > 0.5
    assert 'gear_ratio' not in found


@pytest.mark.parametrize(
    ('change', 'kind'), [((2, 'alpha', 8e-4), 'link_twist'), ((1, 'a', 4e-4), 'link_length')]
)
def test_one_cause_and_noise_gets_no_other_kind(change, kind):
    found = told(1.2, changes=[change])
    assert list(found) == [kind]
    (site, share), *_ = found[kind].needed
    assert site.joint == wt.load('ur10').joint_names[change[0]] and share > 0.8


def test_links_along_parallel_axes_are_told_together():
    """The offset of one is that of the next: left out one by one, none of them is ever missed."""
    found = told(1.2, changes=[(2, 'd', 1e-3), (4, 'd', 1e-4)])
    shares = {site.joint: share for site, share in found['link_offset'].needed}
    parallel = {'shoulder_lift_joint', 'elbow_joint', 'wrist_1_joint'}
    assert parallel < set(shares)
    assert sum(shares[joint] for joint in parallel) > 0.5


def test_what_not_every_arm_has_is_named_only_beside_all_that_every_arm_has():
    """A bearing that wobbles predicts better than any one kind, but all wrong links together do it."""
    rng = np.random.default_rng(3)
    turned = [(k, key, 6e-4 * rng.standard_normal()) for k in range(1, 5) for key in TURNS]
    wobbling = tuple(BearingTilt(joint, [1e-5] * 4) for joint in wt.load('ur10').joint_names[1:4])
    named = set(told(0.5, changes=turned, beside=wobbling))
    assert 'link_twist' in named and named <= {'joint_offset', 'link_twist'}


@pytest.fixture(scope='module')
def two_kinds():
    """Return an arm with a wrong length and a wrong twist, weighed."""
    return weighed(1.2, changes=[(1, 'a', 3e-4), (2, 'alpha', 6e-4)])


def test_kinds_that_are_each_doubted_are_one_set_where_that_is_believed(two_kinds):
    before = {f.effect: f for f in two_kinds.families}
    named = [f for f in two_kinds.families if f.missed(Beliefs().family_worth)]
    assert {f.effect for f in named} == {'link_length', 'link_twist'}
    as_one = two_kinds.joined(
        [replace(f, named=True) for f in named], lambda f, _: 0.4 + 0.3 * bool(f.joined)
    )
    [whole] = [f for f in as_one if f.joined]
    assert {whole.effect, *whole.joined} == {'link_length', 'link_twist'}
    assert {site.effect for site, _ in whole.like} >= set(whole.joined)
    assert whole.share == pytest.approx(sum(f.share for f in named))
    assert sum(f.share for f in as_one) == pytest.approx(sum(f.share for f in before.values()))
    # Without both unseen data are worse off than without either.
    assert whole.growth > max(f.growth for f in named)
    assert [f.effect for f in as_one if f.missed(Beliefs().family_worth)] == [whole.effect]


@pytest.mark.parametrize('probability', [0.4, 0.6])
def test_kinds_that_are_believed_by_themselves_or_not_even_together_stay_as_they_are(
    two_kinds, probability
):
    named = [replace(f, named=f.missed(0.1)) for f in two_kinds.families]
    assert two_kinds.joined(named, lambda *_: probability) == two_kinds.families


def test_noise_alone_gets_no_kind():
    assert told(1.2) == {}


def test_what_would_do_as_well_on_these_postures_is_told_beside():
    """Over a few degrees a wrong gear is a wrong zero, and a spring under the same weight."""
    half = [0.9, 0.06, 0.9, 0.9, 0.9, 0.9]
    found = told(half, changes=[(1, 'theta_offset', 2e-4)], align='', count=40)
    (first,) = found.values()
    names = {first.effect, *(site.effect for site, _ in first.like)}
    assert {'joint_offset', 'gear_ratio'} <= names
    assert all(0.0 < part <= 1.0 for _, part in first.like)
