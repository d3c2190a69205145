# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What cameras saw: points of targets, in pixels, through lenses; and what is known of both.

A lens is a pinhole with radial and tangential distortion. The model is Brown's [1]_ as ROS and OpenCV
write it: ``plumb_bob`` (k1 k2 p1 p2 k3), and ``rational_polynomial`` with three more for the
denominator (k4 k5 k6).

Single images tell where cameras and targets are on their mounts, and where the tool was. Points of a
plane give a homography [2]_; points in space a view from far away, made nearer step by step [3]_.
Either is refined by least squares; of a plane its mirror image is tried as well, since a board far
away looks the same tilted to either side.

References
----------
.. [1] D. C. Brown, "Decentering distortion of lenses", Photogrammetric Engineering 32, 1966.
.. [2] Z. Zhang, "A flexible new technique for camera calibration", IEEE PAMI 22, 2000.
.. [3] D. DeMenthon, L. Davis, "Model-based object pose in 25 lines of code", IJCV 15, 1995.

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arm.rotation import nearest_rotation, rotation_matrix, rotation_vector, skew, transform
from ..arrays import Array, readonly
from ..errors import DataError

UNKNOWNS = 9
"""Numbers of a lens that may be off: fx fy cx cy [px] and k1 k2 p1 p2 k3."""
_NEAR = 1e-6
"""Depth [m] that counts as none; keeps a point in the plane of the lens from a division by zero."""
_ROUNDS = 20
"""Newton steps at the most from a pixel to its ray; four are enough for lenses of usual cameras."""
_SETTLED = 1e-12
"""Change of a ray at which its search ends."""
_SIZES = (0, 4, 5, 8)
"""Numbers of distortion that are understood; what is missing is zero."""


@dataclass(frozen=True, eq=False)
class Lens:
    """Intrinsics of a camera; DataError for focal lengths or coefficients that make no sense."""

    focal: Array
    centre: Array
    """fx and fy, shape (2,) [px]; cx and cy."""
    distortion: Array
    """k1 k2 p1 p2 k3 k4 k5 k6, in the order of OpenCV, shape (8,); fewer are filled with zeros."""

    def __post_init__(self) -> None:
        for name in ('focal', 'centre'):
            object.__setattr__(self, name, readonly(getattr(self, name), (2,), name))
        if not (self.focal > 0.0).all():
            raise DataError(f'focal lengths must be positive [px], got {self.focal.tolist()}')
        given = readonly(self.distortion, (None,), 'distortion')
        if given.size not in _SIZES:
            raise DataError(
                f'a lens has 0, 4, 5 or 8 numbers of distortion (k1 k2 p1 p2 k3 k4 k5 k6), '
                f'got {given.size}'
            )
        whole = np.pad(given, (0, 8 - given.size))
        object.__setattr__(self, 'distortion', readonly(whole, (8,), 'distortion'))

    def project(self, points: Array) -> Array:
        """Return where points (N, 3) [m], z ahead, x right, y down, appear, shape (N, 2) [px]."""
        points = np.asarray(points, dtype=float)
        return self._bent(points[:, :2] / _depth(points))[0] * self.focal + self.centre

    def derivatives(self, points: Array) -> tuple[Array, Array, Array]:
        """Return pixels (N, 2), and their change with points (N, 2, 3) and lens (N, 2, 9)."""
        depth = _depth(points)
        flat = points[:, :2] / depth
        bent, turn, own = self._bent(flat)
        by_flat = np.zeros((len(points), 2, 3))
        by_flat[:, 0, 0] = by_flat[:, 1, 1] = 1.0 / depth[:, 0]
        by_flat[:, :, 2] = -flat / depth
        by_lens = np.zeros((len(points), 2, UNKNOWNS))
        by_lens[:, 0, 0], by_lens[:, 1, 1] = bent.T
        by_lens[:, 0, 2] = by_lens[:, 1, 3] = 1.0
        by_lens[:, :, 4:] = self.focal[:, None] * own
        by_point = self.focal[:, None] * (turn @ by_flat)
        return bent * self.focal + self.centre, by_point, by_lens

    def rays(self, pixels: Array) -> Array:
        """Return where rays of pixels (N, 2) meet the plane one ahead, (N, 2), by Newton's way."""
        wanted = (np.asarray(pixels, dtype=float) - self.centre) / self.focal
        flat = wanted.copy()
        for _ in range(_ROUNDS):
            bent, turn, _ = self._bent(flat)
            step = np.linalg.solve(turn, (wanted - bent)[..., None])[..., 0]
            flat = flat + step
            if np.abs(step).max(initial=0.0) < _SETTLED:
                break
        return np.asarray(flat)

    def turned(self, size: Array, *, clockwise: bool) -> Lens:
        """
        Return the lens for images that were stored a quarter turn on.

        size: width and height of the image that it was calibrated with, shape (2,) [px].
        clockwise: which way the stored image has to be turned to become that one.
        """
        bent = self.distortion.copy()
        (wide, high), (x, y) = size, self.centre
        if clockwise:  # u = y, v = width - x
            bent[2:4] = -bent[3], bent[2]
            centre = np.array([y, wide - x])
        else:  # u = height - y, v = x
            bent[2:4] = bent[3], -bent[2]
            centre = np.array([high - y, x])
        return replace(self, focal=self.focal[::-1].copy(), centre=centre, distortion=bent)

    def moved(self, step: Array) -> Lens:
        """Return the lens after a step of its unknowns, shape (9,)."""
        bent = self.distortion.copy()
        bent[:5] += step[4:]
        return replace(
            self, focal=self.focal + step[:2], centre=self.centre + step[2:4], distortion=bent
        )

    def _bent(self, flat: Array) -> tuple[Array, Array, Array]:
        """Return the distorted (N, 2), its change with x and y (N, 2, 2), and with k and p."""
        x, y = flat.T
        k1, k2, p1, p2, k3, k4, k5, k6 = self.distortion
        s = x * x + y * y
        upper, lower = 1.0 + s * (k1 + s * (k2 + s * k3)), 1.0 + s * (k4 + s * (k5 + s * k6))
        rise = k1 + s * (2.0 * k2 + 3.0 * s * k3)
        fall = k4 + s * (2.0 * k5 + 3.0 * s * k6)
        radial = upper / lower
        slope = (rise - radial * fall) / lower
        ways, way = np.stack([x, y]), np.stack([x, y], axis=1)
        shift = np.stack(
            [2 * p1 * x * y + p2 * (s + 2 * x * x), p1 * (s + 2 * y * y) + 2 * p2 * x * y], axis=1
        )
        turn = 2.0 * slope[:, None, None] * way[:, :, None] * way[:, None, :]
        turn[:, 0, 0] += radial + 2 * p1 * y + 6 * p2 * x
        turn[:, 1, 1] += radial + 6 * p1 * y + 2 * p2 * x
        cross = 2 * p1 * x + 2 * p2 * y
        turn[:, 0, 1] += cross
        turn[:, 1, 0] += cross
        powers = np.stack([s, s * s, s**3]) / lower
        own = np.empty((len(flat), 2, 5))
        own[:, :, [0, 1, 4]] = (ways[:, None] * powers).transpose(2, 0, 1)
        own[:, 0, 2] = own[:, 1, 3] = 2.0 * x * y
        own[:, 1, 2], own[:, 0, 3] = s + 2.0 * y * y, s + 2.0 * x * x
        return flat * radial[:, None] + shift, turn, own


def _depth(points: Array) -> Array:
    """Return the depth of points, shape (N, 1) [m], never none."""
    z = points[:, 2:]
    return np.where(np.abs(z) < _NEAR, _NEAR, z)


_MOUNTS = ('world', 'tool')
"""Where a camera or a target can be fastened."""
PLACED = 1e-4
"""Uncertainty [m] of the points of a target of which nothing was said: those of a printed board."""


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera."""

    name: str
    lens: Lens
    """As it was calibrated; the diagnosis takes how far that may be off into account."""
    mount: str = 'world'
    """'world' or 'tool'."""
    size: tuple[int, int] | None = None
    """Width and height of the image that the lens was calibrated with [px]."""

    def __post_init__(self) -> None:
        _mounted(f'camera {self.name!r}', self.mount)

    @property
    def image(self) -> Array:
        """Return width and height [px]; where they were not given, the centre is in the middle."""
        return 2.0 * self.lens.centre if self.size is None else np.array(self.size, dtype=float)

    def as_mapping(self) -> dict[str, Any]:
        """Return plain values."""
        lens = self.lens
        own = {name: getattr(lens, name).tolist() for name in ('focal', 'centre', 'distortion')}
        size = {} if self.size is None else {'size': list(self.size)}
        return {'mount': self.mount, **own, **size}


@dataclass(frozen=True, eq=False)
class Target:
    """Points that a camera can find, such as corners of a board; DataError where they are none."""

    name: str
    labels: tuple[str, ...]
    """One for every point."""
    points: Array
    """In the target's own frame, shape (P, 3) [m]."""
    mount: str = 'tool'
    """'world' or 'tool'."""
    sigma: float = PLACED
    """Uncertainty of every coordinate [m]."""
    facing: bool = False
    """Whether its third axis points away from who sees it, as that of OpenCV's boards does."""

    def __post_init__(self) -> None:
        _mounted(f'target {self.name!r}', self.mount)
        shape = (len(self.labels), 3)
        object.__setattr__(
            self, 'points', readonly(self.points, shape, f'points of target {self.name!r}')
        )
        twice = [label for label in self.labels if self.labels.count(label) > 1]
        if twice:
            raise DataError(f'target {self.name!r} has two points called {twice[0]!r}')
        if not self.sigma > 0.0:
            raise DataError(f'target {self.name!r}: sigma must be a positive number [m]')

    def as_mapping(self) -> dict[str, Any]:
        """Return plain values."""
        points = dict(zip(self.labels, self.points.tolist(), strict=True))
        own = {'mount': self.mount, 'sigma': self.sigma, 'facing': self.facing}
        return {**own, 'points': points}


def _mounted(what: str, mount: str) -> None:
    if mount not in _MOUNTS:
        raise DataError(f"{what} is mounted on {mount!r}; a mount is 'world' or 'tool'")


class Fitted(NamedTuple):
    """What images say of themselves."""

    pixel: float
    """Noise of a pixel's coordinate [px]."""
    off: Array
    """How far each lens is from the given one, in spreads of calibrations of one, shape (C, 9)."""


@dataclass(frozen=True, eq=False)
class Sightings:
    """Points seen, one row each; DataError for shapes that do not fit, or what the arm does not move."""

    cameras: tuple[Camera, ...]
    targets: tuple[Target, ...]
    t: Array
    """Stamps, strictly increasing, shape (M,) [s]; images of several cameras share one."""
    image: NDArray[np.intp]
    camera: NDArray[np.intp]
    target: NDArray[np.intp]
    point: NDArray[np.intp]
    """Which stamp, camera, target and point of the target each row is of, shape (N,)."""
    pixel: Array
    """Shape (N, 2) [px]."""
    sigma: Array | None = None
    """Standard deviation of each coordinate, where the detector tells it, shape (N,) [px]."""
    fitted: Fitted | None = None
    """What was found of lenses when poses were made of them."""

    def __post_init__(self) -> None:
        count = len(self.image)
        object.__setattr__(self, 'pixel', readonly(self.pixel, (count, 2), 'pixels'))
        if self.sigma is not None:
            object.__setattr__(self, 'sigma', readonly(self.sigma, (count,), 'sigma of pixels'))
            if not (self.sigma > 0.0).all():
                raise DataError('sigma of pixels must be positive [px]')
        for c, t in sorted(set(zip(self.camera.tolist(), self.target.tolist(), strict=True))):
            if self.cameras[c].mount == self.targets[t].mount:
                raise DataError(
                    f'camera {self.cameras[c].name!r} and target {self.targets[t].name!r} are '
                    f'both on the {self.cameras[c].mount}: what one sees of the other tells '
                    'nothing of the arm; say where each is fastened'
                )

    def take(self, rows: NDArray[np.bool_]) -> Sightings:
        """Return some of the rows; stamps that have none left go too."""
        stamps, image = np.unique(self.image[rows], return_inverse=True)
        return replace(
            self,
            t=self.t[stamps],
            image=image,
            camera=self.camera[rows],
            target=self.target[rows],
            point=self.point[rows],
            pixel=self.pixel[rows],
            sigma=None if self.sigma is None else self.sigma[rows],
        )

    def as_mapping(self) -> dict[str, Any]:
        """Return cameras and targets as plain values."""
        return {
            'cameras': {camera.name: camera.as_mapping() for camera in self.cameras},
            'targets': {target.name: target.as_mapping() for target in self.targets},
        }


def described(entry: Mapping[str, Any]) -> tuple[tuple[Camera, ...], tuple[Target, ...]]:
    """Return the cameras and targets of `Sightings.as_mapping`; DataError where it is none."""
    try:
        cameras = tuple(
            Camera(
                str(name),
                Lens(c['focal'], c['centre'], c['distortion']),
                c['mount'],
                tuple(c['size']) if 'size' in c else None,
            )
            for name, c in entry['cameras'].items()
        )
        targets = tuple(
            Target(
                str(name),
                tuple(t['points']),
                np.array([*t['points'].values()], dtype=float),
                t['mount'],
                t['sigma'],
                t['facing'],
            )
            for name, t in entry['targets'].items()
        )
    except (KeyError, TypeError, AttributeError) as error:
        raise DataError(f'cameras and targets cannot be understood: {error!r}') from None
    return cameras, targets


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
