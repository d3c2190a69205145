# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is drawn: shares, strata, determinism; and how large causes are, against hand values."""

from collections import Counter

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from weld_twin_core import DataError, catalog
from weld_twin_lab.blind.blind_cell import motion
from weld_twin_lab.blind.cause_sizes import (
    CONSTRUCTIONS,
    FAMILIES,
    OUTSIDE,
    SIZES,
    construct,
    draw,
    machines,
    scaled,
)
from weld_twin_lab.blind.making import KINDS, STRATA, Lot, lots
from weld_twin_lab.blind.scoring import correlation, rigid, rms

pytest.importorskip('mujoco')

from weld_twin_lab.blind.blind_cell import (
    BlindCell,
    Take,
    deviation,
    floor,
    record,
)
from weld_twin_lab.blind.making import draw_case
from weld_twin_lab.plant.exponentials import Command
from weld_twin_lab.plant.plant import KNOWN
from weld_twin_lab.plant.tracker import Tracker

SIGMA = 2e-5


@pytest.fixture(scope='module')
def robot():
    return catalog.load('ur5')


def test_every_size_that_is_drawn_ends_where_machines_end(robot):
    for family in FAMILIES:
        cause = {'effect': family, 'joint': 'elbow_joint'}
        assert np.isfinite([machines(robot, cause, size) for size in SIZES[family]]).all(), family


@pytest.fixture(scope='module')
def cell(robot):
    return BlindCell(robot, Tracker(rate=60.0, sigma=SIGMA, jitter=2e-5, joint_rate=125.0))


@pytest.fixture(scope='module')
def taken(robot):
    moved = motion('free', robot, 6.0, np.random.default_rng(3))
    return Take(Command(moved.t, moved.q), 11)


def test_every_cause_that_can_be_drawn_is_known_to_the_plant_and_has_a_size(robot):
    rng = np.random.default_rng(0)
    assert set(FAMILIES) == set(SIZES) - set(OUTSIDE)
    assert set(SIZES) | {'measurement_noise'} == set(KNOWN)
    for name, keys in SIZES.items():
        cause = draw(name, robot, 30.0, rng)
        for key in keys:
            np.testing.assert_allclose(scaled(cause, 3.0)[key], 3.0 * np.asarray(cause[key]))


def test_cases_hold_every_kind_in_its_share_every_family_once_and_more_extend_the_list():
    drawn = lots(5, 40, constructions=tuple(CONSTRUCTIONS))
    assert Counter(lot.kind for lot in drawn) == KINDS
    assert len({lot.robot for lot in drawn}) >= 4
    assert {lot.motion for lot in drawn} == {'seams', 'free', 'stations'}
    drawn = lots(5, len(FAMILIES), kinds=('withheld',))
    assert sorted(lot.families[0] for lot in drawn) == sorted(FAMILIES)
    assert lots(5, 60)[:20] == lots(5, 20)
    assert lots(6, 20) != lots(5, 20)


def test_an_unknown_kind_is_refused():
    with pytest.raises(DataError, match='easy'):
        lots(5, 3, kinds=('easy',))


def test_a_case_depends_on_its_seed_alone():
    lot = Lot('double', 'abb_irb120', 'free', ('joint_offset', 'backlash'), (2, 2))
    first, second, other = (
        draw_case(lot, np.random.default_rng(seed), (6.0, 8.0)) for seed in (1, 1, 2)
    )
    assert first.causes == second.causes != other.causes
    made = [record(case.cell, case.causes, case.train) for case in (first, second)]
    np.testing.assert_array_equal(made[0].position, made[1].position)
    np.testing.assert_array_equal(made[0].t_joint, made[1].t_joint)


def test_a_case_shows_its_cause_as_large_as_wanted():
    lot = Lot('single', 'kuka_kr6_r900', 'stations', ('link_length',), (1,))
    case = draw_case(lot, np.random.default_rng(4), (20.0, 20.0))
    tracker = case.cell.tracker
    off = rms(deviation(case.cell, case.causes, case.train)) / (np.sqrt(3.0) * tracker.sigma)
    low, high = STRATA[1]
    assert low / 1.2 < off < high * 1.2
    np.testing.assert_allclose(case.ratios, [off])


def test_a_moved_base_moves_the_tool_by_as_much(cell, taken):
    cause = {'effect': 'base_pose', 'xyz': [3e-4, 0.0, 4e-4], 'rotvec': [0.0, 0.0, 0.0]}
    np.testing.assert_allclose(rms(deviation(cell, [cause], taken)), 5e-4, rtol=1e-6)


def test_a_late_clock_moves_the_tool_by_its_speed(cell, taken):
    cause = {'effect': 'time_delay', 'delay': 0.01}
    clean = record(cell, (), taken, Tracker(rate=60.0))
    speed = np.gradient(clean.position, clean.t_measured, axis=0)
    np.testing.assert_allclose(rms(deviation(cell, [cause], taken)), 0.01 * rms(speed), rtol=0.02)


def test_an_aligned_base_hides_what_a_base_does():
    rng = np.random.default_rng(0)
    points = rng.uniform(-1.0, 1.0, (50, 3))
    moved = points @ Rotation.from_rotvec([1e-5, 2e-5, -1e-5]).as_matrix().T + [1e-3, 0.0, 2e-3]
    off = moved - points
    assert rms(off - rigid(points, off)) < 1e-8
    bent = 1e-3 * points**3
    assert rms(bent - rigid(points, bent)) > 0.5 * rms(bent - bent.mean(axis=0))


def test_the_floor_is_noise_and_jitter_and_outliers_are_set_apart(robot, taken):
    tracker = Tracker(rate=60.0, sigma=SIGMA, outlier_share=0.05, outlier_size=3e-3)
    cause = {'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': 1e-3}
    left, outliers = floor(BlindCell(robot, tracker), [cause], taken)
    np.testing.assert_allclose(left, np.sqrt(3.0) * SIGMA, rtol=0.1)
    assert 5 <= len(outliers) <= 40
    still, shaken = (
        floor(BlindCell(robot, Tracker(rate=60.0, sigma=SIGMA, jitter=jitter)), [], taken)[0]
        for jitter in (0.0, 1e-3)
    )
    assert shaken > 1.5 * still


@pytest.mark.parametrize('name', [n for n in CONSTRUCTIONS if n != 'equal lag'])
@pytest.mark.parametrize('arm', ['ur5', 'kuka_kr6_r900', 'abb_irb120'])
def test_an_ambiguous_construction_is_what_its_like_can_be(name, arm):
    """Some displacement of the like reproduces the deviation to a part in ten thousand."""
    tool = np.eye(4)
    tool[:3, 3] = [0.1, 0.02, 0.2]
    robot = catalog.load(arm).with_frames(tool=tool)
    rng = np.random.default_rng(8)
    moved = motion('free', robot, 6.0, rng)
    cell = BlindCell(robot, Tracker(rate=60.0, sigma=SIGMA))
    taken = Take(Command(moved.t, moved.q), 1)
    built = construct(name, robot, 6.0, rng)
    off = deviation(cell, built.causes, taken).ravel()
    ((family, joint),) = built.alike[0]
    columns = []
    for key, count in ((key, 3 if key in ('xyz', 'rotvec') else 1) for key in SIZES[family]):
        for k in range(count):
            value = [1e-4 * (i == k) for i in range(3)] if count == 3 else 1e-4
            like = {'effect': family, 'xyz': [0.0] * 3, 'rotvec': [0.0] * 3, key: value}
            if joint:
                like = {'effect': family, 'joint': joint, key: value}
            columns.append(deviation(cell, [like], taken).ravel())
    fit, *_ = np.linalg.lstsq(np.stack(columns, axis=1), off, rcond=None)
    left = np.linalg.norm(off - np.stack(columns, axis=1) @ fit) / np.linalg.norm(off)
    assert left < 2e-3


def test_correlation_tells_like_from_unlike():
    a = np.eye(3)
    assert correlation(a, -2.0 * a) == pytest.approx(1.0)
    assert correlation(a, np.roll(a, 1, axis=1)) == 0.0
