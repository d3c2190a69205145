# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Where cameras and targets are on their mounts, and where the tool was, from single images.

Points of a plane give a homography [1]_; points in space a view from far away, made nearer step
by step [2]_. Either is refined by least squares; of a plane its mirror image is tried as well,
since a board far away looks the same tilted to either side.

References
----------
.. [1] Z. Zhang, "A flexible new technique for camera calibration", IEEE PAMI 22, 2000.
.. [2] D. DeMenthon, L. Davis, "Model-based object pose in 25 lines of code", IJCV 15, 1995.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arm.rotation import nearest_rotation, rotation_matrix, rotation_vector, skew, transform
from ..arrays import Array
from ..errors import DataError
from .sightings import Lens, Sightings

_LEVER = 0.5
"""Length [m] at which a turn counts against a shift where views are compared: a tool's reach."""
_COMPARED = 60
"""Views that are compared with each other at the most, to find the one that most agree with."""

_FEWEST = 4
"""Points of a target in an image from which its pose follows."""
_FLAT = 1e-3
"""Thickness over width below which points are taken for a plane."""
_STEPS = 15
"""Least-squares steps at the most; five are usual."""
_CLOSER = 10
"""Rounds in which a view from far away is made nearer."""
_STRETCHED = 1e-4
"""Width over length below which points are a line, of which no pose follows."""
_DAMPED = 1e-9
"""Damping of a step, in units of its columns."""


class _View(NamedTuple):
    """One target in one image: stamp, the bodies on the world and on the tool, and their relation."""

    image: int
    world: int
    tool: int
    pose: Array


@dataclass(frozen=True, eq=False)
class Bodies:
    """A start for everything that is not known."""

    poses: Array
    """Of cameras, then targets, each in the first body on its mount, shape (B, 4, 4)."""
    free: tuple[int, ...]
    """The bodies that are not the first of their mount."""
    tool: Array
    """The first body on the tool in the first of the world, at every stamp, shape (M, 4, 4)."""
    rows: NDArray[np.bool_]
    """Which sightings are of a stamp with a start, shape (N,)."""


def bodies(seen: Sightings) -> Bodies:
    """Return a start from what every image shows by itself; DataError where that is too little."""
    views = _views(seen)
    if not views:
        raise DataError(
            'no image shows four or more points of a target, and not all of them in a line; '
            'that many tell where the target is'
        )
    pairs = [(view.world, view.tool) for view in views]
    first = max(dict.fromkeys(pairs), key=pairs.count)
    known = {body: np.eye(4) for body in first}
    tool: dict[int, Array] = {}
    while True:
        for view in views:
            if view.image not in tool and view.world in known and view.tool in known:
                there = np.linalg.inv(known[view.tool])
                tool[view.image] = known[view.world] @ view.pose @ there
        fresh = _joined(views, known, tool)
        if not fresh:
            break
        known |= fresh
    used = {*seen.camera.tolist(), *(len(seen.cameras) + seen.target).tolist()}
    _all_joined(seen, used - set(known), first)
    poses = np.stack([known.get(k, np.eye(4)) for k in range(_count(seen))])
    free = tuple(sorted(used - set(first)))
    stamps = np.array(sorted(tool))
    return Bodies(poses, free, np.stack([tool[k] for k in stamps]), np.isin(seen.image, stamps))


def _count(seen: Sightings) -> int:
    return len(seen.cameras) + len(seen.targets)


def _views(seen: Sightings) -> list[_View]:
    """Return where every target is in every image of every camera, where the image settles it."""
    key = (seen.image * len(seen.cameras) + seen.camera) * len(seen.targets) + seen.target
    order = np.argsort(key, kind='stable')
    starts = np.flatnonzero(np.diff(key[order], prepend=-1))
    out = []
    for rows in np.split(order, starts[1:]) if order.size else []:
        c, t = int(seen.camera[rows[0]]), int(seen.target[rows[0]])
        points = seen.targets[t].points[seen.point[rows]]
        pose = located(seen.cameras[c].lens, points, seen.pixel[rows])
        if pose is None:
            continue
        image, body = int(seen.image[rows[0]]), len(seen.cameras) + t
        if seen.cameras[c].mount == 'world':
            out.append(_View(image, c, body, pose))
        else:
            out.append(_View(image, body, c, np.asarray(np.linalg.inv(pose), float)))
    return out


def _joined(
    views: Sequence[_View], known: dict[int, Array], tool: dict[int, Array]
) -> dict[int, Array]:
    """Return bodies that were not known, from views at stamps at which the tool is."""
    tried: dict[int, list[Array]] = {}
    for view in views:
        if view.image not in tool or (view.world in known) == (view.tool in known):
            continue
        here = tool[view.image]
        if view.tool in known:
            pose = here @ known[view.tool] @ np.linalg.inv(view.pose)
            tried.setdefault(view.world, []).append(pose)
        else:
            pose = np.linalg.inv(here) @ known[view.world] @ view.pose
            tried.setdefault(view.tool, []).append(pose)
    return {body: _agreed(np.stack(poses)) for body, poses in tried.items()}


def _agreed(poses: Array) -> Array:
    """Return the pose that most others are near to."""
    some = poses[np.linspace(0, len(poses) - 1, min(len(poses), _COMPARED)).astype(int)]
    shift = np.linalg.norm(some[:, None, :3, 3] - some[None, :, :3, 3], axis=-1)
    turn = rotation_vector(some[:, None, :3, :3] @ np.swapaxes(some[None, :, :3, :3], -1, -2))
    away = shift + _LEVER * np.linalg.norm(turn, axis=-1)
    return np.asarray(some[int(np.argmin(np.median(away, axis=1)))])


def _all_joined(seen: Sightings, lost: set[int], first: tuple[int, int]) -> None:
    names = [*(f'camera {c.name!r}' for c in seen.cameras)]
    names += [f'target {t.name!r}' for t in seen.targets]
    for body in sorted(lost):
        raise DataError(
            f'{names[body]} is in no image of a stamp that shows where it is beside '
            f'{names[first[0]]} and {names[first[1]]}; give it in a recording of its own, or take '
            'images at the same stamps'
        )


def located(lens: Lens, points: Array, pixels: Array) -> Array | None:
    """Return the pose (4, 4) of a target of points (N, 3) in the camera's frame, or None."""
    if len(points) < _FEWEST:
        return None
    middle = points.mean(axis=0)
    _, size, axes = np.linalg.svd(points - middle, full_matrices=True)
    if size[1] < _STRETCHED * size[0]:
        return None
    own = (points - middle) @ axes.T
    flat = lens.rays(pixels)
    turned = transform(axes * np.sign(np.linalg.det(axes)), np.zeros(3))
    own *= np.sign(np.linalg.det(axes))
    starts = _of_plane(own, flat) if size[2] < _FLAT * size[0] else _of_space(own, flat)
    tried = [_refined(start, own, flat) for start in starts]
    ahead = [(cost, pose) for cost, pose in tried if (own @ pose[2, :3] + pose[2, 3] > 0.0).all()]
    if not ahead:
        return None
    best = min(ahead, key=lambda one: one[0])[1] @ turned
    best[:3, 3] -= best[:3, :3] @ middle
    return np.asarray(best)


def _of_plane(own: Array, flat: Array) -> list[Array]:
    """Return the pose of points of a plane z = 0 by their homography, and its mirror image."""
    ones = np.ones((len(own), 1))
    plane = np.hstack([own[:, :2], ones])
    none = np.zeros_like(plane)
    rows = np.concatenate(
        [
            np.hstack([plane, none, -flat[:, :1] * plane]),
            np.hstack([none, plane, -flat[:, 1:] * plane]),
        ]
    )
    size = np.linalg.norm(rows, axis=0)
    h = (np.linalg.svd(rows / size)[2][-1] / size).reshape(3, 3)
    h = h / (0.5 * (np.linalg.norm(h[:, 0]) + np.linalg.norm(h[:, 1])))
    h = h * np.sign(h[2, 2])
    pose = transform(
        nearest_rotation(np.stack([h[:, 0], h[:, 1], np.cross(h[:, 0], h[:, 1])], 1)), h[:, 2]
    )
    sight = pose[:3, 3] / np.linalg.norm(pose[:3, 3])
    normal = pose[:3, 2]
    # The same outline, leant the other way: turned by twice the lean about the axis across it.
    lean = np.cross(normal, sight * np.sign(normal @ sight))
    angle = np.arcsin(min(float(np.linalg.norm(lean)), 1.0))
    way = lean / max(float(np.linalg.norm(lean)), 1e-12)
    other = pose.copy()
    other[:3, :3] = rotation_matrix(2.0 * angle * way) @ pose[:3, :3]
    return [pose, other]


def _of_space(own: Array, flat: Array) -> list[Array]:
    """Return the pose of points in space: first as from far away, then nearer."""
    back = np.linalg.pinv(np.hstack([own, np.ones((len(own), 1))]))
    ahead = np.ones(len(own))
    for _ in range(_CLOSER):
        first, second = (back @ (flat * ahead[:, None])).T
        size = max(0.5 * (np.linalg.norm(first[:3]) + np.linalg.norm(second[:3])), 1e-12)
        x, y = first[:3] / np.linalg.norm(first[:3]), second[:3] / np.linalg.norm(second[:3])
        turn = nearest_rotation(np.stack([x, y, np.cross(x, y)]))
        ahead = 1.0 + size * (own @ turn[2])
    return [transform(turn, np.array([first[3], second[3], 1.0]) / size)]


def _refined(pose: Array, own: Array, flat: Array) -> tuple[float, Array]:
    """Return the squared distance that is left and the pose after least squares."""
    cost, remaining, columns = _seen(pose, own, flat)
    for _ in range(_STEPS):
        normal = columns.T @ columns
        normal[np.diag_indices(6)] *= 1.0 + _DAMPED
        step = np.linalg.lstsq(normal, columns.T @ remaining, rcond=1e-14)[0]
        there = pose.copy()
        there[:3, :3] = rotation_matrix(step[3:]) @ pose[:3, :3]
        there[:3, 3] += step[:3]
        then = _seen(there, own, flat)
        if not then[0] < cost:
            break
        gain, pose = cost - then[0], there
        cost, remaining, columns = then
        if gain < 1e-6 * cost:
            break
    return cost, pose


def _seen(pose: Array, own: Array, flat: Array) -> tuple[float, Array, Array]:
    """Return squared distance, residual (2N,) and its columns (2N, 6) by shift and turn."""
    turned = own @ pose[:3, :3].T
    at = turned + pose[:3, 3]
    depth = np.where(np.abs(at[:, 2]) < 1e-9, 1e-9, at[:, 2])
    ray = at[:, :2] / depth[:, None]
    by_point = np.zeros((len(own), 2, 3))
    by_point[:, 0, 0] = by_point[:, 1, 1] = 1.0 / depth
    by_point[:, :, 2] = -ray / depth[:, None]
    columns = np.concatenate([by_point, -by_point @ skew(turned)], axis=2).reshape(-1, 6)
    remaining = (flat - ray).ravel()
    return float(remaining @ remaining), remaining, columns
