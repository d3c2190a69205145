# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How far apart two explanations would be on a measurement not made yet.

T-optimality [1]_: one explanation is taken as true, the other fits both the data at hand and the
new ones as well as it can; what it cannot fit separates them. Frames are fitted anew.

References
----------
.. [1] A. C. Atkinson, V. V. Fedorov, "The design of experiments for discriminating between two
   rival models", Biometrika 62, 1975.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ...recording import Measurements, Recording
from ..algebra.fit import design, with_weights
from ..algebra.problem import Model, Problem, Scale
from .candidates import Candidate

ROWS = 1200
"""Rows of the data at hand that take part."""
SAMPLES = 400
"""Samples of a candidate that are computed; neighbours of a moving arm say the same."""
INDEPENDENT = 0.1
"""Share of the samples of a moving arm that count: neighbours say the same."""
LOOSE = 1e-9
"""Share of the largest column below which a column is rounding."""

Alternative = tuple[Effect, ...]


@dataclass(frozen=True, eq=False)
class Side:
    """Predictions and derivatives of every alternative on one set of recordings, whitened."""

    predicted: list[Array]
    columns: list[Array]
    names: list[list[str]]


def at_hand(
    problem: Problem, model: Model, alternatives: Sequence[Alternative], scale: Scale
) -> Side:
    """
    Return what the alternatives say of the data at hand.

    Parameters
    ----------
    problem : Problem
        The recordings to explain, and the frames that are fitted along.
    model : Model
        What is believed so far; everything is taken about it.
    alternatives : sequence of Alternative
        The explanations to tell apart.
    scale : Scale
        The noise that residuals are measured in, and the weight of every sample.

    """
    few = problem.thinned(ROWS)
    return _side(few, model, alternatives, with_weights(scale, few), '')


def ahead(
    problem: Problem, candidate: Candidate, alternatives: Sequence[Alternative], scale: Scale
) -> Side:
    """
    Return what the alternatives say of a candidate measurement.

    Parameters
    ----------
    problem : Problem
        The recordings to explain, and the frames that are fitted along.
    candidate : Candidate
        A measurement that could be made.
    alternatives : sequence of Alternative
        The explanations to tell apart.
    scale : Scale
        The noise that residuals are measured in, and the weight of every sample.

    """
    recording = _measured(candidate, points=max(problem.rows) == 3)
    align = set(problem.align)
    align |= {'base'} if candidate.new_base else set()
    align |= {'tool'} if candidate.new_tool else set()
    next_problem = Problem((recording,), frozenset(align))
    mark = ' new' if candidate.new_tool else ''
    side = _side(
        next_problem, candidate.model, alternatives, with_weights(scale, next_problem), mark
    )
    share = 1.0 if recording.joints.static else np.sqrt(INDEPENDENT)
    return Side([p * share for p in side.predicted], [c * share for c in side.columns], side.names)


def separations(now: Side, after: Side | None) -> Array:
    """
    Return by how many standard deviations alternatives differ, pair by pair, shape (A, A).

    The mean over which of the two is true: where one contains the other, as play that may be
    zero, only the truth of the larger one shows.

    after left out: on the data at hand alone.
    """
    count = len(now.predicted)
    out = np.zeros((count, count))
    for i in range(count):
        for j in range(count):
            if i != j:
                out[i, j] = _left(now, after, i, j)
    return np.asarray(0.5 * (out + out.T))


def _left(now: Side, after: Side | None, true: int, rival: int) -> float:
    """Return what the rival cannot fit of the true one, in standard deviations."""
    sides = [now] if after is None else [now, after]
    gap = np.concatenate([side.predicted[true] - side.predicted[rival] for side in sides])
    names = sorted({name for side in sides for name in side.names[rival]})
    blocks = [_placed(side.columns[rival], side.names[rival], names) for side in sides]
    columns = np.concatenate(blocks, axis=1)
    size = np.linalg.norm(columns, axis=1)
    live = size > LOOSE * max(size.max(initial=0.0), 1e-300)
    if live.any():
        basis, _ = np.linalg.qr((columns[live] / size[live, None]).T)
        gap = gap - basis @ (basis.T @ gap)
    return float(np.linalg.norm(gap))


def _placed(columns: Array, names: list[str], wanted: list[str]) -> Array:
    out = np.zeros((len(wanted), columns.shape[1]))
    out[[wanted.index(name) for name in names]] = columns
    return out


def _side(
    problem: Problem, model: Model, alternatives: Sequence[Alternative], scale: Scale, mark: str
) -> Side:
    predicted, columns, names = [], [], []
    for effects in alternatives:
        twin = model.with_found(effects)
        # Residuals are measured minus twin; what was measured drops out of differences.
        predicted.append(-problem.whitened(problem.residuals(twin), scale))
        block, labels = design(problem, twin, scale)
        columns.append(block)
        names.append([_label(label, problem, mark) for label in labels])
    return Side(predicted, columns, names)


def _label(label: str, problem: Problem, mark: str) -> str:
    """Return a column's name; frames of the new measurement are its own."""
    if label.startswith('base'):
        return f'{label} of {problem.recordings[0].name}'
    return label + mark if label.startswith('tool') else label


def _measured(candidate: Candidate, *, points: bool) -> Recording:
    """Return the recording with measurements of an arm without any effect, to compare with."""
    recording = candidate.recording
    t = recording.joints.t
    if not recording.joints.static:
        t = t[np.linspace(0, t.size - 1, min(SAMPLES, t.size)).round().astype(int)]
    poses = candidate.model.twin(0).poses(recording, t)
    seen = Measurements(t, poses.position, None if points else poses.rotation)
    return replace(recording, measured=seen)
