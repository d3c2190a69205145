# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How measured arms are divided, and what is borne out by what was kept back."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.io import savemat

import weld_twin_core as wt
from weld_twin_core import DataError, JointMotion, Measurements, Recording, Twin, catalog, effects
from weld_twin_core.diagnosis.calibration.calibrated import Statement
from weld_twin_core.diagnosis.frames.aligned import aligned
from weld_twin_lab.coverage.others import postures_at
from weld_twin_lab.real_arms.borne_out import borne_out
from weld_twin_lab.real_arms.poor import measures, paired, plain_axis
from weld_twin_lab.real_arms.rows import ArmRow
from weld_twin_lab.real_arms.sources import (
    LEAST,
    among,
    halves,
    kept_back,
    places_of,
    servo,
    socket_robot,
    splits,
    touches,
)
from weld_twin_lab.real_arms.study import _examples, reported_claims
from weld_twin_lab.real_arms.unseen import traceback_text


@pytest.fixture(scope='module')
def table():
    """Return 900 stations in a narrow cone of joint space, as the real tables have them."""
    rng = np.random.default_rng(5)
    q = rng.uniform(-1.0, 1.0, (900, 6)) * np.array([0.7, 0.6, 0.6, 1.0, 0.3, 0.3])
    position = 0.3 * q[:, :3] + 0.05 * rng.standard_normal((900, 3))
    t = np.arange(900.0)
    return Recording('t', JointMotion(t, q, None, True), Measurements(t, position))


@pytest.fixture(scope='module')
def found(table):
    return {split.kind: split for split in splits('ur5', table)}


def stamps(recording):
    return set(recording.measured.t)


def test_of_twenty_splits_none_is_judged_on_what_it_was_fitted_on(found):
    assert len(found) == 20
    for split in found.values():
        fitted = stamps(split.train)
        assert len(fitted) >= LEAST
        assert not fitted & stamps(split.inside)
        if split.outside is not None:
            assert not (fitted | stamps(split.inside)) & stamps(split.outside)
    for split in found.values():
        assert split.train.joints.q.shape[0] == split.train.measured.t.size


@pytest.mark.parametrize(('count', 'back'), [(15, 0), (17, 2), (100, 25)])
def test_a_quarter_is_kept_back_evenly_and_from_within_unless_too_few_are_left(count, back):
    fitted, kept = kept_back(np.arange(count))
    assert (fitted.size, kept.size) == (count - back, back)
    assert sorted([*fitted, *kept]) == list(range(count))
    apart = np.diff([0, *kept, count - 1])
    assert back == 0 or np.ptp(apart) <= 1


def test_counts_and_regions_are_as_named(found, table):
    assert [found[f'n{n}'].train.measured.t.size for n in (15, 240)] == [15, 240]
    assert np.ptp(found['still_2'].train.joints.q[:, 1]) <= np.radians(2.0) + 1e-12
    assert np.ptp(found['wrist_2deg'].train.joints.q[:, 4:], axis=0).max() <= np.radians(4.0)
    fitted = found['octant_0'].train.measured.position
    assert (fitted <= np.median(table.measured.position, axis=0)).all()
    assert stamps(found['odd'].train) == stamps(found['even'].inside)


def test_halves_share_nothing(found):
    odd, even = halves(found['n240'].train)
    assert not stamps(odd) & stamps(even) and len(stamps(odd)) == len(stamps(even)) == 120


def test_the_interval_of_a_ratio_holds_it_and_knows_pairs():
    rng = np.random.default_rng(0)
    other = rng.uniform(0.1, 1.0, 400)
    ratio = paired(1.1 * other, other)
    assert np.allclose([ratio['ratio'], ratio['low'], ratio['high']], 1.1)
    apart = paired(rng.permutation(other), other)
    assert apart['low'] < 1.0 < apart['high'] and apart['high'] - apart['low'] > 0.05


def entry(kind, over_best, over_frames, **more):
    best = {'ratio': over_best, 'low': over_best - 0.01, 'high': over_best + 0.01}
    inside = {'stations': 50, 'mean_m': {}, 'rms_m': {'frames': 1.0, 'product': 0.5}}
    inside |= {'over_best': best, 'over_frames': {'ratio': over_frames}, 'flagged': 0.0}
    inside |= {'unflagged_over_frames': {'ratio': over_frames}}
    of = {'name': f'ur5_{kind}', 'robot': 'ur5', 'kind': kind, 'stations': 200}
    said = {'status': 'identified', 'families': ['link_twist'], 'beyond': [], 'traceback': None}
    claimed = {'ratio': 0.5, 'ci95': [0.4, 0.6]}
    return {**of, **said, 'claimed': claimed, 'inside': inside, 'outside': None, **more}


def test_goals_are_reached_by_what_is_good_and_missed_by_what_is_not():
    good = measures([entry('n120', 0.8, 0.3), entry('odd', 0.8, 0.3), entry('even', 0.8, 0.3)])
    assert all(m.reached is not False for m in good)
    worse = [
        entry('n120', 1.2, 1.1, beyond=[['payload', None, 'mass', -10.0, -1.0]]),
        entry('odd', 0.8, 0.3, families=[]),
        entry('even', 0.8, 0.3, claimed={'ratio': 0.9, 'ci95': [0.8, 1.0]}),
        entry('n15', 0.8, 0.3, traceback='ValueError: zero-size', inside=None),
    ]
    missed = [m.what for m in measures(worse) if m.reached is False]
    for words in ('best of the three', 'not flagged', 'interval', 'odd and even', 'plausible'):
        assert any(words in what for what in missed), words
    assert any('nothing named' in what for what in missed)
    assert any('tracebacks' in what for what in missed)


def test_what_was_measured_plane_by_plane_is_elsewhere_afterwards():
    plane = np.stack(np.meshgrid(0.0, np.arange(6) * 0.1, np.arange(6) * 0.1), axis=-1)
    first = plane.reshape(-1, 3)
    later = np.concatenate([first + [0.05, 0.02, 0.0], first + [0.3, 0.0, 0.0]])
    np.testing.assert_array_equal(among(first, later), np.arange(72) < 36)


def test_a_first_fifth_with_nothing_of_the_rest_among_it_is_judged_outside_alone(table):
    far = table.measured.position + np.where(np.arange(900) < 180, 0.0, 5.0)[:, None]
    moved = table.with_measured(Measurements(table.measured.t, far))
    (split,) = [s for s in splits('ur5', moved) if s.kind == 'first_fifth']
    assert split.inside is None
    assert split.outside.measured.t.size == 720


PLACES = {'front': [0.5, 0.0, 0.2], 'left': [0.0, 0.5, 0.4]}
EACH = 6


@pytest.fixture(scope='module')
def data(tmp_path_factory):
    """Return a directory with touches of an exact arm, sockets 50 mm apart."""
    folder, rng = tmp_path_factory.mktemp('data'), np.random.default_rng(2)
    robot = socket_robot(folder, 'kuka_14')
    for place, point in PLACES.items():
        (folder / 'kuka_14' / place).mkdir(parents=True)
        for socket in (0, 1):
            target = np.array(point) + [0.0, 0.05 * socket, 0.0]
            q = postures_at(robot, target, EACH, rng)
            np.savetxt(folder / 'kuka_14' / place / f'hole_{socket}.csv', q, delimiter=',')
    return folder


def test_touches_of_an_exact_arm_do_not_scatter(data):
    assert places_of(data, 'kuka_14') == ('front', 'left')
    recording = touches(data, 'kuka_14', ['left'])
    assert recording.contacts.labels == ('left/0',) * EACH + ('left/1',) * EACH
    _, model = aligned(recording, socket_robot(data, 'kuka_14'), '', ())
    points = model.twin(0).poses(recording, recording.joints.t).position.reshape(2, EACH, 3)
    assert np.ptp(points, axis=1).max() < 1e-8
    assert np.linalg.norm(points[0, 0] - points[1, 0]) == pytest.approx(0.05, abs=1e-8)


def test_files_of_a_traceback_are_told_as_from_their_package_on():
    try:
        wt.load('no robot of this name')
    except Exception:
        told = traceback_text()
    assert (
        'File "weld_twin_core/weld_twin_core/arm/' in told or 'File "weld_twin_core/arm/' in told
    )
    assert str(wt.__file__).rpartition('/weld_twin_core/')[0] not in told


FILE = 'DATA_EMPS.mat'
LAG = 6.5e-3


@pytest.fixture
def published(tmp_path):
    """Return a directory with an axis that lags, and sticks a little as it turns."""
    t = np.arange(0.0, 6.0, 1e-3)[:, None]
    reference = 0.1 * np.sin(1.3 * t)
    speed = 0.13 * np.cos(1.3 * t)
    measured = reference - LAG * speed - 5e-6 * np.sign(speed)
    (tmp_path / 'emps').mkdir()
    savemat(tmp_path / 'emps' / FILE, {'t': t, 'qg': reference, 'qm': measured})
    return tmp_path


def test_plain_models_leave_less_the_more_they_know(published):
    left = plain_axis(servo(published).recording, 3600)
    assert left['as given'] > 50.0 * left['lag'] > 50.0 * left['lag and sign']
    # A square wave without its fundamental, which the lag takes: sqrt(1 - 8 / pi^2) is left.
    assert left['lag'] == pytest.approx(5e-6 * np.sqrt(1.0 - 8.0 / np.pi**2), rel=0.1)


def test_across_the_axis_everything_is_zero(published):
    recording = servo(published).recording
    assert not recording.measured.position[:, :2].any()
    assert recording.joints.q.shape == (6000, 1)


@pytest.mark.parametrize('content', [None, {'x': [1.0]}])
def test_another_file_is_said_to_be_another(tmp_path, content):
    (tmp_path / 'emps').mkdir()
    if content:
        savemat(tmp_path / 'emps' / FILE, content)
    with pytest.raises(DataError, match=FILE):
        servo(tmp_path)


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
