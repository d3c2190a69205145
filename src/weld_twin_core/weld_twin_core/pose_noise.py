# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How sure a measured pose is in every direction: a board is worse along the line of sight."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .arm.rotation import skew
from .arrays import Array, readonly

_ROUNDED = 1e-6
"""Share by which numbers may differ that were meant to be the same: those of single precision."""
_TINY = 1e-12
"""Share of the largest variance, each in its own unit, below which one counts as none."""


@dataclass(frozen=True, eq=False)
class PoseNoise:
    """Noise of measured poses or points, given with them."""

    root: Array
    """Makes independent rows of an error (c, M): shift [m], then turn about the axes outside
    [rad], where poses were measured, shape (M, c, c). Shifts among each other are equally sure
    then, and so are turns; which of the two are surer, a fit finds out."""
    typical: Array
    """Standard deviation of each row, if the noise is as given, shape (c,) [m, rad]."""
    sigma: Array
    """Of a coordinate of each position, all three joined by their mean square, shape (M,) [m]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, 'root', readonly(self.root, (None, None, None), 'root'))

    @classmethod
    def of(cls, covariance: Array) -> PoseNoise:
        """Return the noise of positive definite covariances (M, c, c) [m^2, rad^2], c 3 or 6."""
        variance = np.einsum('mii->mi', covariance)
        each = variance.reshape(len(variance), -1, 3).mean(axis=2)
        typical = np.repeat(np.median(np.sqrt(each), axis=0), 3)
        size = np.sqrt(variance)
        unit = covariance / (size[:, :, None] * size[:, None, :])
        strength, ways = np.linalg.eigh(unit)
        strength = np.maximum(strength, _TINY)
        root = (ways / np.sqrt(strength)[:, None, :]) @ np.swapaxes(ways, 1, 2)
        root = typical[:, None] * root / size[:, None, :]
        return cls(root, typical, np.sqrt(each[:, 0]))

    @property
    def covariance(self) -> Array:
        """Return it as covariances, shape (M, c, c) [m^2, rad^2]."""
        back = np.linalg.inv(self.root) * self.typical
        return np.asarray(back @ np.swapaxes(back, 1, 2))

    def take(self, index: np.ndarray) -> PoseNoise:
        """Return that of some samples."""
        return replace(self, root=self.root[index], sigma=self.sigma[index])

    def moved(self, back: Array) -> PoseNoise:
        """Return the noise of new errors, from which (M, c, c) leads back to those of old."""
        root = self.root @ back
        spread = np.linalg.inv(root)[:, :3] * self.typical
        return PoseNoise(root, self.typical, np.sqrt((spread**2).sum(axis=(1, 2)) / 3.0))


@dataclass(frozen=True, eq=False)
class Common:
    """Errors that all samples of an instrument share, such as that of a camera's focal length."""

    change: Array
    """What a standard deviation of each makes poses too large by, shape (M, c, K) [m, rad]."""
    mean: Array
    """How large they are believed to be, in standard deviations, shape (K,)."""

    def __post_init__(self) -> None:
        mean = readonly(self.mean, (None,), 'common errors')
        change = readonly(self.change, (None, None, mean.size), 'common errors')
        vars(self).update(mean=mean, change=change)

    def take(self, index: np.ndarray) -> Common:
        """Return that of some samples."""
        return replace(self, change=self.change[index])

    def moved(self, change: Array) -> Common:
        """Return them where errors became others, by matrices of shape (M, c, c)."""
        return replace(self, change=change @ self.change)


def alike(covariance: Array) -> bool:
    """
    Return whether covariances, shape (M, 6, 6), are all one, and the same in every direction.

    Such a one tells nothing that measurements do not tell themselves; mostly somebody typed it in.
    """
    first = covariance[0]
    plain = np.diag(np.repeat(first.diagonal()[[0, 3]], 3))
    same = np.allclose(covariance, first, _ROUNDED, 0.0)
    return bool(same and np.allclose(first, plain, _ROUNDED, 0.0))


def positive(covariance: Array) -> NDArray[np.bool_]:
    """Return which of covariances, shape (M, c, c), are finite and positive definite, (M,)."""
    size = np.sqrt(np.maximum(np.einsum('mii->mi', covariance), 0.0))
    good: NDArray[np.bool_] = np.isfinite(covariance).all(axis=(1, 2)) & (size > 0.0).all(axis=1)
    unit = covariance[good] / (size[good][:, :, None] * size[good][:, None, :])
    good[good] = np.linalg.eigvalsh(0.5 * (unit + np.swapaxes(unit, 1, 2)))[:, 0] > 0.0
    return good


def inverse_error(position: Array, rotation: Array) -> Array:
    """Return what errors of poses, as outer shifts and turns, do to inverse poses, shape (M, 6, 6)."""
    back = np.swapaxes(rotation, 1, 2)
    out = np.zeros((len(position), 6, 6))
    out[:, :3, :3] = out[:, 3:, 3:] = -back
    out[:, :3, 3:] = -back @ skew(position)
    return out
