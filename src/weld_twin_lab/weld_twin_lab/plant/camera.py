# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A camera beside the cell: where the points of a board appear in its images."""

from dataclasses import dataclass

import numpy as np

from .screws import Motion, compose, inverse


@dataclass(frozen=True, eq=False)
class Eye:
    """A camera as it really is."""

    focal: np.ndarray
    centre: np.ndarray
    """Shape (2,) [px]."""
    bent: tuple[float, float, float, float]
    """Radial k1 and k2, tangential p1 and p2."""
    stands: Motion
    """Camera in the measuring frame: z ahead, x to the right."""
    size: tuple[int, int]
    """Width and height of its images [px]."""


def looking(place: np.ndarray, aim: np.ndarray) -> Motion:
    """Return a camera at a place that looks at an aim, its images upright."""
    ahead = (aim - place) / np.linalg.norm(aim - place)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right = right / np.linalg.norm(right)
    return Motion(np.stack([right, np.cross(ahead, right), ahead], axis=1), place)


def seen(
    eye: Eye, board: Motion, points: np.ndarray, noise: float, rng: np.random.Generator
) -> np.ndarray:
    """
    Return where points appear, shape (M, P, 2) [px]; NaN where they are outside of the image.

    board: in the measuring frame.
    points: in the board's own frame, shape (P, 3) [m].
    noise: standard deviation of each coordinate [px].
    """
    there = compose(inverse(eye.stands), board)
    at = np.einsum('mij,pj->mpi', there.rotation, points) + there.position[:, None]
    ray = at[..., :2] / at[..., 2:]
    x, y = np.moveaxis(ray, -1, 0)
    k1, k2, p1, p2 = eye.bent
    far = x**2 + y**2
    radial = 1.0 + k1 * far + k2 * far**2
    across = x * radial + 2.0 * p1 * x * y + p2 * (far + 2.0 * x**2)
    down = y * radial + p1 * (far + 2.0 * y**2) + 2.0 * p2 * x * y
    pixel = np.stack([across, down], axis=-1) * eye.focal + eye.centre
    pixel = pixel + rng.normal(0.0, noise, pixel.shape)
    inside = (at[..., 2] > 0.0) & (pixel > 0.0).all(axis=-1) & (pixel < eye.size).all(axis=-1)
    return np.where(inside[..., None], pixel, np.nan)
