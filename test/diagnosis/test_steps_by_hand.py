# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Small steps of a diagnosis, each held against what can be said of it by hand."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis_cells import known_scale, tiny
from scipy.spatial.transform import Rotation

from weld_twin_core.diagnosis.algebra.fit import fit
from weld_twin_core.diagnosis.algebra.open_directions import shown
from weld_twin_core.diagnosis.algebra.problem import Problem
from weld_twin_core.diagnosis.answer.named_effects import _along, _parted
from weld_twin_core.diagnosis.frames.alignment import chord
from weld_twin_core.diagnosis.predicting.leftover import _shared, _ways
from weld_twin_core.diagnosis.predicting.sizes import Prior, Rows, weighed
from weld_twin_core.diagnosis.soundness.computed import _noise, _paired
from weld_twin_core.diagnosis.soundness.efforts import _Loads
from weld_twin_core.diagnosis.soundness.lag import lag
from weld_twin_core.diagnosis.soundness.mixups import _fixture
from weld_twin_core.diagnosis.soundness.slips import _Seen
from weld_twin_core.diagnosis.soundness.suspicions import turned_bases
from weld_twin_core.diagnosis.unseen.groups import _curved, smooth_field
from weld_twin_core.diagnosis.unseen.unseen_stretches import Unseen
from weld_twin_core.effects import JointOffset
from weld_twin_core.recording import JointMotion, Measurements, Recording

pytestmark = pytest.mark.drawn


def test_a_recording_of_one_station_is_a_block_of_its_own():
    problem, _ = tiny(count=60, turned=False)
    (whole,) = problem.recordings
    one = Recording(
        'one',
        JointMotion(whole.joints.t[:1], whole.joints.q[:1], static=True),
        whole.measured.take(np.arange(60) < 1),
    )
    labels = Problem((one, whole, replace(one, name='another')), frozenset()).block_labels(6)
    assert not set(labels[:3]) & set(labels[3:])
    assert not set(labels[-3:]) & set(labels[:-3])


@pytest.mark.parametrize(
    ('turn', 'told'),
    [
        ([90.0, 0.0, 0.0], 'by 90 degrees about its x axis'),
        ([0.0, -90.0, 0.0], 'by -90 degrees about its y axis'),
        ([0.0, 0.0, 180.0], 'by 180 degrees about its z axis'),
        ([120.0 / np.sqrt(3.0)] * 3, 'by 120 degrees about its axis (+1, +1, +1)'),
    ],
)
def test_a_turned_base_is_told_by_its_axis(turn, told):
    matrix = Rotation.from_rotvec(turn, degrees=True).as_matrix()
    pairs = [(each.mend.keywords['turn'], each.sentence) for each in turned_bases()]
    (sentence,) = (words for other, words in pairs if np.allclose(other, matrix))
    assert told in sentence


def test_a_computed_pose_is_held_against_the_joints_before_and_after_it():
    t = np.arange(5.0)
    joints = JointMotion(t, 0.1 * t[:, None] * np.ones(6))
    seen = Measurements(np.array([1.25, 2.5]), np.zeros((2, 3)))
    case = SimpleNamespace(
        recordings=[Recording('poses', joints, seen)], motions=[joints.at(seen.t)[0]]
    )
    at, before, after = (each.joints.q[:, 0] for each in _paired(case, 0))
    assert at == pytest.approx([0.125, 0.25])
    assert before == pytest.approx([0.1, 0.2])
    assert after == pytest.approx([0.2, 0.3])


def test_turns_of_the_tool_are_open_where_its_point_alone_was_measured():
    problem, model = tiny(count=30, align=('tool',), turned=False)
    names, _, strength, _ = shown(problem, model)
    assert len(names) == 6
    assert (strength[:3] < 1e-6 * strength[3:].min()).all()
    assert [name.partition('.')[2] for name in shown(problem, model, moving=True)[0]] == [
        '0',
        '1',
        '2',
    ]
    # A base that shifts along one axis moves no point along the others, and shows all the same.
    both = tiny(count=30, align=('base', 'tool'), turned=False)
    assert len(shown(*both, moving=True)[0]) == 6 + 3


@pytest.mark.parametrize(('count', 'knots'), [(60, 7), (450, 21)])
def test_fine_curves_of_an_angle_take_many_measurements(count, knots):
    problem, model = tiny(count=count, static=False)
    groups = _curved(problem.features(model), model)
    angles = [curves for at, on, curves in groups if (at, on) == ('elbow_joint', 'angle')]
    found = {len(curves[0].knots) for curves in angles if len(curves) == 1}
    assert max(found) == knots


def test_a_fixture_is_told_by_how_far_it_lies_and_is_turned(ur5):
    base = np.eye(4)
    base[:3, :3] = Rotation.from_rotvec([0.0, 0.0, 30.0], degrees=True).as_matrix()
    base[:3, 3] = [0.0, 0.0, 0.25]
    told = _fixture(ur5, [np.eye(4), base], 'nothing is left').sentence
    assert 'of recording 2' in told
    assert 'lies 250' in told
    assert 'turned by 30.0 degrees' in told


def test_the_noise_of_a_joint_is_what_a_smooth_path_lacks():
    t = np.linspace(0.0, 20.0, 4000)
    noise = np.random.default_rng(1).normal(scale=[1e-5, 3e-5], size=(4000, 2))
    assert _noise(np.sin(t)[:, None] + noise) == pytest.approx([1e-5, 3e-5], rel=0.05)


@pytest.mark.parametrize('late', [0.15, -0.1])
def test_measurements_that_go_on_after_the_joints_still_tell_how_late_they_are(late):
    joints, t = np.linspace(0.0, 10.0, 1001), np.linspace(-0.4, 10.4, 1081)

    def at(t):
        return np.stack([np.sin(t), np.cos(1.7 * t), np.sin(0.6 * t)], axis=1)

    found = lag(joints, at(joints), t, at(t - late))
    assert (found.late, found.rate) == (
        pytest.approx(late, abs=1e-4),
        pytest.approx(0.0, abs=1e-4),
    )
    assert found.after < 0.01 * found.before


@pytest.mark.parametrize('of_gears', [True, False])
def test_what_is_left_is_the_tools_where_it_is_even_and_the_gears_where_it_grows_with_their_lever(
    of_gears,
):
    rng = np.random.default_rng(2)
    arm = rng.uniform(0.1, 1.0, (4000, 1)) * np.array([1.0, 0.0, 0.0])
    errors = arm * rng.normal(scale=2e-4, size=(4000, 1)) + 1e-5 * rng.normal(size=(4000, 3))
    if not of_gears:
        errors = rng.normal(scale=3e-5, size=(4000, 3))
    one, still = np.ones(1, dtype=bool), np.zeros((4000, 3))
    found = _shared(errors, np.zeros((4000, 3, 3)), arm[:, :, None], still, one)
    assert found.surely is of_gears
    if of_gears:
        # Gears err along their lever alone, and the size is that of errors in all directions.
        assert found.position < 2.5e-5
        assert 1e-4 < found.gears[0] < 2e-4
    else:
        assert found.position == pytest.approx(3e-5, rel=0.05)
        assert found.gears[0] == pytest.approx(0.0, abs=1e-5)


def test_what_one_joint_alone_leaves_is_not_laid_on_the_others_and_not_on_the_instrument():
    rng = np.random.default_rng(6)
    levers = rng.normal(scale=0.5, size=(1000, 3, 4))
    noise = rng.normal(size=(1000, 3)) * np.array([1e-5, 1e-5, 3e-5])
    shaking = noise + levers[..., 2] * rng.normal(scale=2e-4, size=(1000, 1))
    every, still = np.ones(4, dtype=bool), np.zeros((1000, 3))
    found = _shared(shaking, np.zeros((1000, 3, 3)), levers, still, every)
    assert found.surely and np.flatnonzero(found.gears).tolist() == [2]
    assert found.gears[2] == pytest.approx(2e-4, rel=0.15)
    # An instrument that is less sure along one direction is still an instrument.
    assert not _shared(noise, np.zeros((1000, 3, 3)), levers, still, every).surely


def test_of_two_errors_that_look_alike_the_sum_is_known_and_neither_part():
    rng = np.random.default_rng(3)
    x, y, noise = rng.normal(size=(3, 500))
    rows = Rows(np.stack([x, x + 0.02 * y]), 3.0 * x + noise, 1.0)
    no = np.zeros(1, bool)
    prior = Prior(np.zeros(2), np.full(2, 2.0), np.zeros(2, int), no, no)
    found = weighed(rows, prior, 1.0)
    assert found.mean.sum() == pytest.approx(3.0, abs=0.2)
    assert found.covariance.sum() < 0.01 * np.trace(found.covariance)


@pytest.mark.parametrize(('factor', 'alike'), [(3.0, 1.0), (-0.2, -1.0)])
def test_loads_are_alike_whatever_their_unit_and_their_middle(ur5, factor, alike):
    load = np.random.default_rng(4).normal(size=(6, 40))
    none = np.zeros((0, 6, 40))
    seen = _Loads(ur5, load, factor * load + 7.0, none, none, none)
    assert seen.correlation() == pytest.approx(alike)


def test_the_age_of_a_sample_goes_from_none_to_all_of_its_recording():
    stamps = SimpleNamespace(seen=SimpleNamespace(t=np.array([5.0, 6.0, 9.0])))
    seen = SimpleNamespace(problem=SimpleNamespace(recordings=[stamps]))
    assert _Seen._age(seen, 0) == pytest.approx([0.0, 0.25, 1.0])


def test_a_smooth_field_has_slopes_and_bends_of_all_three_coordinates():
    problem, model = tiny(count=60, turned=False)
    (maker,) = problem.features(model)
    columns = smooth_field(maker)[:, :3].reshape(27, -1)
    assert np.linalg.matrix_rank(columns) == 27


def test_turns_are_as_far_apart_as_the_ends_of_two_pointers():
    turned = Rotation.from_rotvec([0.0, 0.0, 60.0], degrees=True).as_matrix()
    assert chord(np.eye(3), turned) == pytest.approx(2.0 * np.sin(np.radians(30.0)))


def test_effects_move_the_tool_along_with_all_of_them_and_have_parts_of_that():
    zeros = (JointOffset('shoulder_lift_joint', 8e-4), JointOffset('elbow_joint', -5e-4))
    problem, model = tiny(zeros, count=20, turned=False)
    scale = known_scale(problem)
    found = fit(problem, model.with_found(zeros), scale)
    unseen = Unseen.of(problem, scale, found, np.zeros(0))
    moved = np.array([[0.0, 0.0], [2e-4, -1e-4]])
    along, (recording,) = _along(unseen, moved), problem.recordings

    def tip(*effects):
        return model.with_found(effects).twin(0).poses(recording, recording.seen.t).position

    for row, off in zip(along, moved, strict=True):
        each = [
            replace(e, offset=e.offset + d) for e, d in zip(found.model.found, off, strict=True)
        ]
        alone = [tip(e) - tip() for e in each]
        expected = [float((one * (alone[0] + alone[1])).sum()) for one in alone]
        assert row == pytest.approx(expected, rel=5e-3)
    assert _parted(np.array([[3.0, 1.0], [2.0, -1.0]])).tolist() == [[0.75, 0.25], [1.0, 0.0]]


def test_ways_in_which_rows_may_be_off_add_up_to_their_covariance():
    rng = np.random.default_rng(8)
    root, columns = rng.normal(size=(4, 4)) * [1e-3, 1.0, 50.0, 1.0], rng.normal(size=(4, 7))
    covariance = root.T @ root
    ways = _ways(covariance, columns)
    np.testing.assert_allclose(ways.T @ ways, columns.T @ covariance @ columns, rtol=1e-4)
