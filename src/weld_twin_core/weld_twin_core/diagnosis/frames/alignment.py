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

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...arm.rotation import transform
from ...arrays import Array
from ...errors import DataError
from ..algebra.fit import fit, robust_scale
from ..algebra.problem import Model, Problem
from .in_turn import in_turn
from .track import FLOOR, LEVER, TIE, Track, chord, nearest_rotation

NEAR = 0.02
"""Median gap [m] from which a least-squares fit finds its own way."""
MOST_ROWS = 3000
"""Rows that the frames are found on: far more than their numbers need, few enough to be quick."""
ROUNDS = 15
"""Steps of each refinement; there is no test of convergence."""
REACHES = (0.1, 0.4)
"""Lengths [m] of the tool vectors tried where only positions were measured."""


def initial_frames(problem: Problem, model: Model) -> Model:
    """
    Return the model with frames close enough for a fit.

    Frames that are near already stay as they are, and so does what the data cannot tell. Only
    frames in ``problem.align`` move; the tool moves when moving the base is not enough.
    """
    few = problem.thinned(MOST_ROWS)
    tracks = [_track(few, model, k) for k in range(len(few.recordings))]
    if not problem.align or _gap(tracks, model) < NEAR:
        return model
    best = model
    for attempt in _attempts(problem.align):
        found = attempt(tracks, model)
        if _gap(tracks, found) < _gap(tracks, best):
            best = found
        if _gap(tracks, best) < NEAR:
            break
    return refined(few, best)


def rough_frames(problem: Problem, model: Model, *, thorough: bool = False) -> Model:
    """
    Return the model with base and tool frames in closed form, both free.

    Parameters
    ----------
    problem : Problem
        The recordings to explain, and the frames that are fitted along.
    model : Model
        What is believed so far; everything is taken about it.
    thorough : bool
        Use more measurements and more rounds.

    """
    tracks = [_track(problem, model, k) for k in range(len(problem.recordings))]
    return _base_and_tool(tracks, model, REACHES if thorough else ())


def refined(problem: Problem, model: Model) -> Model:
    """Return the frames after a robust least-squares fit of the frames in ``problem.align``."""
    found, model = model.found, model.with_found(())
    for _ in range(3):
        scale = robust_scale(problem, problem.residuals(model))
        model = fit(problem, model, scale, iterations=8).model
    return model.with_found(found)


def _attempts(align: frozenset[str]) -> list[Callable[[list[Track], Model], Model]]:
    if 'base' not in align:
        return [_tool_only]
    return [_base_only, _base_and_tool] if 'tool' in align else [_base_only]


def _track(problem: Problem, model: Model, k: int) -> Track:
    measured = problem.recordings[k].measured
    if measured is None:
        raise DataError(f'{problem.recordings[k].name} holds no measured poses or points')
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
    bases = _bases(tracks, model.robot.T_flange_tool, model.bases, ROUNDS)
    return replace(model, bases=bases)


def _bases(
    tracks: list[Track], tool: Array, starts: tuple[Array, ...], rounds: int
) -> tuple[Array, ...]:
    pairs = zip(tracks, starts, strict=True)
    return tuple(_base(track, tool, start, rounds) for track, start in pairs)


def _base(track: Track, tool: Array, start: Array, rounds: int) -> Array:
    """Return the base frame of one recording for a given tool."""
    base, weight = start, np.ones(len(track.position))
    reached = track.point + track.turn @ tool[:3, 3]
    for _ in range(rounds):
        weight = weight / weight.sum()
        middle, centre = weight @ track.position, weight @ reached
        moment = np.einsum('m,mi,mj', weight, track.position - middle, reached - centre)
        if track.rotation is not None:
            turned = track.turn @ tool[:3, :3]
            moment += LEVER**2 * np.einsum('m,mik,mjk', weight, track.rotation, turned)
        rotation = nearest_rotation(moment + TIE * np.linalg.norm(moment) * start[:3, :3])
        base = transform(rotation, middle - rotation @ centre)
        weight = 1.0 / np.maximum(track.gap(base, tool), FLOOR)
    return base


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
        vector = _tool_vector(tracks, model.bases, weights, start[:3, 3], False)
        tool = transform(rotation, vector)
        weights = _weights(tracks, model.bases, tool)
    return replace(model, robot=model.robot.with_frames(tool=tool))


def _tool_vector(
    tracks: list[Track], bases: tuple[Array, ...], weights: list[Array], start: Array, free: bool
) -> Array:
    """Return the tool vector for given base rotations; ``free`` leaves their origins open."""
    normal, right = np.zeros((3, 3)), np.zeros(3)
    for track, base, weight in zip(tracks, bases, weights, strict=True):
        columns = base[:3, :3] @ track.turn
        left = track.position - track.point @ base[:3, :3].T - columns @ start
        if free:
            share = weight / weight.sum()
            columns = columns - np.einsum('m,mij', share, columns)
            left = left - share @ left
        else:
            left = left - base[:3, 3]
        normal += np.einsum('m,mki,mkj', weight, columns, columns)
        right += np.einsum('m,mki,mk', weight, columns, left)
    total = sum(float(weight.sum()) for weight in weights)
    return start + np.linalg.solve(normal + TIE * total * np.eye(3), right)


# Both ------------------------------------------------------------------------------------------


def _base_and_tool(
    tracks: list[Track], model: Model, reaches: tuple[float, ...] = REACHES
) -> Model:
    tool = model.robot.T_flange_tool
    if all(track.rotation is not None for track in tracks):
        turn, vectors = _tool_rotation(tracks, tool[:3, :3]), tool[None, :3, 3]
    else:
        ways = np.concatenate([np.eye(3), -np.eye(3)])
        tried = [tool[:3, 3], *(reach * way for reach in reaches for way in ways)]
        turn, vectors = tool[:3, :3], np.array(tried)
    bases, tool = in_turn(tracks, model.bases, turn, vectors)
    return replace(model, bases=bases, robot=model.robot.with_frames(tool=tool))


def _tool_rotation(tracks: list[Track], start: Array) -> Array:
    """
    Return the tool rotation common to all recordings, whatever their bases.

    With y the entries of R_tool^T, recording k leaves a squared gap of
    M - y' C_k C_k' y / M where C_k is the sum of kron(R_measured', R_flange').
    """
    rotation = start
    weights: list[Array] = [np.ones(len(track.position)) for track in tracks]
    for _ in range(ROUNDS):
        total = np.zeros((9, 9))
        for track, weight in zip(tracks, weights, strict=True):
            product = np.einsum('m,mki,mlj->ijkl', weight, track.turns, track.turn)
            kron = product.reshape(9, 9)
            total += kron @ kron.T / weight.sum()
        size, vectors = np.linalg.eigh(total)
        if size[-2] > (1.0 - 1e-5) * size[-1]:
            return start
        transpose = vectors[:, -1].reshape(3, 3)
        rotation = nearest_rotation(transpose.T * np.sign(np.linalg.det(transpose)))
        weights = [_turn_weight(track, rotation) for track in tracks]
    return rotation


def _turn_weight(track: Track, tool: Array) -> Array:
    """Return least-absolute weights of the samples' turns, with the base that fits best."""
    turned = track.turn @ tool
    weight: Array = np.ones(len(turned))
    for _ in range(3):
        base = nearest_rotation(np.einsum('m,mik,mjk', weight, track.turns, turned))
        weight = 1.0 / np.maximum(chord(track.turns, base @ turned), FLOOR / LEVER)
    return weight


def _weights(tracks: list[Track], bases: tuple[Array, ...], tool: Array) -> list[Array]:
    """Return the weights that turn least squares into least absolute deviations."""
    pairs = zip(tracks, bases, strict=True)
    return [1.0 / np.maximum(track.gap(base, tool), FLOOR) for track, base in pairs]
