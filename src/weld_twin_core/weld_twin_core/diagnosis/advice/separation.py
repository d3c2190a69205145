# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How far apart two explanations would be on measurements not made yet.

T-optimality [1]_: one explanation is taken as true, the other fits both the data at hand and the
new ones as well as it can; what it cannot fit separates them. Frames are fitted anew. All that is
needed of a piece of motion is the normal matrix of the rival's columns and of the difference; the
matrices of pieces add up, so that pieces can be chosen one by one.

References
----------
.. [1] A. C. Atkinson, V. V. Fedorov, "The design of experiments for discriminating between two
   rival models", Biometrika 62, 1975.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...arrays import Array, spread_over
from ...effects.effect import Effect
from ...recording import Measurements, Recording
from ...twin.features import with_expected_effort
from ..algebra.fit import design, effect_precision, with_weights
from ..algebra.problem import Model, Problem, Scale
from ..negligible import REPEATED
from .candidates import Candidate, Piece

_ROWS = 1200
"""Rows of the data at hand that take part."""
_SAMPLES = 120
"""Samples of a path that are computed; neighbours of a moving arm say the same."""
_EVERY = 0.15
"""Time [s] after which a moving arm says something new: in it the arm moves by centimetres."""
Explanation = tuple[Effect, ...]


@dataclass(frozen=True, eq=False)
class Side:
    """Predictions and derivatives of every alternative on one set of recordings, whitened."""

    predicted: list[Array]
    columns: list[Array]
    names: list[list[str]]
    rows: int  # scalar rows per sample


@dataclass(frozen=True, eq=False)
class Parting:
    """
    How far the first explanation is parted from one other, by the data at hand and by each piece.

    Each of the two is taken for true in turn. Where one contains the other, as play that may be zero,
    only the truth of the larger one shows; so the mean over both counts.
    """

    now: list[Array]
    """Normal matrix of the columns of the one that is not true and, last, of the difference, shape
    (P, P)."""
    pieces: list[Array]  # the same of every piece, shape (K, P, P)

    @cached_property
    def before(self) -> Array:
        """Return by how many standard deviations the data at hand part them, each way, (2,)."""
        return np.array([_remainder(matrix[None])[0] for matrix in self.now])

    def gained(self, chosen: Sequence[int], more: Sequence[int]) -> Array:
        """Return what each further piece adds to it, beside those chosen, shape (len(more),)."""
        out: Array = np.zeros(len(more))
        for before, now, pieces in zip(self.before, self.now, self.pieces, strict=True):
            after = _remainder(now + pieces[list(chosen)].sum(axis=0) + pieces[list(more)])
            out += np.sqrt(np.maximum(after**2 - before**2, 0.0)) / 2.0
        return out


def _remainder(matrices: Array) -> Array:
    """Return what columns leave of the last one, its length, shape (K,)."""
    size = np.sqrt(np.maximum(np.diagonal(matrices, axis1=1, axis2=2), np.finfo(float).tiny))
    scaled = matrices / size[:, :, None]
    scaled /= size[:, None, :]
    each = np.arange(matrices.shape[1] - 1)
    scaled[:, each, each] += REPEATED
    try:
        # The last pivot of the factor is what is left, at half the work of solving.
        return np.asarray(size[:, -1] * np.linalg.cholesky(scaled)[:, -1, -1])
    except np.linalg.LinAlgError:  # one of them leaves nothing but rounding
        cross = scaled[:, :-1, -1:]
        taken = (cross * np.linalg.solve(scaled[:, :-1, :-1], cross)).sum(axis=(1, 2))
        return np.asarray(size[:, -1] * np.sqrt(np.maximum(1.0 - taken, 0.0)))


def partings(
    problem: Problem,
    model: Model,
    alternatives: Sequence[Explanation],
    scale: Scale,
    candidate: Candidate,
    now: Side,
) -> list[Parting]:
    """Return how a candidate's pieces part the first alternative, believed most, from others."""
    ahead = [_ahead(problem, candidate, r, alternatives, scale) for r in candidate.recordings]
    out = []
    for other in range(1, len(alternatives)):
        parting = Parting([], [])
        for true, wrong in ((0, other), (other, 0)):
            names = sorted({n for side in (now, *ahead) for n in side.names[wrong]})
            prior = np.diag(_prior(model.with_found(alternatives[wrong]), names))
            stacks = [_stacked(side, true, wrong, names) for side in (now, *ahead)]
            pieces = [
                _of_piece(stacks[p.recording + 1], ahead[p.recording], p) for p in candidate.pieces
            ]
            parting.now.append(prior + stacks[0] @ stacks[0].T)
            parting.pieces.append(np.array([piece @ piece.T for piece in pieces]))
        out.append(parting)
    return out


def _of_piece(stack: Array, side: Side, piece: Piece) -> Array:
    if piece.rows is None:
        return stack
    at = np.add.outer(np.array(piece.rows) * side.rows, np.arange(side.rows))
    return stack[:, at.ravel()]


def _prior(model: Model, names: Sequence[str]) -> Array:
    """Return the prior precision of every column by name; none of frames, none of the difference."""
    precision = effect_precision(model)
    own = [f'{k}.{j}' for k, e in enumerate(model.found) for j in range(e.fit.coordinates().size)]
    by_name = dict(zip(own, precision.tolist(), strict=True))
    return np.array([*(by_name.get(name, 0.0) for name in names), 0.0])


def _stacked(side: Side, true: int, alternative: int, names: list[str]) -> Array:
    """Return the rival's columns in the order of the names and, last, the difference."""
    columns = side.columns[alternative]
    out = np.zeros((len(names) + 1, columns.shape[1]))
    out[[names.index(name) for name in side.names[alternative]]] = columns
    out[-1] = side.predicted[true] - side.predicted[alternative]
    return out


def at_hand(
    problem: Problem, model: Model, alternatives: Sequence[Explanation], scale: Scale
) -> Side:
    """Return what explanations say of the data at hand; everything is taken about the model."""
    few = problem.thinned(_ROWS)
    return _side(few, model, alternatives, with_weights(scale, few), '')


def _ahead(
    problem: Problem,
    candidate: Candidate,
    recording: Recording,
    alternatives: Sequence[Explanation],
    scale: Scale,
) -> Side:
    """Return what the alternatives say of one recording of a candidate."""
    load = problem.recordings[0].load_of_effort
    ahead = with_expected_effort(recording, candidate.model.robot, load)
    made = _measured(candidate.model, ahead, points=max(problem.rows) == 3)
    align = set(problem.align)
    align |= {'base'} if candidate.new_base else set()
    align |= {'tool'} if candidate.new_tool else set()
    further = Problem((made,), frozenset(align))
    mark = ' new' if candidate.new_tool else ''
    side = _side(further, candidate.model, alternatives, with_weights(scale, further), mark)
    if recording.joints.static:
        return side
    reported = float(np.ptp(recording.joints.t)) / _EVERY / made.seen.t.size
    share = float(np.sqrt(min(reported, 1.0)))
    return replace(
        side,
        predicted=[p * share for p in side.predicted],
        columns=[c * share for c in side.columns],
    )


def _side(
    problem: Problem, model: Model, alternatives: Sequence[Explanation], scale: Scale, mark: str
) -> Side:
    predicted, columns, names = [], [], []
    for effects in alternatives:
        twin = model.with_found(effects)
        # Residuals are measured minus twin; what was measured drops out of differences.
        predicted.append(-problem.whitened(problem.residuals(twin), scale))
        columns.append(design(problem, twin, scale))
        _, frames = problem.frame_columns(problem.features(twin))
        sizes = enumerate(effect.fit.coordinates().size for effect in effects)
        labels = [*frames, *(f'{k}.{j}' for k, size in sizes for j in range(size))]
        names.append([_label(label, problem, mark) for label in labels])
    return Side(predicted, columns, names, max(problem.rows))


def _label(label: str, problem: Problem, mark: str) -> str:
    if label.startswith('base'):
        return f'{label} of {problem.recordings[0].name}'
    return label + mark if label.startswith('tool') else label


def _measured(model: Model, recording: Recording, *, points: bool) -> Recording:
    """Return the recording with measurements of an arm without any effect, to compare with."""
    t = recording.joints.t
    if not recording.joints.static:
        t = t[spread_over(t.size, _SAMPLES)]
    poses = model.twin(0).poses(recording, t)
    seen = Measurements(t, poses.position, None if points else poses.rotation)
    return replace(recording, measured=seen)
