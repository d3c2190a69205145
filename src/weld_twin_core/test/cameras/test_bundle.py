# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cameras: images that become poses, lenses that see as OpenCV does, and noise that goes along."""

import re
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from weld_twin_core import DataError, JointMotion, Measurements, Recording
from weld_twin_core.bundle import adjusted, seen_by
from weld_twin_core.cameras import Camera, Lens, Sightings, Target
from weld_twin_core.cameras.sightings import Fitted
from weld_twin_core.diagnosis.soundness import images as soundness_of_images
from weld_twin_core.pose_noise import PoseNoise, alike, positive

FOCAL, CENTRE = 1500.0, np.array([900.0, 600.0])
BOARD = np.array([[c, r, 0.0] for r in range(4) for c in range(6)]) * 0.03
LENS = Lens([FOCAL, FOCAL], CENTRE, [])


def board_before_camera(rng):
    """Return poses of the board in the camera, some metre away, leant to all sides."""
    out = np.tile(np.eye(4), (14, 1, 1))
    out[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-0.6, 0.6, (14, 3))).as_matrix()
    out[:, :3, 3] = rng.uniform([-0.25, -0.2, 0.8], [0.1, 0.1, 1.2], (14, 3))
    return out


def seen(poses, lens=LENS, mounts=('world', 'tool'), noise=None, real=BOARD):
    there = real @ np.swapaxes(poses[:, :3, :3], 1, 2) + poses[:, None, :3, 3]
    pixel = (FOCAL * there[..., :2] / there[..., 2:] + CENTRE).reshape(-1, 2)
    if noise is not None:
        pixel = pixel + noise
    count = len(BOARD)
    image, none = np.repeat(np.arange(len(poses)), count), np.zeros(len(poses) * count, int)
    target = Target('board', tuple(map(str, range(count))), BOARD, mounts[1], 5e-5)
    return Sightings(
        (Camera('eye', lens, mounts[0]),),
        (target,),
        np.arange(float(len(poses))),
        image,
        none,
        none,
        np.tile(np.arange(count), len(poses)),
        pixel,
    )


@pytest.mark.parametrize('mounts', [('world', 'tool'), ('tool', 'world')])
def test_images_become_poses_of_what_is_on_the_tool(mounts):
    poses = board_before_camera(np.random.default_rng(2))
    found = adjusted(seen(poses, mounts=mounts)).measured
    truth = poses if mounts[0] == 'world' else np.linalg.inv(poses)
    np.testing.assert_allclose(found.position, truth[:, :3, 3], atol=1e-6)
    np.testing.assert_allclose(found.rotation, truth[:, :3, :3], atol=1e-6)


def test_poses_are_as_sure_as_they_are_told_to_be():
    rng = np.random.default_rng(3)
    poses = board_before_camera(rng)
    off = []
    for _ in range(4):
        found = adjusted(seen(poses, noise=rng.normal(0.0, 0.2, (14 * len(BOARD), 2)))).measured
        turned = (
            Rotation.from_matrix(found.rotation) * Rotation.from_matrix(poses[:, :3, :3]).inv()
        )
        error = np.hstack([found.position - poses[:, :3, 3], turned.as_rotvec()])
        known = np.linalg.inv(found.noise.covariance)
        assert (found.noise.covariance[:, 2, 2] > 10.0 * found.noise.covariance[:, 0, 0]).all()
        # What all images share is fitted along with the arm, and so it is here.
        change = found.common.change
        normal = np.einsum('mcz,mcd,mdy->zy', change, known, change) + np.eye(change.shape[2])
        right = np.einsum('mcz,mcd,md->z', change, known, error)
        left = error - change @ np.linalg.solve(normal, right)
        off.append(np.einsum('mi,mij,mj->m', left, known, left).mean())
    # Six coordinates of each pose, of which what is shared takes a few.
    assert 0.7 < np.mean(off) / 6.0 < 1.15


def test_a_lens_that_is_one_per_cent_off_is_found_out():
    poses = board_before_camera(np.random.default_rng(2))
    found = adjusted(seen(poses, lens=Lens([1.01 * FOCAL] * 2, CENTRE, [])))
    assert found.lenses[0].focal == pytest.approx([FOCAL] * 2, rel=5e-4)


def test_what_hangs_on_the_same_side_tells_nothing_of_the_arm():
    with pytest.raises(DataError, match='both on the tool'):
        seen(board_before_camera(np.random.default_rng(2)), mounts=('tool', 'tool'))


EYES, BOARDS = np.tile(np.eye(4), (2, 1, 1)), np.tile(np.eye(4), (2, 1, 1))
EYES[1, :3, :3] = Rotation.from_rotvec([0.1, 0.3, -0.2]).as_matrix()
EYES[1, :3, 3], BOARDS[1, :3, 3] = [-0.3, 0.05, 0.1], [0.05, -0.1, 0.02]
BOARDS[1, :3, :3] = Rotation.from_rotvec([0.2, -0.3, 0.4]).as_matrix()


def by_two(poses, shown):
    """Return what two cameras see of two boards, of each pair in the stamps given."""
    rows = []
    for (c, t), stamps in shown.items():
        for k in stamps:
            board = np.linalg.inv(EYES[c]) @ poses[k] @ BOARDS[t]
            there = BOARD @ board[:3, :3].T + board[:3, 3]
            places = FOCAL * there[:, :2] / there[:, 2:] + CENTRE
            rows += [(k, c, t, i, *place) for i, place in enumerate(places)]
    image, camera, target, point, *pixel = np.array(rows).T
    numbers = [each.astype(int) for each in (image, camera, target, point)]
    names = tuple(map(str, range(len(BOARD))))
    cameras = tuple(Camera(name, LENS, 'world') for name in ('left', 'right'))
    targets = tuple(Target(name, names, BOARD, 'tool', 5e-5) for name in ('near', 'far'))
    return Sightings(cameras, targets, np.arange(14.0), *numbers, np.transpose(pixel))


def test_what_shares_a_stamp_tells_the_other_stamps_and_what_shares_none_is_named():
    poses = board_before_camera(np.random.default_rng(2))
    shown = {(0, 0): range(9), (1, 0): range(6, 12), (0, 1): range(7, 14)}
    found = adjusted(by_two(poses, shown)).measured
    np.testing.assert_allclose(found.position, poses[:, :3, 3], atol=1e-6)
    np.testing.assert_allclose(found.rotation, poses[:, :3, :3], atol=1e-6)
    poses = board_before_camera(np.random.default_rng(2))
    with pytest.raises(DataError, match=r"^camera 'right' is in no image of a stamp that shows"):
        adjusted(by_two(poses, {(0, 0): range(9), (1, 1): range(9, 14)}))


def test_a_board_that_is_less_exact_than_was_said_is_told_and_by_how_much():
    rng = np.random.default_rng(5)
    poses = np.concatenate([board_before_camera(rng) for _ in range(3)])
    real = BOARD + rng.normal(0.0, 4e-4, BOARD.shape)
    images = seen(poses, lens=Lens([1.01 * FOCAL] * 2, CENTRE, []), real=real)
    motion = JointMotion(images.t, np.zeros((len(images.t), 6)), static=True)
    notes = seen_by(Recording('run', motion), images).notes
    off = re.search(r"of target 'board' are off by ([\d.]+) mm, not by 0\.05 mm", ' '.join(notes))
    assert off is not None and float(off[1]) == pytest.approx(0.4, rel=0.2)
    assert '42 of 42 images tell a pose' in notes[0]
    longer = re.search(r'focal length (\S+) %', ' '.join(notes))
    assert float(longer[1]) == pytest.approx(100.0 * (1.0 / 1.01 - 1.0), abs=0.1)


def wrong_with(images, pixel=0.2, off=(0.0, 0.0)):
    """Return kinds and places of what is wrong, by what was found of pixels and of both lenses."""
    fitted = replace(images, fitted=Fitted(pixel, np.outer(off, np.ones(9))))
    return [(found.kind, found.at) for found in soundness_of_images._by_themselves(fitted)]


def facing(images, points=BOARD):
    """Return images of a board that faces them, of points given so."""
    return replace(images, targets=(replace(images.targets[0], points=points, facing=True),))


def test_a_board_seen_from_behind_has_its_points_mirror_wise():
    images = seen(board_before_camera(np.random.default_rng(2)))
    assert not wrong_with(facing(images))
    assert wrong_with(facing(images, BOARD * [-1.0, 1.0, 1.0])) == [
        ('target_mirrored', ('board',))
    ]


def test_what_is_wrong_with_images_is_what_undone_leaves_lenses_as_calibrated(monkeypatch):
    poses = board_before_camera(np.random.default_rng(2))
    images = by_two(poses, {(0, 0): range(3), (1, 0): range(3), (1, 1): range(3)})
    left, right = images.cameras
    right = replace(right, lens=Lens([1.3 * FOCAL] * 2, CENTRE, []))
    swapped = replace(images, cameras=(replace(left, lens=right.lens), replace(right, lens=LENS)))

    def adjusted(trial):
        """Return what a fit finds where the cameras must be those above."""
        good = trial.cameras[1].lens is right.lens and trial.cameras[0].lens is LENS
        return Fitted(0.2 if good else 4.0, np.full((2, 9), 0.0 if good else 40.0))

    monkeypatch.setattr(soundness_of_images, 'adjusted', adjusted)
    assert wrong_with(swapped, 4.0, (40.0, 40.0)) == [('cameras_swapped', ('left',))]
    # The worse of two lenses is told, and none that is as far off as calibrations are.
    assert wrong_with(images, 0.2, (3.0, 40.0)) == [('intrinsics', ('right',))]
    assert not wrong_with(images, 0.2, (1.0, 2.0)) and not wrong_with(images, 1.7, (1.0, 2.0))


BENT = Lens([812.0, 803.0], [331.0, 236.0], [-0.12, 0.07, 8e-4, -5e-4, 0.01])
POINTS = np.random.default_rng(0).uniform([-0.3, -0.25, 0.8], [0.3, 0.25, 1.5], (40, 3))


def by_hand(points):
    """Return pixels by the page of OpenCV, term by term."""
    x, y = (points[:, :2] / points[:, 2:]).T
    k1, k2, p1, p2, k3 = -0.12, 0.07, 8e-4, -5e-4, 0.01
    r = np.hypot(x, y)
    radial = 1 + k1 * r**2 + k2 * r**4 + k3 * r**6
    u = x * radial + 2 * p1 * x * y + p2 * (r**2 + 2 * x**2)
    v = y * radial + p1 * (r**2 + 2 * y**2) + 2 * p2 * x * y
    return np.column_stack([812.0 * u + 331.0, 803.0 * v + 236.0])


def test_a_lens_sees_points_where_opencv_does_and_finds_back():
    seen = BENT.project(POINTS)
    np.testing.assert_allclose(seen, by_hand(POINTS), atol=1e-9)
    np.testing.assert_allclose(BENT.rays(seen), POINTS[:, :2] / POINTS[:, 2:], atol=1e-10)


def test_derivatives_are_finite_differences():
    _, by_point, by_lens = BENT.derivatives(POINTS)
    for k in range(3):
        step = 1e-6 * np.eye(3)[k]
        slope = (BENT.project(POINTS + step) - BENT.project(POINTS - step)) / 2e-6
        np.testing.assert_allclose(by_point[..., k], slope, rtol=1e-5, atol=1e-3)
    for k in range(9):
        step = 1e-6 * np.eye(9)[k]
        slope = (BENT.moved(step).project(POINTS) - BENT.moved(-step).project(POINTS)) / 2e-6
        np.testing.assert_allclose(by_lens[..., k], slope, rtol=1e-5, atol=1e-4)


@pytest.mark.parametrize('clockwise', [True, False])
def test_a_turned_lens_sees_the_turned_image(clockwise):
    x, y = BENT.project(POINTS).T
    stored = np.column_stack([y, 640.0 - x] if clockwise else [480.0 - y, x])
    turn = -np.pi / 2 if clockwise else np.pi / 2
    about = Rotation.from_rotvec([0.0, 0.0, turn]).apply(POINTS)
    turned = BENT.turned(np.array([640.0, 480.0]), clockwise=clockwise)
    np.testing.assert_allclose(turned.project(about), stored, atol=1e-9)


def test_noise_goes_along_when_poses_are_inverted():
    rng = np.random.default_rng(4)
    half = rng.normal(size=(5, 6, 6)) * np.array([1e-4, 2e-4, 1e-3, 1e-3, 2e-3, 3e-4])[:, None]
    covariance = half @ np.swapaxes(half, 1, 2)
    turn = Rotation.from_rotvec(rng.normal(size=(5, 3))).as_matrix()
    where = rng.normal(size=(5, 3))
    noise = PoseNoise.of(covariance)
    np.testing.assert_allclose(noise.covariance, covariance, rtol=1e-6, atol=1e-14)
    given = Measurements(np.arange(5.0), where, turn, noise=noise)
    slope = np.empty((5, 6, 6))
    for k in range(6):
        step = 1e-6 * np.eye(6)[k]
        moved = Rotation.from_rotvec(step[3:]).as_matrix() @ turn
        then = Measurements(np.arange(5.0), where + step[:3], moved).inverted()
        now = given.inverted()
        slope[:, :3, k] = (then.position - now.position) / 1e-6
        away = then.rotation @ np.swapaxes(now.rotation, 1, 2)
        slope[:, 3:, k] = Rotation.from_matrix(away).as_rotvec() / 1e-6
    wanted = slope @ covariance @ np.swapaxes(slope, 1, 2)
    np.testing.assert_allclose(given.inverted().noise.covariance, wanted, rtol=1e-3, atol=1e-11)


def test_a_covariance_that_somebody_typed_in_tells_nothing():
    usual = np.diag([1e-6] * 3 + [1e-4] * 3)
    assert alike(np.stack([usual, usual]))
    assert not alike(np.stack([usual, 2.0 * usual]))
    assert not alike(np.diag([1e-6, 1e-6, 1e-5, 1e-4, 1e-4, 1e-4])[None])
    assert positive(np.stack([usual, np.zeros((6, 6)), -usual])).tolist() == [True, False, False]


def test_a_lens_without_a_focal_length_is_refused():
    with pytest.raises(DataError, match='focal'):
        Lens([0.0, 800.0], [320.0, 240.0], [])


@pytest.mark.parametrize(('count', 'known'), [(3, False), (4, True), (6, False), (8, True)])
def test_a_lens_is_bent_by_as_many_numbers_as_opencv_writes(count, known):
    with nullcontext() if known else pytest.raises(DataError, match=f'got {count}'):
        assert Lens([1.0, 1.0], [0.0, 0.0], [0.1] * count).distortion.sum() == 0.1 * count
