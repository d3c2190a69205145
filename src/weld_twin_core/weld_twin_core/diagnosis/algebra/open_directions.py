# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Directions of the aligned frames that the recordings hardly show: they go back to what was given.

A seam without a turn of the tool cannot tell a lower base from a longer tool. A fit puts both
somewhere, and wrongly by millimetres where an effect was not yet in the model. Where the given
frames explain the recordings as well, they stand.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arm.robot import Robot
from ...arrays import Array
from ..negligible import FLAT
from .fit import Fit, coordinates, design, fit, frame_offset, frame_prior, solve_scaled, stepped
from .problem import ROWS, Model, Problem, Scale

VISIBLE = (1e-3, 5e-3)
"""A frame error [m, rad] that the data should show."""
NEAR = (0.1, 0.3)
"""A base this near to the given one [m, rad] was meant to be there; farther off the measuring frame
is another, and says nothing."""
WORSE = 4.0
"""Chi-square per direction that the given frames may cost: two standard deviations."""
ROUNDS = 2
"""Gauss-Newton steps by which the rest follows; it starts next to where it ends."""
AXES = ('x', 'y', 'z', 'turn about x', 'turn about y', 'turn about z')


class Open(NamedTuple):
    """Directions that data hardly show: frame columns, visible sizes (F,), steps (F, k) [m, rad]."""

    names: list[str]
    size: Array
    vectors: Array


def open_directions(problem: Problem, model: Model) -> Open:
    """Return the directions of the aligned frames in which a visible error would not show."""
    names, size, strength, vectors = shown(problem, model)
    return Open(names, size, size[:, None] * vectors[:, strength < 1.0])


def shown(
    problem: Problem, model: Model, *, moving: bool = False
) -> tuple[list[str], Array, Array, Array]:
    """
    Return how well the data show each direction of the aligned frames, the least first.

    Names of the F frame columns, of those that move anything if ``moving``; sizes (F,) [m, rad] of an
    error that the data should show; squared strengths of errors of this size in units of the least
    noise, (F,), and the directions in columns, (F, F).
    """
    problem = problem.thinned(ROWS).of_frames()
    parts, names = problem.frame_columns(problem.features(model))
    size = np.array([VISIBLE[int(name.split('.')[1]) // 3] for name in names])
    if not names:
        return names, size, np.zeros(0), np.zeros((0, 0))
    scaled = problem.whitened(parts, problem.unit_scale()) * size[:, None]
    live = np.abs(scaled).max(axis=1) > 0.0 if moving else np.ones(size.size, dtype=bool)
    scaled = scaled[live]
    kept = [name for name, alive in zip(names, live, strict=True) if alive]
    return kept, size[live], *np.linalg.eigh(scaled @ scaled.T)


def keep_open_directions(
    result: Fit, problem: Problem, scale: Scale, precision: Array, given: Robot
) -> Fit:
    """Return the fit with open directions as in the robot given, where the data bear that."""
    free = open_directions(problem, result.model)
    if not free.vectors.size:
        return result
    off, weight = _off(problem, result.model, given)
    back = np.linalg.lstsq(weight[:, None] * free.vectors, -weight * off, rcond=FLAT)[0]
    changed = sum(change.effect.fit.coordinates().size for change in result.model.changes)
    count = problem.shared_count + changed + result.coordinates.size
    step = np.concatenate([free.vectors @ back, np.zeros(count)])
    model = stepped(problem, result.model, step)
    for _ in range(ROUNDS):
        model = stepped(problem, model, _closed_step(problem, model, scale, precision, free))
    residual = problem.whitened(problem.residuals(model), scale)
    share = problem.independent_share(result.residual)
    most = WORSE * free.vectors.shape[1] / share * result.rss / max(result.residual.size, 1)
    if residual @ residual > result.rss + most:
        return result
    return fit(problem, model, scale, precision if precision.size else None, iterations=0)


def _off(problem: Problem, model: Model, given: Robot) -> tuple[Array, Array]:
    """Return how far frames are from the given ones, shape (F,), and what of it counts."""
    sizes = np.repeat(1.0 / np.array(VISIBLE), 3)
    off, weight = [np.zeros(0)], [np.zeros(0)]
    if 'base' in problem.align:
        for base in (model.bases[group[0]] for group in problem.stands):
            away = frame_offset(base, given.T_world_base, left=True)
            near = np.linalg.norm(away[:3]) < NEAR[0] and np.linalg.norm(away[3:]) < NEAR[1]
            off.append(away)
            weight.append(sizes * float(near))
    if 'tool' in problem.align:
        off.append(frame_offset(model.robot.T_flange_tool, given.T_flange_tool, left=False))
        weight.append(sizes)
    return np.concatenate(off), np.concatenate(weight)


def _closed_step(
    problem: Problem, model: Model, scale: Scale, precision: Array, free: Open
) -> Array:
    columns = design(problem, model, scale)
    residual = problem.whitened(problem.residuals(model), scale)
    frames = len(free.names)
    own, moved = frame_prior(problem, model)
    x = np.concatenate([moved[frames:], coordinates(model)])
    span, _, _ = np.linalg.svd(free.vectors / free.size[:, None])
    closed = free.size[:, None] * span[:, free.vectors.shape[1] :]
    mixed = np.concatenate([closed.T @ columns[:frames], columns[frames:]])
    ridge = np.zeros(mixed.shape[0])
    pull = np.zeros(mixed.shape[0])
    held = precision if precision.size else np.zeros(coordinates(model).size)
    ridge[closed.shape[1] :] = np.concatenate([own[frames:], held])
    pull[closed.shape[1] :] = ridge[closed.shape[1] :] * x
    step = solve_scaled(mixed @ mixed.T + np.diag(ridge), mixed @ residual - pull, 0.0)
    return np.concatenate([closed @ step[: closed.shape[1]], step[closed.shape[1] :]])


def in_words(name: str) -> str:
    frame, axis = name.split('.')
    kind, _, number = frame.partition(' ')
    which = '' if number in ('', '0') else f' of recording {int(number) + 1}'
    return f'{kind} {AXES[int(axis)]}{which}'
