# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Images to measured poses of the tool, with all that is not sure about them.

Poses of all stamps, lenses, places of cameras and targets and the points of targets are fitted
together (bundle adjustment [1]_), with what was known of lenses and points as priors. Nothing of
the arm enters. Each stamp then keeps a pose, how sure it is in every direction, and how it hangs
on the unknowns that all stamps share. The points of a stamp are taken out by one small QR
decomposition, so that hundreds of images are as many poses; of the unknowns, only those
combinations stay that poses show at all.

References
----------
.. [1] B. Triggs, P. McLauchlan, R. Hartley, A. Fitzgibbon, "Bundle adjustment - a modern
   synthesis", Vision Algorithms, LNCS 1883, 2000.

"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .arm.rotation import moved, skew
from .arrays import Array
from .cameras.sightings import UNKNOWNS, Bodies, Fitted, Lens, Sightings, Target, bodies
from .errors import DataError
from .pose_noise import Common, PoseNoise
from .recording import Measurements, Recording

_FOCAL, _CENTRE = 3e-3, 3e-3
"""Spread of focal length and image centre over focal length, as calibrations of one camera differ."""
_BENT = (0.03, 0.15, 1e-3, 1e-3, 0.4)
"""Spread of k1 k2 p1 p2 k3 between such calibrations."""
_SHIFT, _TURN = 1.0, 1.0
"""Spread [m, rad] of the places of further cameras and targets: they may be anywhere."""
_HUBER = 3.0
"""A pixel this many robust deviations off starts to lose weight."""
_NORMAL = 1.4826
"""Standard deviation of normal numbers over the median of their size."""
_LEAST_PIXEL = 1e-3
"""Noise of a pixel [px] that is taken at the least: images without any are computed."""
_ROUNDS = 30
"""Steps at the most; six are usual."""
_SETTLED = 1e-6
"""Share by which the cost must still fall."""
_DAMPED = 1e8
"""Damping of a step, in units of its columns, at which the search ends."""
_REWEIGHTED = 3
"""Times that pixels are weighed anew; the last changes no pose by a tenth of its noise."""
_TOGETHER = 64
"""Stamps that are taken at once: enough to share a step, few enough for the memory."""
_SINGULAR = 1e9
"""Condition from which on images tell no pose."""
_BEYOND = 1.1
"""Of the size of an image, where a pixel is outside: a size by the centre is off by some per cent."""
_LOOSEST, _LOOSER = 10.0, 1.5
"""Times what was said that the points of a target may turn out to be off, and from where on that is
believed: a printed board of a few dozen points errs by half more by chance in its figure at most."""
_LEARNED = 3
"""Times that it is learned how well points are known; the last changes it by a few per cent."""
_SHOWN = 1.0
"""Deviations by which an unknown of one deviation must move all poses together to be kept."""


class _Adjusted(NamedTuple):
    """What images tell."""

    measured: Measurements
    """The first body on the tool in the first on the world, at every stamp."""
    lenses: tuple[Lens, ...]
    """As the images have them."""
    off: Array
    """How far each lens is from the given one, in spreads of `_FOCAL` and others, shape (C, 9)."""
    pixel: float
    """Noise of a pixel's coordinate that is left [px]."""
    known: tuple[float, ...]
    """How well the points of each target turned out to be known [m]."""


@dataclass(frozen=True, eq=False)
class _State:
    """Everything that is fitted, and what it makes of every sighting."""

    seen: Sightings
    start: Bodies
    lenses: tuple[Lens, ...]
    poses: Array
    points: tuple[Array, ...]
    tool: Array
    unknowns: Array

    @cached_property
    def sizes(self) -> Array:
        """Return the spread of every unknown that the stamps share, shape (Z,)."""
        lenses = [
            np.concatenate([_FOCAL * c.lens.focal, _CENTRE * c.lens.focal, _BENT])
            for c in self.seen.cameras
        ]
        placed = [np.repeat([_SHIFT, _TURN], 3) for _ in self.start.free]
        points = [np.full(t.points.size, t.sigma) for t in self.seen.targets]
        return np.concatenate([*lenses, *placed, *points])

    def rows(self) -> tuple[Array, Array, Array]:
        """Return residual (N, 2) [px], and its change with the tool (N, 2, 6) and unknowns (N, 2, Z)."""
        seen, count = self.seen, len(self.seen.cameras)
        eye, target = self.poses[seen.camera], self.poses[count + seen.target]
        tool = self.tool[seen.image]
        # A camera of the world sees the tool's target: forth by the tool's pose; else back.
        forth = np.array([c.mount == 'world' for c in seen.cameras])[seen.camera]
        corner = np.stack(
            [self.points[t][p] for t, p in zip(seen.target, seen.point, strict=True)]
        )
        own = _times(target[:, :3, :3], corner)
        at = own + target[:, :3, 3]
        turn = np.where(forth[:, None, None], tool[:, :3, :3], _swap(tool[:, :3, :3]))
        there = np.where(
            forth[:, None], _times(turn, at) + tool[:, :3, 3], _times(turn, at - tool[:, :3, 3])
        )
        back = _swap(eye[:, :3, :3])
        away = there - eye[:, :3, 3]
        ahead = _times(back, away)
        by_lens = np.empty((len(ahead), 2, UNKNOWNS))
        by_point, pixel = np.empty((len(ahead), 2, 3)), np.empty((len(ahead), 2))
        for c, lens in enumerate(self.lenses):
            which = seen.camera == c
            pixel[which], by_point[which], by_lens[which] = lens.derivatives(ahead[which])
        by_there = by_point @ back
        by_at = by_there @ turn
        of_tool = _of_tool(forth, by_there, by_at, there - tool[:, :3, 3], at - tool[:, :3, 3])
        of_eye = np.concatenate([-by_there, by_there @ skew(away)], axis=2)
        of_target = np.concatenate([by_at, -by_at @ skew(own)], axis=2)
        of_corner = by_at @ target[:, :3, :3]
        whole = self._in_columns(by_lens, of_eye, of_target, of_corner)
        return seen.pixel - pixel, of_tool, whole

    def _in_columns(
        self, by_lens: Array, of_eye: Array, of_target: Array, of_corner: Array
    ) -> Array:
        """Return the change with every shared unknown, each in its own column, (N, 2, Z)."""
        seen, count = self.seen, len(self.seen.cameras)
        whole = np.zeros((len(by_lens), 2, self.sizes.size))
        each = np.arange(len(by_lens))[:, None]

        def put(first: NDArray[np.intp], block: Array, which: NDArray[np.bool_]) -> None:
            columns = first[which, None] + np.arange(block.shape[2])
            whole[each[which], :, columns] = np.swapaxes(block[which], 1, 2)

        every = np.ones(len(by_lens), dtype=bool)
        put(UNKNOWNS * seen.camera, by_lens, every)
        at = UNKNOWNS * count
        place = np.full(count + len(seen.targets), -1)
        place[list(self.start.free)] = at + 6 * np.arange(len(self.start.free))
        for body, block in ((seen.camera, of_eye), (count + seen.target, of_target)):
            put(place[body], block, place[body] >= 0)
        sizes = np.cumsum([0, *(t.points.size for t in seen.targets)])
        first = at + 6 * len(self.start.free) + sizes[seen.target] + 3 * seen.point
        put(first, of_corner, every)
        return np.asarray(whole * self.sizes)

    def with_targets(self, targets: tuple[Target, ...]) -> _State:
        """Return the state with other spreads of the points of targets; nothing moves."""
        before = self.sizes
        state = replace(self, seen=replace(self.seen, targets=targets))
        return replace(state, unknowns=self.unknowns * before / state.sizes)

    def moved(self, step: Array, tool: Array) -> _State:
        """Return the state after a step of unknowns (Z,), in spreads, and of the tool (M, 6)."""
        count, sized = len(self.seen.cameras), step * self.sizes
        lenses = tuple(
            lens.moved(sized[UNKNOWNS * c : UNKNOWNS * (c + 1)])
            for c, lens in enumerate(self.lenses)
        )
        at = UNKNOWNS * count
        poses = self.poses.copy()
        for body in self.start.free:
            poses[body] = moved(poses[body], sized[at : at + 6])
            at += 6
        points = []
        for old in self.points:
            points.append(old + sized[at : at + old.size].reshape(-1, 3))
            at += old.size
        return replace(
            self,
            lenses=lenses,
            poses=poses,
            points=tuple(points),
            tool=moved(self.tool, tool),
            unknowns=self.unknowns + step,
        )


class _Taken(NamedTuple):
    """Sightings with every stamp's pose taken out: R (M, 6, 6), what it takes, and the rest."""

    roots: Array
    right: Array
    shared: Array
    normal: Array
    rest: Array


@dataclass(frozen=True, eq=False)
class _Point:
    """A state with its weights [1/px]."""

    state: _State
    weight: Array

    @cached_property
    def rows(self) -> tuple[Array, Array, Array]:
        """Return what the state makes of every sighting."""
        return self.state.rows()

    @property
    def cost(self) -> float:
        remaining = self.weight[:, None] * self.rows[0]
        return float((remaining**2).sum() + (self.state.unknowns**2).sum())

    @cached_property
    def reduced(self) -> _Taken:
        """Return the rows that are left for the unknowns that all stamps share."""
        residual, of_tool, shared = (
            self.weight.reshape(-1, *(1,) * (part.ndim - 1)) * part for part in self.rows
        )
        both = np.concatenate([shared, residual[:, :, None]], axis=2)
        size, image = both.shape[2], self.state.seen.image
        parts, normal = list[tuple[Array, Array]](), np.zeros((size, size))
        for first in range(0, len(self.state.tool), _TOGETHER):
            some = np.flatnonzero((image >= first) & (image < first + _TOGETHER))
            count = min(_TOGETHER, len(self.state.tool) - first)
            place = _numbers(image[some] - first)
            wide = np.zeros((count, place.max() + 1, 2, 6))
            wide[image[some] - first, place] = of_tool[some]
            right = np.zeros((count, place.max() + 1, 2, size))
            right[image[some] - first, place] = both[some]
            right = right.reshape(count, -1, size)
            q, r = np.linalg.qr(wide.reshape(count, -1, 6))
            taken = _swap(q) @ right
            rest = (right - q @ taken).reshape(-1, size)
            normal += rest.T @ rest
            parts.append((r, taken))
        roots, taken = (np.concatenate(each) for each in zip(*parts, strict=True))
        return _Taken(roots, taken[..., -1], taken[..., :-1], normal[:-1, :-1], normal[:-1, -1])

    def stepped(self, damping: float) -> _Point:
        own = self.reduced
        damped = own.normal + np.diag(1.0 + damping * np.diag(own.normal))
        step = np.asarray(np.linalg.solve(damped, own.rest - self.state.unknowns), dtype=float)
        square = _swap(own.roots) @ own.roots
        each = np.einsum('mii->mi', square)
        square = square + damping * each[:, :, None] * np.eye(6)
        right = _times(_swap(own.roots), own.right - own.shared @ step)
        tool = _solved(square, right)
        return _Point(self.state.moved(step, tool), self.weight)


def _numbers(image: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return a number for every sighting that is its own within its image."""
    order = np.argsort(image, kind='stable')
    first = np.searchsorted(image[order], image[order])
    out = np.empty(image.size, dtype=np.intp)
    out[order] = np.arange(image.size) - first
    return out


def adjusted(seen: Sightings) -> _Adjusted:
    """Return the poses that images tell; DataError where these show or hang together too little."""
    start = bodies(seen)
    seen = seen.take(start.rows)
    state = _State(
        seen,
        start,
        tuple(camera.lens for camera in seen.cameras),
        start.poses,
        tuple(target.points for target in seen.targets),
        start.tool,
        np.zeros(0),
    )
    state = replace(state, unknowns=np.zeros(state.sizes.size))
    given = np.ones(len(seen.image)) if seen.sigma is None else 1.0 / seen.sigma
    for _ in range(_REWEIGHTED):
        weight, _ = _weights(state, given)
        state = _descended(_Point(state, weight)).state
    state = _loosened(state, given)
    weight, noise = _weights(state, given)
    return _result(_Point(state, weight), noise)


def _loosened(state: _State, given: Array) -> _State:
    """
    Return the state with points of targets as well known as the images say, never better.

    Each target has one spread of its points, which makes the images likeliest (evidence); points
    that no image shows say nothing of it.
    """
    said = [target.sigma for target in state.seen.targets]
    for _ in range(_LEARNED):
        weight, _ = _weights(state, given)
        normal = _Point(state, weight).reduced.normal
        known = 1.0 - np.diag(np.linalg.inv(normal + np.eye(len(normal))))
        at = state.unknowns.size - sum(t.points.size for t in state.seen.targets)
        targets = []
        for target, first in zip(state.seen.targets, said, strict=True):
            own = slice(at, at + target.points.size)
            at = own.stop
            off = float((state.unknowns[own] ** 2).sum()) / max(float(known[own].sum()), 1e-9)
            sigma = min(max(target.sigma * off**0.5, first), _LOOSEST * first)
            targets.append(replace(target, sigma=sigma))
        pairs = list(zip(targets, said, strict=True))
        if all(target.sigma < _LOOSER * first for target, first in pairs):
            return state
        state = state.with_targets(tuple(targets))
        state = _descended(_Point(state, weight)).state
    return state


def seen_by(recording: Recording, seen: Sightings) -> Recording:
    """Return a recording with the poses that images tell, and what they say of the lenses."""
    seen, said = _upright(seen)
    result = adjusted(seen)
    images, poses = len(seen.t), result.measured.t.size
    notes = [
        *said,
        f'{poses} of {images} images tell a pose; points are found within {result.pixel:.2f} px',
    ]
    for camera, lens in zip(seen.cameras, result.lenses, strict=True):
        longer = 100.0 * (lens.focal / camera.lens.focal - 1.0).mean()
        notes.append(f'camera {camera.name!r}: the images have the focal length {longer:+.2f} %')
    notes += [
        f'points of target {target.name!r} are off by {1e3 * sigma:.2f} mm, not by '
        f'{1e3 * target.sigma:.2f} mm as was said'
        for target, sigma in zip(seen.targets, result.known, strict=True)
        if sigma > _LOOSER * target.sigma
    ]
    return replace(
        recording,
        images=replace(seen, fitted=Fitted(result.pixel, result.off)),
        measured=result.measured,
        notes=(*recording.notes, *notes),
    )


def _upright(seen: Sightings) -> tuple[Sightings, list[str]]:
    """
    Return sightings with lenses turned as the images are stored, and what is to be said of it.

    A camera held upright is often calibrated on images that a viewer has turned. Pixels then lie
    outside of the image that the intrinsics are of, and inside after a quarter turn.
    """
    turned = [c for c in range(len(seen.cameras)) if _lies(seen, c)]
    if not turned:
        return seen, []
    tried = []
    for clockwise in (True, False):
        cameras = list(seen.cameras)
        for c in turned:
            lens = cameras[c].lens.turned(cameras[c].image, clockwise=clockwise)
            cameras[c] = replace(cameras[c], lens=lens, size=None)
        trial = replace(seen, cameras=tuple(cameras))
        tried.append((adjusted(trial).pixel, trial))
    best = min(tried, key=lambda one: one[0])[1]
    names = ', '.join(repr(seen.cameras[c].name) for c in turned)
    return best, [
        f'the pixels of camera {names} lie beyond the image of its intrinsics, and within it after '
        'a quarter turn: the intrinsics are taken as those of images that were turned'
    ]


def _lies(seen: Sightings, c: int) -> bool:
    """Return whether the images of a camera are stored a quarter turn from its intrinsics."""
    most = seen.pixel[seen.camera == c].max(axis=0, initial=0.0)
    size = seen.cameras[c].image
    return bool((most > _BEYOND * size).any() and (most <= _BEYOND * size[::-1]).all())


def _weights(state: _State, given: Array) -> tuple[Array, float]:
    """Return the weight of every sighting [1/px], and the noise of a coordinate [px]."""
    residual = state.rows()[0] * given[:, None]
    # Poses took their share of the noise: six numbers of every stamp, and of unknowns some.
    free = max(1.0 - (6 * len(state.tool) + UNKNOWNS) / max(residual.size, 1), 0.05)
    spread = _NORMAL * float(np.median(np.abs(residual))) / np.sqrt(free)
    spread = max(float(spread), _LEAST_PIXEL)
    off = np.sqrt((residual**2).mean(axis=1)) / spread
    weight = given / spread * np.minimum(1.0, _HUBER / np.maximum(off, 1e-12))
    return np.asarray(weight), spread / float(np.median(given))


def _descended(here: _Point) -> _Point:
    """Return the place that Levenberg and Marquardt lead to."""
    damping = 1e-6
    for _ in range(_ROUNDS):
        there = here.stepped(damping)
        while not there.cost <= here.cost and damping < _DAMPED:
            damping = damping * 10.0
            there = here.stepped(damping)
        if not there.cost <= here.cost:
            break
        gain, here = here.cost - there.cost, there
        damping = max(damping * 0.1, 1e-9)
        if gain < _SETTLED * here.cost:
            break
    return here


def _result(point: _Point, noise: float) -> _Adjusted:
    own, state = point.reduced, point.state
    weak = np.linalg.cond(own.roots) > _SINGULAR
    if weak.any():
        raise DataError(f'the images at {state.seen.t[weak][0]:.3f} s do not tell a pose')
    # Unknowns of unit spread after all that the images tell of them together, and where that is.
    size, ways = np.linalg.eigh(own.normal + np.eye(len(own.normal)))
    unit = ways / np.sqrt(size)
    mean = unit.T @ (own.rest - state.unknowns)
    seen = own.shared @ unit
    _, strength, kept = np.linalg.svd(seen.reshape(-1, seen.shape[2]), full_matrices=False)
    kept = kept[strength > _SHOWN]
    pose = moved(state.tool, _solved(own.roots, own.right))
    change = np.linalg.solve(own.roots, seen @ kept.T)
    said = PoseNoise.of(np.asarray(np.linalg.inv(_swap(own.roots) @ own.roots), dtype=float))
    measured = Measurements(
        state.seen.t,
        pose[:, :3, 3],
        pose[:, :3, :3],
        said.sigma,
        noise=said,
        common=Common(change, kept @ mean),
    )
    off = state.unknowns[: UNKNOWNS * len(state.lenses)].reshape(-1, UNKNOWNS)
    known = tuple(target.sigma for target in state.seen.targets)
    return _Adjusted(measured, state.lenses, off, noise, known)


def _of_tool(
    forth: NDArray[np.bool_], by_there: Array, by_at: Array, there: Array, at: Array
) -> Array:
    """Return the change with the tool, (N, 2, 6), of points forth by its pose or back by it."""
    ahead = np.concatenate([by_there, -by_there @ skew(there)], axis=2)
    back = np.concatenate([-by_at, by_at @ skew(at)], axis=2)
    return np.where(forth[:, None, None], ahead, back)


def _times(matrix: Array, vector: Array) -> Array:
    return np.asarray((matrix @ vector[..., None])[..., 0])


def _solved(matrix: Array, right: Array) -> Array:
    """Return what every matrix (M, c, c) makes the right-hand side (M, c) of, (M, c)."""
    return np.asarray(np.linalg.solve(matrix, right[..., None])[..., 0], dtype=float)


def _swap(matrix: Array) -> Array:
    return np.swapaxes(matrix, -1, -2)
