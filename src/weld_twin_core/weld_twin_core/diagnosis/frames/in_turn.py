# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Base frames and tool vector found alternately, from many tool vectors at once.

For a given tool each base follows in closed form (Kabsch), for given bases the tool vector is
linear. A start may end beside the best, so several are tried; all of them take each step together.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arm.rotation import transform
from ...arrays import Array
from .track import FLOOR, LEVER, TIE, Track, nearest_rotation

ROUNDS = 15
"""Times that bases and tool vector are found in turn; there is no test of convergence."""
STEPS = 3
"""Reweighted steps of the bases in each of these rounds."""


class Bases(NamedTuple):
    """The base frame of one recording for every start: rotations (S, 3, 3), origins (S, 3)."""

    rotation: Array
    origin: Array


def in_turn(
    tracks: list[Track], bases: tuple[Array, ...], turn: Array, vectors: Array
) -> tuple[tuple[Array, ...], Array]:
    """
    Return the base frames and the tool that leave the least median gap.

    Parameters
    ----------
    tracks : list of Track
    bases : tuple of array, each shape (4, 4)
        Where the base of every recording is believed to be.
    turn : array, shape (3, 3)
        Rotation of the tool, which stays as it is.
    vectors : array, shape (S, 3) [m]
        Tool vectors to start from.

    """
    count = len(vectors)
    found = [
        Bases(np.repeat(b[None, :3, :3], count, axis=0), np.repeat(b[None, :3, 3], count, axis=0))
        for b in bases
    ]
    for _ in range(ROUNDS):
        found = [_based(*pair, turn, vectors, STEPS) for pair in zip(tracks, found, strict=True)]
        vectors = _vectors(tracks, found, turn, vectors)
    found = [_based(*pair, turn, vectors, ROUNDS) for pair in zip(tracks, found, strict=True)]
    gaps = [_gaps(*pair, turn, vectors) for pair in zip(tracks, found, strict=True)]
    best = int(np.median(np.concatenate(gaps, axis=1), axis=1).argmin())
    frames = tuple(transform(base.rotation[best], base.origin[best]) for base in found)
    return frames, transform(turn, vectors[best])


def _reached(track: Track, vectors: Array) -> Array:
    """Return where the tool is in the base, shape (S, M, 3) [m]."""
    return np.asarray(track.point + np.einsum('mij,sj->smi', track.turn, vectors))


def _based(track: Track, start: Bases, turn: Array, vectors: Array, rounds: int) -> Bases:
    """Return the base of one recording for given tools."""
    base, reached = start, _reached(track, vectors)
    weight = np.ones(reached.shape[:2])
    turns = None
    if track.rotation is not None:
        turned = np.swapaxes(track.turn @ turn, 1, 2)
        turns = LEVER**2 * (track.rotation @ turned).reshape(-1, 9)
    for _ in range(rounds):
        weight = weight / weight.sum(axis=1, keepdims=True)
        middle = weight @ track.position
        centre = np.einsum('sm,smi->si', weight, reached)
        seen = (track.position - middle[:, None]) * weight[..., None]
        moment = np.swapaxes(seen, 1, 2) @ (reached - centre[:, None])
        if turns is not None:
            moment = moment + (weight @ turns).reshape(-1, 3, 3)
        size = np.linalg.norm(moment, axis=(1, 2))[:, None, None]
        rotation = nearest_rotation(moment + TIE * size * start.rotation)
        base = Bases(rotation, middle - np.einsum('sij,sj->si', rotation, centre))
        weight = 1.0 / np.maximum(_gaps(track, base, turn, vectors), FLOOR)
    return base


def _gaps(track: Track, base: Bases, turn: Array, vectors: Array) -> Array:
    """Return how far every sample is off, position and turn together, shape (S, M) [m]."""
    there = _reached(track, vectors) @ np.swapaxes(base.rotation, 1, 2) + base.origin[:, None]
    off = np.sqrt(((track.position - there) ** 2).sum(axis=2))
    if track.rotation is None:
        return np.asarray(off)
    apart = track.rotation - base.rotation[:, None] @ (track.turn @ turn)
    return np.asarray(off + LEVER * np.sqrt(0.5 * (apart**2).sum(axis=(2, 3))))


def _vectors(tracks: list[Track], bases: list[Bases], turn: Array, start: Array) -> Array:
    """Return the tool vectors for given base rotations, their origins left open, (S, 3) [m]."""
    normal, right, total = 0.0, 0.0, 0.0
    for track, base in zip(tracks, bases, strict=True):
        weight = 1.0 / np.maximum(_gaps(track, base, turn, start), FLOOR)
        whole = weight.sum(axis=1)
        share = weight / whole[:, None]
        # In base axes the columns are the flange's rotations, whose squares are the unit matrix.
        there = _reached(track, start)
        left = track.position @ base.rotation - there
        mean = (share @ track.turn.reshape(-1, 9)).reshape(-1, 3, 3)
        middle = np.einsum('sm,smi->si', share, left)
        pull = np.einsum('sm,mki,smk->si', share, track.turn, left, optimize=True)
        own = np.eye(3) - np.swapaxes(mean, 1, 2) @ mean
        normal = normal + whole[:, None, None] * own
        right = right + whole[:, None] * (pull - np.einsum('ski,sk->si', mean, middle))
        total = total + whole
    system = normal + TIE * np.asarray(total)[:, None, None] * np.eye(3)
    return np.asarray(start + np.linalg.solve(system, np.asarray(right)[..., None])[..., 0])
