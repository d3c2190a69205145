# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How sure a twin is of its poses: a Gaussian over frames and effects, carried to the tool.

A fitted model is one point in a cloud of models that the recordings allow. The cloud is a Gaussian
over the coordinates of the frames and of every effect that an arm of this kind may have, found or
not: narrow in directions that the recordings have shown, as wide as such arms differ in the
others. To first order the covariance of a pose is that cloud seen through the twin's derivatives,
with what no effect explained on postures left out of the fit (`Leftover`) on top.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Array, readonly
from ..effects.effect import Effect
from ..errors import DataError, ModelError
from ..recording import Recording
from .features import Features
from .twin import Twin

CHUNK = 2000
"""Samples at once; a hundred coordinates of so many poses take some ten megabytes."""
SETTLED = 1e-12
"""Share of the largest variance, coordinates at unit size, below which a direction is certain."""


@dataclass(frozen=True, eq=False)
class Directions:
    """
    What may differ between the models that the recordings allow.

    Attributes
    ----------
    frames : tuple of str
        Of 'base' and 'tool', those that were fitted; six coordinates each (xyz, rotvec), the
        base once for every set-up.
    setups : int
        Number of base frames.
    effects : tuple of Effect
        Each with all its fit coordinates, as instances at which derivatives are taken.

    """

    frames: tuple[str, ...]
    setups: int
    effects: tuple[Effect, ...]

    @property
    def frame_count(self) -> int:
        """Return the number of frame coordinates."""
        return 6 * (('base' in self.frames) * self.setups + ('tool' in self.frames))

    @property
    def count(self) -> int:
        """Return the number of coordinates."""
        return self.frame_count + sum(e.coordinates().size for e in self.effects)

    def names(self) -> list[str]:
        """Return a name for every coordinate: 'base 0.x', 'joint_offset elbow_joint 0'."""
        out = []
        if 'base' in self.frames:
            out += [f'base {k}.{axis}' for k in range(self.setups) for axis in AXES]
        if 'tool' in self.frames:
            out += [f'tool.{axis}' for axis in AXES]
        for effect in self.effects:
            where = f' {effect.site}' if effect.site else ''
            out += [f'{effect.name}{where} {k}' for k in range(effect.coordinates().size)]
        return out

    def columns(self, features: Features, setup: int) -> Array:
        """
        Return d pose / d coordinate, shape (P, 6, M), linear part first [m, rad].

        Effects that the recording cannot show (no load, no temperature) have columns of zero.
        """
        out = np.zeros((self.count, 6, features.at.size))
        at = 0
        if 'base' in self.frames:
            for k in range(6):
                out[6 * setup + k] = features.column(('base', k))
            at += 6 * self.setups
        if 'tool' in self.frames:
            for k in range(6):
                out[at + k] = features.column(('tool', k))
            at += 6
        for effect in self.effects:
            size = effect.coordinates().size
            if effect.applicable(features.view, effect.site) is None:
                out[at : at + size] = features.columns(effect, atoms=False)
            at += size
        return out


AXES = ('x', 'y', 'z', 'turn_x', 'turn_y', 'turn_z')


@dataclass(frozen=True)
class Leftover:
    """
    What the model leaves on postures it was not fitted on, the instrument's noise taken off.

    Attributes
    ----------
    position : float [m]
        Standard deviation per axis.
    orientation : float [rad]
        The same about each axis.

    """

    position: float
    orientation: float


@dataclass(frozen=True, eq=False)
class Posterior:
    """
    The models that the recordings allow, about the one that was fitted.

    Attributes
    ----------
    directions : Directions
    mean : array, shape (P,)
        Where the middle of the allowed models lies, counted from the fitted one.
    covariance : array, shape (P, P)
    leftover : Leftover

    """

    directions: Directions
    mean: Array
    covariance: Array
    leftover: Leftover

    def __post_init__(self) -> None:
        count = self.directions.count
        object.__setattr__(self, 'mean', readonly(self.mean, (count,), 'posterior mean'))
        covariance = readonly(self.covariance, (count, count), 'posterior covariance')
        size = np.abs(covariance).max(initial=0.0)
        if np.abs(covariance - covariance.T).max(initial=0.0) > 1e-9 * size:
            raise DataError('posterior covariance is not symmetric')
        object.__setattr__(self, 'covariance', covariance)

    @cached_property
    def spread(self) -> Array:
        """
        Return a factor S, shape (P, R), with S S' the second moment about the fitted model.

        The last column is the mean: a model that is not the middle of what is allowed is off by
        that much too.
        """
        size = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        unit = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)
        # At unit size, so that metres and radians, open and settled coordinates weigh alike.
        values, vectors = np.linalg.eigh(self.covariance * np.outer(unit, unit))
        most = values.max(initial=0.0)
        if values.min(initial=0.0) < -1e-6 * max(most, 1.0):
            raise DataError('posterior covariance has a negative variance')
        live = values > SETTLED * most
        factor = size[:, None] * vectors[:, live] * np.sqrt(values[live])
        return np.column_stack([factor, self.mean])

    def pose_covariance(self, columns: Array) -> Array:
        """
        Return the covariance of poses, shape (M, 6, 6) [m^2, m rad, rad^2].

        Parameters
        ----------
        columns : array, shape (P, 6, M)
            As `Directions.columns` returns them.

        """
        moved = np.tensordot(self.spread, columns, axes=(0, 0))
        out = np.einsum('rim,rjm->mij', moved, moved, optimize=True)
        own = np.repeat([self.leftover.position, self.leftover.orientation], 3) ** 2
        out[:, np.arange(6), np.arange(6)] += own
        return out


def pose_covariances(
    posterior: Posterior, twin: Twin, recording: Recording, at: Array, setup: int = 0
) -> Array:
    """
    Return the covariance of the true pose about the twin's, shape (M, 6, 6).

    Position first [m^2], then turns about the world's fixed axes [rad^2]; without the noise of
    the instrument that will measure it.

    Parameters
    ----------
    posterior : Posterior
    twin : Twin
        The fitted model for this recording.
    recording : Recording
    at : array, shape (M,) [s]
    setup : int
        Which base frame of the posterior.

    Raises
    ------
    ModelError
        There is no such base frame.

    """
    if not 0 <= setup < max(posterior.directions.setups, 1):
        raise ModelError(f'the posterior has no base frame {setup}')
    parts = [
        posterior.pose_covariance(
            posterior.directions.columns(Features(twin, recording, piece), setup)
        )
        for piece in _pieces(at)
    ]
    return np.concatenate([np.zeros((0, 6, 6)), *parts])


def _pieces(at: Array) -> Iterator[Array]:
    for start in range(0, at.size, CHUNK):
        yield at[start : start + CHUNK]


def largest_sigma(covariances: Array) -> Array:
    """Return the largest standard deviation of position in any direction, shape (M,) [m]."""
    return np.asarray(np.sqrt(np.linalg.eigvalsh(covariances[:, :3, :3])[:, -1]))


def coordinate_sizes(effects: Sequence[Effect]) -> Array:
    """Return the fit coordinates of effects, one after the other, shape (K,)."""
    return np.concatenate([np.zeros(0), *(effect.coordinates() for effect in effects)])
