# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What cameras saw: points of targets, in pixels, and what is known of cameras and targets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, readonly
from ..errors import DataError
from .lens import Lens

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
