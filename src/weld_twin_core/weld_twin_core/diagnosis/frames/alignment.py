# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A start for base and tool frames when an instrument puts its own frame anywhere.

Rotations of both frames follow in closed form from R_measured R_tool^T = R_base R_flange, which
is linear in the two unknown rotations [1]_; with positions alone the base (Kabsch, [2]_) and the
tool vector (linear) are found in turn, from many tool vectors at once, as a start may end beside the
best. Several trials, each with tracks of its own, take each step together: axes are trials T, starts
S, samples M. Everything is reweighted towards least absolute
deviations, so a few gross outliers do not matter.

References
----------
.. [1] M. Shah, "Solving the robot-world/hand-eye calibration problem using the Kronecker
   product", J. Mechanisms Robotics 5(3), 2013.
.. [2] W. Kabsch, "A solution for the best rotation to relate two sets of vectors", Acta Cryst.
   A32, 1976.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ...arm.rotation import nearest_rotation, transform
from ...arrays import Array
from ..algebra.fit import FRAME_SHIFT, LEAST_NOISE, fit, robust_scale
from ..algebra.problem import ROWS, Model, Problem
from ..negligible import REWEIGHTED, ROUNDING, SLIGHT

LEVER = 0.1
"""Metres that a radian counts as here. Turns may be told in another convention, and then positions have
to find the frames: with half a metre quaternions that were read the wrong way round turned the base."""
NEAR = FRAME_SHIFT
"""Median gap [m] from which a least-squares fit finds its own way."""
STEPS = 3
"""Reweighted steps of the bases in each round of bases and tool vector in turn."""
TOGETHER = 16
"""Trials that are taken at once: enough to share the steps, few enough for the processor's cache."""
REACHES = (0.1, 0.4)
"""Lengths [m] of the tool vectors tried where only positions were measured."""


def initial_frames(problem: Problem, model: Model) -> Model:
    """
    Return the model with frames close enough for a fit.

    Frames that are near already stay as they are, and so does what the data cannot tell. Only
    frames in ``problem.align`` move; the tool moves when moving the base is not enough.
    """
    few, align = problem.thinned(ROWS), problem.align
    own = tracks(few, model)
    gap = partial(_gap, own)
    if not align or gap(model) < NEAR:
        return model
    one_frame = _base_only if 'base' in align else _tool_only
    best = min(model, one_frame(own, model), key=gap)
    if len(align) > 1 and gap(best) >= NEAR:
        best = min(best, *rough_frames([(own, model)], thorough=True), key=gap)
    return refined(few, best)


def rough_frames(
    trials: Sequence[tuple[list[Track], Model]], *, thorough: bool = False
) -> list[Model]:
    """
    Return models with base and tool frames in closed form, both free, of several trials at once.

    A trial has one track for every recording, all of one kind; ``thorough`` starts from more tools.
    """
    reaches = REACHES if thorough else ()
    out: list[Model] = []
    for first in range(0, len(trials), TOGETHER):
        some = trials[first : first + TOGETHER]
        side = [Track.side_by_side(each) for each in zip(*(own for own, _ in some), strict=True)]
        out += _bases_and_tools(side, [model for _, model in some], reaches)
    return out


def refined(problem: Problem, model: Model) -> Model:
    result, model = model.found, model.with_found(())
    for _ in range(3):
        scale = robust_scale(problem, problem.residuals(model))
        model = fit(problem, model, scale).model
    return model.with_found(result)


def tracks(problem: Problem, model: Model) -> list[Track]:
    """Return what every recording says of its frames; see `Track`."""
    bases = tuple(np.eye(4) for _ in model.bases)
    bare = replace(model, robot=model.robot.with_frames(tool=np.eye(4)), bases=bases)
    out = []
    for k, recording in enumerate(problem.recordings):
        seen = recording.seen
        flange = bare.twin(k).poses(recording, seen.t)
        out.append(Track(seen.position, seen.rotation, flange.position, flange.rotation))
    return out


def _gap(tracks: list[Track], model: Model) -> float:
    tool, pairs = model.robot.T_flange_tool, zip(tracks, model.bases, strict=True)
    return float(np.median(np.concatenate([track.gap(base, tool) for track, base in pairs])))


# One frame at a time ---------------------------------------------------------------------------


def _base_only(tracks: list[Track], model: Model) -> Model:
    tool, bases = model.robot.T_flange_tool[None], []
    for track, given in zip(tracks, model.bases, strict=True):
        start = Bases(given[None, None, :3, :3], given[None, None, :3, 3])
        own = Track.side_by_side([track]), start, tool[:, :3, :3], tool[:, None, :3, 3]
        base = _based(*own, REWEIGHTED)
        bases.append(transform(base.rotation[0, 0], base.origin[0, 0]))
    return replace(model, bases=tuple(bases))


def _tool_only(tracks: list[Track], model: Model) -> Model:
    start = model.robot.T_flange_tool
    tool, weights = start, [np.ones(len(track.position)) for track in tracks]
    for _ in range(REWEIGHTED):
        moment, pull = np.zeros((3, 3)), np.zeros(3)
        for track, base, weight in zip(tracks, model.bases, weights, strict=True):
            axes = base[:3, :3]
            turn = axes @ track.turn
            if track.rotation is not None:
                moment += np.einsum('m,mki,mkj', weight, turn, track.rotation)
            left = track.position - track.point @ axes.T - turn @ start[:3, 3] - base[:3, 3]
            pull += np.einsum('m,mki,mk', weight, turn, left)
        tie = max(SLIGHT * np.linalg.norm(moment), ROUNDING)
        rotation = nearest_rotation(moment + tie * start[:3, :3])
        # The squares of turns are the unit matrix.
        total = (1.0 + SLIGHT) * sum(float(weight.sum()) for weight in weights)
        tool = transform(rotation, start[:3, 3] + pull / total)
        pairs = zip(tracks, model.bases, strict=True)
        weights = [1.0 / np.maximum(track.gap(base, tool), LEAST_NOISE) for track, base in pairs]
    return replace(model, robot=model.robot.with_frames(tool=tool))


# Both ------------------------------------------------------------------------------------------


def _bases_and_tools(
    tracks: list[Track], models: Sequence[Model], reaches: tuple[float, ...]
) -> list[Model]:
    tools = np.stack([model.robot.T_flange_tool for model in models])
    turn, vectors = tools[:, :3, :3], tools[:, None, :3, 3]
    if all(track.rotation is not None for track in tracks):
        turn = _tool_rotations(tracks, turn)
    else:
        ways = np.concatenate([np.eye(3), -np.eye(3)])
        tried = np.concatenate([np.zeros((0, 3)), *(reach * ways for reach in reaches)])
        others = np.broadcast_to(tried, (len(models), *tried.shape))
        vectors = np.concatenate([vectors, others], axis=1)
    starts = [np.stack(each) for each in zip(*(model.bases for model in models), strict=True)]
    bases, tools = in_turn(tracks, starts, turn, vectors)
    return [
        replace(
            model,
            bases=tuple(base[k] for base in bases),
            robot=model.robot.with_frames(tool=tools[k]),
        )
        for k, model in enumerate(models)
    ]


def _tool_rotations(tracks: list[Track], start: Array) -> Array:
    """
    Return the tool rotation of every trial common to all recordings, whatever their bases.

    With y the entries of R_tool^T, recording k leaves a squared gap of
    M - y' C_k C_k' y / M where C_k is the sum of kron(R_measured', R_flange').
    """
    trials = len(start)
    rotation, unclear = start, np.zeros(trials, dtype=bool)
    weights: list[Array] = [np.ones(track.position.shape[:2]) for track in tracks]
    for _ in range(REWEIGHTED):
        total = np.zeros((trials, 9, 9))
        for track, weight in zip(tracks, weights, strict=True):
            flat = (*track.position.shape[:2], 9)
            seen = weight[..., None] * track.turns.reshape(flat)
            product = np.swapaxes(seen, 1, 2) @ track.turn.reshape(flat)
            # From rows ki and columns lj to rows ij and columns kl.
            kron = product.reshape(trials, 3, 3, 3, 3).transpose(0, 2, 4, 1, 3)
            kron = kron.reshape(trials, 9, 9)
            total += kron @ np.swapaxes(kron, 1, 2) / weight.sum(axis=1)[:, None, None]
        size, vectors = np.linalg.eigh(total)
        unclear |= size[:, -2] > (1.0 - SLIGHT) * size[:, -1]
        transpose = vectors[..., -1].reshape(trials, 3, 3)
        sign = np.sign(np.linalg.det(transpose))[:, None, None]
        rotation = nearest_rotation(np.swapaxes(transpose, 1, 2) * sign)
        weights = [_turn_weight(track, rotation) for track in tracks]
    return np.where(unclear[:, None, None], start, rotation)


def _turn_weight(track: Track, tool: Array) -> Array:
    """Return least-absolute weights (T, M) of the samples' turns, with the base that fits best."""
    turned = track.turn @ tool[:, None]
    samples = turned.shape[:2]
    products = (track.turns @ np.swapaxes(turned, -1, -2)).reshape(*samples, 9)
    weight: Array = np.ones(samples)
    for _ in range(3):
        moment = (weight[:, None] @ products).reshape(-1, 3, 3)
        base = nearest_rotation(moment)
        weight = 1.0 / np.maximum(chord(track.turns, base[:, None] @ turned), LEAST_NOISE / LEVER)
    return weight


# In turn ---------------------------------------------------------------------------------------


class Bases(NamedTuple):
    rotation: Array
    origin: Array


def in_turn(
    tracks: Sequence[Track], bases: Sequence[Array], turn: Array, vectors: Array
) -> tuple[tuple[Array, ...], Array]:
    """
    Return the base frames, each (T, 4, 4), and the tools, (T, 4, 4), of the least median gaps.

    bases: where the base of every recording is believed to be, shape (T, 4, 4).
    turn, vectors: of the tool, (T, 3, 3), which stays, and to start from, (T, S, 3) [m].
    """
    result = [Bases(base[:, None, :3, :3], base[:, None, :3, 3]) for base in bases]
    for _ in range(REWEIGHTED):
        result = [_based(*pair, turn, vectors, STEPS) for pair in zip(tracks, result, strict=True)]
        vectors = _vectors(tracks, result, turn, vectors)
    result = [
        _based(*pair, turn, vectors, REWEIGHTED) for pair in zip(tracks, result, strict=True)
    ]
    gaps = [_gaps(*pair, turn, vectors) for pair in zip(tracks, result, strict=True)]
    best = np.median(np.concatenate(gaps, axis=2), axis=2).argmin(axis=1)
    each = np.arange(len(best)), best
    frames = tuple(transform(base.rotation[each], base.origin[each]) for base in result)
    return frames, transform(turn, vectors[each])


def _reached(track: Track, vectors: Array) -> Array:
    """Return where the tool is in the base, shape (T, S, M, 3) [m]."""
    trials, samples = track.turn.shape[:2]
    flat = vectors @ np.swapaxes(track.turn.reshape(trials, samples * 3, 3), 1, 2)
    return np.asarray(track.point[:, None] + flat.reshape(trials, -1, samples, 3))


def _based(track: Track, start: Bases, turn: Array, vectors: Array, rounds: int) -> Bases:
    base, reached = start, _reached(track, vectors)
    position = track.position[:, None]
    weight = np.ones(reached.shape[:3])
    turns = None
    if track.rotation is not None:
        turned = np.swapaxes(track.turn @ turn[:, None], -1, -2)
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
        rotation = nearest_rotation(moment + SLIGHT * size * start.rotation)
        base = Bases(rotation, middle - (rotation @ centre[..., None])[..., 0])
        weight = 1.0 / np.maximum(_gaps(track, base, turn, vectors, reached), LEAST_NOISE)
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
    turned = base.rotation[:, :, None] @ (track.turn @ turn[:, None])[:, None]
    apart = track.rotation[:, None] - turned
    return np.asarray(off + LEVER * np.sqrt((apart**2).sum(axis=(-2, -1)) / 2.0))


def _vectors(tracks: Sequence[Track], bases: list[Bases], turn: Array, start: Array) -> Array:
    """Return the tool vectors for given base rotations, their origins left open, (T, S, 3) [m]."""
    normal, right, total = 0.0, 0.0, 0.0
    for track, base in zip(tracks, bases, strict=True):
        trials, samples = track.turn.shape[:2]
        there = _reached(track, start)
        weight = 1.0 / np.maximum(_gaps(track, base, turn, start, there), LEAST_NOISE)
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
    system = normal + SLIGHT * np.asarray(total)[..., None, None] * np.eye(3)
    return np.asarray(start + np.linalg.solve(system, np.asarray(right)[..., None])[..., 0])


@dataclass(frozen=True, eq=False)
class Track:
    """One recording: measured position and rotation, the flange's point and turn; or some trials."""

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
        frame = Bases(base[None, None, :3, :3], base[None, None, :3, 3])
        own = Track.side_by_side([self])
        return np.asarray(_gaps(own, frame, tool[None, :3, :3], tool[None, None, :3, 3])[0, 0])

    @property
    def turns(self) -> Array:
        return np.zeros((0, 3, 3)) if self.rotation is None else self.rotation


def chord(first: Array, second: Array) -> Array:
    """Return 2 sin(angle / 2) of the turns between rotations, shape (..., M): small ones' angle."""
    return np.asarray(np.linalg.norm(first - second, axis=(-2, -1)) / np.sqrt(2.0))
