# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Base frames and tool vector found alternately, from many tool vectors at once.

For a given tool each base follows in closed form (Kabsch), for given bases the tool vector is
linear. A start may end beside the best, so several are tried; all of them take each step together,
and so do several trials, each with tracks of its own: axes are trials T, starts S, samples M.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...arm.rotation import transform
from ...arrays import Array

ROUNDS = 15
"""Times that bases and tool vector are found in turn; there is no test of convergence."""
STEPS = 3
"""Reweighted steps of the bases in each of these rounds."""
LEVER = 0.1
"""Metres that a radian counts as, where turns and positions are weighed together."""
FLOOR = 1e-5
"""Gap [m] below which a sample gains no more weight."""
TIE = 1e-6
"""Pull towards the given frames, relative; decides only what the data leave open."""


class Bases(NamedTuple):
    """The base frame of one recording for every start: rotations (T, S, 3, 3), origins (T, S, 3)."""

    rotation: Array
    origin: Array


def in_turn(
    tracks: Sequence[Track], bases: Sequence[Array], turn: Array, vectors: Array
) -> tuple[tuple[Array, ...], Array]:
    """
    Return the base frames, each (T, 4, 4), and the tools, (T, 4, 4), of the least median gaps.

    tracks: one for every recording; its arrays begin with the axis of trials.
    bases: where the base of every recording is believed to be, shape (T, 4, 4).
    turn: rotation of the tool, which stays as it is, shape (T, 3, 3).
    vectors: tool vectors to start from, shape (T, S, 3) [m].
    """
    result = _started(bases, vectors)
    for _ in range(ROUNDS):
        result = [_based(*pair, turn, vectors, STEPS) for pair in zip(tracks, result, strict=True)]
        vectors = _vectors(tracks, result, turn, vectors)
    result = [_based(*pair, turn, vectors, ROUNDS) for pair in zip(tracks, result, strict=True)]
    gaps = [_gaps(*pair, turn, vectors) for pair in zip(tracks, result, strict=True)]
    best = np.median(np.concatenate(gaps, axis=2), axis=2).argmin(axis=1)
    each = np.arange(len(best)), best
    frames = tuple(transform(base.rotation[each], base.origin[each]) for base in result)
    return frames, transform(turn, vectors[each])


def bases_of(tracks: Sequence[Track], bases: Sequence[Array], tools: Array) -> tuple[Array, ...]:
    """Return the base frames of known tools, each (T, 4, 4); see `in_turn`."""
    turn, vectors = tools[:, :3, :3], tools[:, None, :3, 3]
    pairs = zip(tracks, _started(bases, vectors), strict=True)
    result = [_based(*pair, turn, vectors, ROUNDS) for pair in pairs]
    return tuple(transform(base.rotation[:, 0], base.origin[:, 0]) for base in result)


def _started(bases: Sequence[Array], vectors: Array) -> list[Bases]:
    """Return base frames (T, 4, 4) as those of every start."""
    starts = vectors.shape[:2]
    return [
        Bases(
            np.broadcast_to(b[:, None, :3, :3], (*starts, 3, 3)),
            np.broadcast_to(b[:, None, :3, 3], (*starts, 3)),
        )
        for b in bases
    ]


def _reached(track: Track, vectors: Array) -> Array:
    """Return where the tool is in the base, shape (T, S, M, 3) [m]."""
    trials, samples = track.turn.shape[:2]
    flat = vectors @ np.swapaxes(track.turn.reshape(trials, samples * 3, 3), 1, 2)
    return np.asarray(track.point[:, None] + flat.reshape(trials, -1, samples, 3))


def _turned(track: Track, turn: Array) -> Array:
    """Return how the tool is turned in the base, shape (T, M, 3, 3)."""
    return np.asarray(track.turn @ turn[:, None])


def _based(track: Track, start: Bases, turn: Array, vectors: Array, rounds: int) -> Bases:
    """Return the base of one recording for given tools."""
    base, reached = start, _reached(track, vectors)
    position = track.position[:, None]
    weight = np.ones(reached.shape[:3])
    turns = None
    if track.rotation is not None:
        turned = np.swapaxes(_turned(track, turn), -1, -2)
        turns = LEVER**2 * (track.rotation @ turned).reshape(*turned.shape[:2], 9)
    for _ in range(rounds):
        weight = weight / weight.sum(axis=2, keepdims=True)
        middle = weight @ track.position
        centre = (weight[..., None, :] @ reached)[..., 0, :]
        seen = (position - middle[..., None, :]) * weight[..., None]
        moment = np.swapaxes(seen, -1, -2) @ (reached - centre[..., None, :])
        if turns is not None:
            moment = moment + (weight @ turns).reshape(moment.shape)
        size = np.linalg.norm(moment, axis=(-2, -1))[..., None, None]
        rotation = nearest_rotation(moment + TIE * size * start.rotation)
        base = Bases(rotation, middle - (rotation @ centre[..., None])[..., 0])
        weight = 1.0 / np.maximum(_gaps(track, base, turn, vectors, reached), FLOOR)
    return base


def _gaps(
    track: Track, base: Bases, turn: Array, vectors: Array, reached: Array | None = None
) -> Array:
    """Return how far every sample is off, position and turn together, shape (T, S, M) [m]."""
    reached = _reached(track, vectors) if reached is None else reached
    there = reached @ np.swapaxes(base.rotation, -1, -2) + base.origin[..., None, :]
    off = np.sqrt(((track.position[:, None] - there) ** 2).sum(axis=-1))
    if track.rotation is None:
        return np.asarray(off)
    turned = base.rotation[:, :, None] @ _turned(track, turn)[:, None]
    apart = track.rotation[:, None] - turned
    return np.asarray(off + LEVER * np.sqrt(0.5 * (apart**2).sum(axis=(-2, -1))))


def _vectors(tracks: Sequence[Track], bases: list[Bases], turn: Array, start: Array) -> Array:
    """Return the tool vectors for given base rotations, their origins left open, (T, S, 3) [m]."""
    normal, right, total = 0.0, 0.0, 0.0
    for track, base in zip(tracks, bases, strict=True):
        trials, samples = track.turn.shape[:2]
        there = _reached(track, start)
        weight = 1.0 / np.maximum(_gaps(track, base, turn, start, there), FLOOR)
        whole = weight.sum(axis=2)
        share = weight / whole[..., None]
        # In base axes the columns are the flange's rotations, whose squares are the unit matrix.
        left = track.position[:, None] @ base.rotation - there
        mean = (share @ track.turn.reshape(trials, samples, 9)).reshape(*share.shape[:2], 3, 3)
        pulled = share[..., None] * left
        middle = pulled.sum(axis=2)
        columns = track.turn.reshape(trials, samples * 3, 3)
        pull = pulled.reshape(*share.shape[:2], samples * 3) @ columns
        back = np.swapaxes(mean, -1, -2)
        normal = normal + whole[..., None, None] * (np.eye(3) - back @ mean)
        right = right + whole[..., None] * (pull - (back @ middle[..., None])[..., 0])
        total = total + whole
    system = normal + TIE * np.asarray(total)[..., None, None] * np.eye(3)
    return np.asarray(start + np.linalg.solve(system, np.asarray(right)[..., None])[..., 0])


@dataclass(frozen=True, eq=False)
class Track:
    """
    One recording for alignment, or the same recording in several trials, their axis in front.

    ``position`` (M, 3) and ``rotation`` (M, 3, 3) or None were measured, ``point`` and ``turn``
    are those of the flange in the base frame.
    """

    position: Array
    rotation: Array | None
    point: Array
    turn: Array

    @classmethod
    def side_by_side(cls, trials: Sequence[Track]) -> Track:
        """Return trials of one recording as one, where all have turns or none has."""
        turns = [trial.rotation for trial in trials if trial.rotation is not None]
        return cls(
            np.stack([trial.position for trial in trials]),
            np.stack(turns) if turns else None,
            np.stack([trial.point for trial in trials]),
            np.stack([trial.turn for trial in trials]),
        )

    def gap(self, base: Array, tool: Array) -> Array:
        """Return how far each sample is off, position and turn together, shape (M,) [m]."""
        turn = base[:3, :3] @ self.turn
        reached = self.point @ base[:3, :3].T + base[:3, 3] + turn @ tool[:3, 3]
        off: Array = np.linalg.norm(self.position - reached, axis=1)
        if self.rotation is None:
            return off
        return off + LEVER * chord(self.rotation, turn @ tool[:3, :3])

    @property
    def turns(self) -> Array:
        """Return measured rotations, none where only points were measured."""
        return np.zeros((0, 3, 3)) if self.rotation is None else self.rotation


def nearest_rotation(matrix: Array) -> Array:
    """Return the rotations R that make trace(R' matrix) largest, shape (..., 3, 3)."""
    u, _, vt = np.linalg.svd(matrix)
    u[..., 2] *= np.linalg.det(u @ vt)[..., None]
    return np.asarray(u @ vt)


def chord(first: Array, second: Array) -> Array:
    """Return 2 sin(angle / 2) of the turns between rotations, shape (..., M): small ones' angle."""
    return np.asarray(np.linalg.norm(first - second, axis=(-2, -1)) / np.sqrt(2.0))
