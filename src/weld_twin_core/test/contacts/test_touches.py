# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Touches of a pin, a ball, a face, held against what can be worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import weld_twin_core as wt
from weld_twin_core import Beliefs, DataError
from weld_twin_core.contacts import Artefact, Contact, Contacts, Tie, places, spreads
from weld_twin_core.diagnosis.algebra.fit import design, fit
from weld_twin_core.diagnosis.algebra.problem import Scale
from weld_twin_core.diagnosis.frames.aligned import _tool_point, aligned
from weld_twin_core.diagnosis.unseen import where
from weld_twin_core.diagnosis.unseen.unseen_stretches import Unseen
from weld_twin_core.motion.inverse.newton import reaching

SIGMA = 1e-4


def two_links():
    """Return a planar arm of two links, 0.5 m and 0.4 m."""
    rows = [{'name': 'shoulder', 'a': 0.5}, {'name': 'elbow', 'a': 0.4}]
    zero = {'alpha': 0.0, 'd': 0.0, 'theta_offset': 0.0, 'lower': -3.0, 'upper': 3.0}
    entry = {'name': 'planar', 'joints': [row | zero | {'max_velocity': 1.0} for row in rows]}
    return wt.Robot.from_mapping(entry)


def touching(robot, postures, labels, *, kinds='point', ties=()):
    """Return a recording of postures and what they touched."""
    names = dict.fromkeys(labels)
    artefact = Artefact(tuple(Contact(name, kinds) for name in names), tuple(ties))
    motion = wt.JointMotion(np.arange(float(len(postures))), postures, static=True)
    return wt.Recording('touches', motion, contacts=Contacts(artefact, tuple(labels)))


def fitted(recording, robot, effects=(), align='', sigma=SIGMA):
    """Return the fit of effects that start at zero."""
    problem, model = aligned(recording, robot, align, ())
    scale = Scale(sigma, 1.0, tuple(np.ones(m) for m in problem.samples))
    free = np.full(sum(e.fit.coordinates().size for e in effects), 1e-12)
    return problem, fit(problem, model.with_found(tuple(effects)), scale, free)


def test_three_touches_of_a_pin_tell_the_elbow_offset():
    # With the elbow up and down on the same pin, the two true elbow angles are b and -b. Each
    # reading is short of the true angle by the offset, so the offset is minus their mean.
    up, down = 1.2 - 0.004, -1.2 - 0.004
    reach = np.sqrt(0.5**2 + 0.4**2 + 2 * 0.5 * 0.4 * np.cos(1.2))
    inner = np.arccos((0.5**2 + reach**2 - 0.4**2) / (2 * 0.5 * reach))
    postures = np.array([[0.3 - inner, up], [0.3 + inner, down], [0.3 - inner, up]])
    recording = touching(two_links(), postures, ['pin'] * 3)

    _, found = fitted(recording, two_links(), [wt.effects.JointOffset('elbow', offset=0.0)])

    assert found.coordinates[0] == pytest.approx(-(up + down) / 2, abs=1e-9)
    assert found.rss < 1e-9


def test_what_is_left_of_touches_depends_on_joints_alone(monkeypatch):
    """No instrument measured that could err from place to place, and a touch has no time."""
    monkeypatch.setattr(where, 'NAMED', 99)
    postures = np.random.default_rng(1).uniform(0.5, 0.9, (24, 2))
    problem, model = aligned(touching(two_links(), postures, ['a', 'b'] * 12), two_links(), '', ())
    scale = Scale(SIGMA, 1.0, tuple(np.ones(m) for m in problem.samples))
    bare = fit(problem, model, scale)
    unseen = Unseen.of(problem, scale, bare, np.zeros(0))
    everything = Beliefs(dependence_gain=-np.inf, steady=-np.inf)
    told = where.structure(unseen, model, bare, everything).depends_on
    assert told and all(name.endswith((' shoulder', ' elbow')) for name in told)


def test_a_touch_left_out_does_not_help_to_find_its_pin():
    """Else a handful of touches is foretold to a micrometre by anything that fits the others."""
    postures = np.random.default_rng(1).uniform(0.5, 0.9, (8, 2))
    recording = touching(two_links(), postures, ['pin'] * 8)
    problem, bare = fitted(recording, two_links())
    scale = Scale(SIGMA, 1.0, (np.ones(8),))
    told = problem.measured_rows(Unseen.of(problem, scale, bare, np.zeros(0)).whole, scale)[0]
    points = wt.Twin(two_links()).poses(recording, recording.joints.t).position
    others = (points.sum(axis=0) - points) / 7
    off = np.linalg.norm(points - others, axis=1)
    np.testing.assert_allclose(np.linalg.norm(told, axis=1), off, rtol=1e-6)


def test_the_shoulder_offset_is_not_seen_by_a_pin():
    postures = np.array([[0.1, 1.2], [1.2, -1.2], [0.1, 1.2]])
    recording = touching(two_links(), postures, ['pin'] * 3)

    problem, model = aligned(recording, two_links(), '', ())
    before = problem.residuals(model)[0]
    turned = model.with_found((wt.effects.JointOffset('shoulder', offset=0.01),))

    off = [np.linalg.norm(part, axis=0) for part in (before, problem.residuals(turned)[0])]
    np.testing.assert_allclose(off[0], off[1], atol=1e-12)


def test_four_point_tool_calibration_is_a_special_case_with_its_uncertainty():
    robot, rng = wt.load('ur5'), np.random.default_rng(3)
    tool = np.array(robot.T_flange_tool)
    tool[:3, 3] = [0.02, -0.05, 0.19]
    placed, spike = robot.with_frames(tool=tool), np.tile([0.45, 0.1, 0.3], (20, 1))
    postures, good = reaching(placed, spike, rng.uniform(-1.5, 1.5, (20, 6)))
    recording = touching(robot, postures[good][:4], ['spike'] * 4)
    flange = wt.Twin(robot.with_frames(tool=np.eye(4))).poses(recording, recording.joints.t)

    # What a controller does with four postures: rotations times tip, minus one point, is minus
    # the flange; unknown are the tip and the point.
    columns = np.concatenate([np.hstack([turn, -np.eye(3)]) for turn in flange.rotation])
    tip = np.linalg.lstsq(columns, -flange.position.ravel(), rcond=None)[0][:3]
    deviation = SIGMA * np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))[:3]

    _, aligned_fit = fitted(recording, robot, align='tool')
    np.testing.assert_allclose(tip, tool[:3, 3], atol=1e-6)
    np.testing.assert_allclose(aligned_fit.model.robot.T_flange_tool[:3, 3], tip, atol=1e-6)

    free = [wt.effects.ToolPose(xyz=np.zeros(3), rotvec=np.zeros(3))]
    problem, told = fitted(recording, placed, free)
    scale = Scale(SIGMA, 1.0, tuple(np.ones(m) for m in problem.samples))
    inverse = np.linalg.pinv(design(problem, told.model, scale).T)
    np.testing.assert_allclose(np.linalg.norm(inverse, axis=1)[:3], deviation, rtol=1e-3)


def test_a_known_distance_between_two_sockets_gives_the_scale():
    # Two pins on a line through the shoulder, both links 2 % longer than the model has them. Each
    # pin alone fits an arm of any size; their known distance tells it.
    true, arm = 1.02, two_links()
    postures, labels = [], []
    for name, reach in (('near', 0.6), ('far', 0.8)):
        for elbow in (1.0, -1.0):
            bend = np.arccos((reach**2 - true**2 * (0.25 + 0.16)) / (2 * true**2 * 0.2))
            inner = np.arccos((0.25 * true**2 + reach**2 - 0.16 * true**2) / (true * reach))
            postures += [[-elbow * inner, elbow * bend]]
            labels += [name]
    tie = Tie(('near', 'far'), 0.2, 1e-5)
    lengths = [wt.effects.LinkLength(joint, da=0.0) for joint in arm.joint_names]
    recording = touching(arm, np.array(postures), labels, ties=[tie])

    _, found = fitted(recording, arm, lengths, sigma=1e-5)

    np.testing.assert_allclose(found.coordinates, [0.01, 0.008], atol=2e-5)


@pytest.mark.parametrize('kind', ['plane', 'line', 'sphere', 'length'])
def test_columns_are_the_derivatives_of_residuals_once_places_are_fitted(kind):
    rng = np.random.default_rng(5)
    points = surface_points(kind, rng) + rng.normal(0.0, 1e-4, (12, 3))
    value = np.linalg.norm(points - [0.1, 0.2, 0.0], axis=1) if kind == 'length' else None
    contacts = Contacts(Artefact((Contact('it', kind),)), ('it',) * 12, value)
    here = places(contacts, points)
    residual, seen, free = here.rows(points)
    push = rng.normal(0.0, 1.0, points.shape)
    step = 1e-6

    moved, _, _ = here.rows(points + step * push)
    np.testing.assert_allclose(
        (moved - residual) / step, -np.einsum('mci,mi->mc', seen, push), atol=1e-4
    )
    for j, unit in enumerate(np.eye(free.shape[2])):
        changed, _, _ = here.moved(step * unit).rows(points)
        np.testing.assert_allclose((changed - residual) / step, free[:, :, j], atol=1e-4)
    assert np.abs(np.einsum('mcz,mc->z', free, residual)).max() < 1e-6


def surface_points(kind, rng):
    """Return twelve points on a surface of a kind."""
    along = rng.uniform(-0.1, 0.1, (12, 2))
    if kind == 'plane':
        return np.column_stack([along, 0.3 + 0.2 * along[:, 0]])
    if kind == 'line':
        return np.outer(along[:, 0], [0.6, 0.8, 0.0]) + [0.1, 0.2, 0.3]
    ways = rng.normal(size=(12, 3))
    return 0.05 * ways / np.linalg.norm(ways, axis=1)[:, None] + [0.1, 0.2, 0.0]


def test_a_posture_has_as_many_rows_as_the_kind_that_gives_most():
    artefact = Artefact((Contact('a', 'plane'), Contact('b', 'line'), Contact('c', 'point')))
    assert Contacts(artefact, ('a', 'b', 'a')).rows == 2


def test_spread_is_the_mean_distance_to_the_middle():
    points = np.array([[0.0, 0.0, 0.0], [0.002, 0.0, 0.0], [5.0, 1.0, 0.0], [5.0, 1.0, 0.004]])
    artefact = Artefact((Contact('a'), Contact('b')))
    found = spreads(Contacts(artefact, ('a', 'a', 'b', 'b')), points)
    np.testing.assert_allclose(found['a'], [0.001, 0.001])
    np.testing.assert_allclose(found['b'], [0.002, 0.002])


@pytest.mark.parametrize(
    ('entry', 'message'),
    [
        ({'contacts': {'a': {'kind': 'cube'}}}, 'a kind is one of point, length'),
        ({'sockets': {}}, 'an artefact has contacts, blocks, distances and angles; got sockets'),
        (
            {'contacts': {'a': 'point'}, 'distances': [{'between': ['a', 'b'], 'value': 1.0}]},
            "there is no contact 'b' in the artefact; it has a",
        ),
        (
            {'contacts': {'a': 'point', 'b': 'plane'}, 'distances': [{'between': ['a', 'b']}]},
            'a value in distances must be a number, got None',
        ),
        (
            {'contacts': {'a': 'point'}, 'distances': [{'between': ['a', 'a'], 'value': 1.0}]},
            'the distance between a and a: name two different contacts',
        ),
    ],
)
def test_an_artefact_that_makes_no_sense_is_refused(entry, message):
    with pytest.raises(DataError, match=message):
        Artefact.from_mapping(entry)


def test_a_single_touch_is_refused():
    recording = touching(two_links(), np.zeros((2, 2)), ['a', 'b'])
    with pytest.raises(DataError, match="contact 'a' of touches has 1 postures; touch it in at"):
        aligned(replace(recording), two_links(), '', ())


def test_touches_told_to_be_rough_hardly_count():
    robot = two_links()
    postures, labels = elbow_up_and_down(0.004)
    rough = np.arange(len(postures)) % 3 == 0
    postures[rough, 1] += np.where(np.arange(len(postures)) % 2 == 0, 0.02, 0.016)[rough]
    sigma = np.where(rough, 1e-2, 1e-4)
    offset = wt.effects.JointOffset('elbow', offset=0.0)

    found = {}
    for name, told in (('told', sigma), ('not told', None)):
        recording = touching(robot, postures, labels)
        contacts = replace(recording.contacts, sigma=told)
        problem, model = aligned(replace(recording, contacts=contacts), robot, '', ())
        scale = problem.unit_scale()
        found[name] = fit(problem, model.with_found((offset,)), scale).coordinates[0]

    assert found['told'] == pytest.approx(0.004, abs=2e-5)
    assert abs(found['not told'] - 0.004) > 1e-3


def elbow_up_and_down(offset):
    """Return postures of one pin with the elbow up and down, as an arm reads that is short."""
    postures, labels = [], []
    for bend in (0.8, 1.2, 1.6):
        reach = np.sqrt(0.5**2 + 0.4**2 + 2 * 0.5 * 0.4 * np.cos(bend))
        inner = np.arccos((0.5**2 + reach**2 - 0.4**2) / (2 * 0.5 * reach))
        for sign in (1.0, -1.0, 1.0, -1.0):
            postures.append([0.3 - sign * inner, sign * bend - offset])
            labels.append(f'pin {bend}')
    return np.array(postures), labels


def test_the_tool_point_is_what_stays_in_place_and_one_slip_does_not_move_it():
    rng, tip = np.random.default_rng(3), np.array([0.02, -0.05, 0.3])
    touched = []
    for pin in ([0.6, 0.1, 0.2], [0.4, -0.3, 0.1]):
        turn = Rotation.from_rotvec(rng.uniform(-1.0, 1.0, (6, 3))).as_matrix()
        touched.append((pin - turn @ tip, turn))
    np.testing.assert_allclose(_tool_point(touched), tip, atol=1e-9)
    touched[1][0][2] += [0.0, 5e-3, 0.0]
    np.testing.assert_allclose(_tool_point(touched), tip, atol=1e-3)
