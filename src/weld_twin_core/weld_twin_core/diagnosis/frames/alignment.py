# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A start for base and tool frames when an instrument puts its own frame anywhere.

Rotations of both frames follow in closed form from R_measured R_tool^T = R_base R_flange, which
is linear in the two unknown rotations [1]_; with positions alone the base (Kabsch, [2]_) and the
tool vector (linear) are found in turn. Everything is reweighted towards least absolute
deviations, so a few gross outliers do not matter.

References
----------
.. [1] M. Shah, "Solving the robot-world/hand-eye calibration problem using the Kronecker
   product", J. Mechanisms Robotics 5(3), 2013.
.. [2] W. Kabsch, "A solution for the best rotation to relate two sets of vectors", Acta Cryst.
   A32, 1976.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ...arm.rotation import transform
from ...arrays import Array
from ..algebra.fit import fit, robust_scale
from ..algebra.problem import Model, Problem
from .in_turn import FLOOR, LEVER, TIE, Track, bases_of, chord, in_turn, nearest_rotation

NEAR = 0.02
"""Median gap [m] from which a least-squares fit finds its own way."""
MOST_ROWS = 3000
"""Rows that the frames are found on: far more than their numbers need, few enough to be quick."""
ROUNDS = 15
"""Steps of each refinement; there is no test of convergence."""
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
    few, align = problem.thinned(MOST_ROWS), problem.align
    own = tracks(few, model)
    if not align or _gap(own, model) < NEAR:
        return model
    best = model
    for attempt in _attempts(align):
        result = attempt(own, model)
        if _gap(own, result) < _gap(own, best):
            best = result
        if _gap(own, best) < NEAR:
            break
    return refined(few, best)


def rough_frames(
    trials: Sequence[tuple[list[Track], Model]], *, thorough: bool = False
) -> list[Model]:
    """
    Return models with base and tool frames in closed form, both free, of several trials at once.

    A trial has one track for every recording; all have as many samples, all are turned or none.
    Where ``thorough``, more tools are started from.
    """
    reaches = REACHES if thorough else ()
    out: list[Model] = []
    for first in range(0, len(trials), TOGETHER):
        some = trials[first : first + TOGETHER]
        side = [Track.side_by_side(each) for each in zip(*(own for own, _ in some), strict=True)]
        out += _bases_and_tools(side, [model for _, model in some], reaches)
    return out


def refined(problem: Problem, model: Model) -> Model:
    """Return the frames after a robust least-squares fit of the frames in ``problem.align``."""
    result, model = model.found, model.with_found(())
    for _ in range(3):
        scale = robust_scale(problem, problem.residuals(model))
        model = fit(problem, model, scale, iterations=8).model
    return model.with_found(result)


def _attempts(align: frozenset[str]) -> list[Callable[[list[Track], Model], Model]]:
    if 'base' not in align:
        return [_tool_only]
    return [_base_only, _base_and_tool] if 'tool' in align else [_base_only]


def tracks(problem: Problem, model: Model) -> list[Track]:
    """Return what every recording says of its frames; see `Track`."""
    return [_track(problem, model, k) for k in range(len(problem.recordings))]


def _track(problem: Problem, model: Model, k: int) -> Track:
    measured = problem.recordings[k].seen
    bare = replace(
        model,
        robot=model.robot.with_frames(tool=np.eye(4)),
        bases=tuple(np.eye(4) for _ in model.bases),
    )
    flange = bare.twin(k).poses(problem.recordings[k], measured.t)
    return Track(measured.position, measured.rotation, flange.position, flange.rotation)


def _gap(tracks: list[Track], model: Model) -> float:
    return _median_gap(tracks, model.bases, model.robot.T_flange_tool)


def _median_gap(tracks: list[Track], bases: tuple[Array, ...], tool: Array) -> float:
    gaps = [track.gap(base, tool) for track, base in zip(tracks, bases, strict=True)]
    return float(np.median(np.concatenate(gaps)))


# One frame at a time ---------------------------------------------------------------------------


def _base_only(tracks: list[Track], model: Model) -> Model:
    tools, starts = model.robot.T_flange_tool[None], [base[None] for base in model.bases]
    result = bases_of([Track.side_by_side([track]) for track in tracks], starts, tools)
    return replace(model, bases=tuple(base[0] for base in result))


def _tool_only(tracks: list[Track], model: Model) -> Model:
    """Return the model with the tool frame that fits the given bases."""
    start = model.robot.T_flange_tool
    tool, weights = start, [np.ones(len(track.position)) for track in tracks]
    for _ in range(ROUNDS):
        moment = np.zeros((3, 3))
        for track, base, weight in zip(tracks, model.bases, weights, strict=True):
            if track.rotation is not None:
                turn = base[:3, :3] @ track.turn
                moment += np.einsum('m,mki,mkj', weight, turn, track.rotation)
        tie = max(TIE * np.linalg.norm(moment), 1e-12)
        rotation = nearest_rotation(moment + tie * start[:3, :3])
        vector = _tool_vector(tracks, model.bases, weights, start[:3, 3])
        tool = transform(rotation, vector)
        weights = _weights(tracks, model.bases, tool)
    return replace(model, robot=model.robot.with_frames(tool=tool))


def _tool_vector(
    tracks: list[Track], bases: tuple[Array, ...], weights: list[Array], start: Array
) -> Array:
    """Return the tool vector for given bases."""
    normal, right = np.zeros((3, 3)), np.zeros(3)
    for track, base, weight in zip(tracks, bases, weights, strict=True):
        columns = base[:3, :3] @ track.turn
        left = track.position - track.point @ base[:3, :3].T - columns @ start - base[:3, 3]
        normal += np.einsum('m,mki,mkj', weight, columns, columns)
        right += np.einsum('m,mki,mk', weight, columns, left)
    total = sum(float(weight.sum()) for weight in weights)
    return start + np.linalg.solve(normal + TIE * total * np.eye(3), right)


# Both ------------------------------------------------------------------------------------------


def _base_and_tool(tracks: list[Track], model: Model) -> Model:
    return rough_frames([(tracks, model)], thorough=True)[0]


def _bases_and_tools(
    tracks: list[Track], models: Sequence[Model], reaches: tuple[float, ...]
) -> list[Model]:
    """Return every trial's model; the tracks have the axis of trials in front."""
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
    for _ in range(ROUNDS):
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
        unclear |= size[:, -2] > (1.0 - 1e-5) * size[:, -1]
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
        weight = 1.0 / np.maximum(chord(track.turns, base[:, None] @ turned), FLOOR / LEVER)
    return weight


def _weights(tracks: list[Track], bases: tuple[Array, ...], tool: Array) -> list[Array]:
    """Return the weights that turn least squares into least absolute deviations."""
    pairs = zip(tracks, bases, strict=True)
    return [1.0 / np.maximum(track.gap(base, tool), FLOOR) for track, base in pairs]
