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

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ...recording import Measurements, Recording
from ...twin.expected_effort import with_expected_effort
from ..algebra.fit import design, with_weights
from ..algebra.prior import effect_precision
from ..algebra.problem import Model, Problem, Scale
from .candidates import Candidate

ROWS = 1200
"""Rows of the data at hand that take part."""
SAMPLES = 120
"""Samples of a path that are computed; neighbours of a moving arm say the same."""
EVERY = 0.15
"""Time [s] after which a moving arm says something new: in it the arm moves by centimetres."""
LOOSE = 1e-10
"""Added to the diagonal of a normal matrix, as a share of it: what is less is rounding."""

Alternative = tuple[Effect, ...]
Pair = tuple[int, int]


@dataclass(frozen=True, eq=False)
class Side:
    """Predictions and derivatives of every alternative on one set of recordings, whitened."""

    predicted: list[Array]
    columns: list[Array]
    names: list[list[str]]
    rows: int
    """Scalar rows per sample."""


@dataclass(frozen=True, eq=False)
class Normals:
    """
    For every pair (true, rival) with the first explanation what the data at hand and each piece say.

    Attributes
    ----------
    now : dict
        Normal matrix of the rival's columns and, last, the difference, shape (P, P).
    pieces : dict
        The same of every piece, shape (K, P, P).

    """

    now: dict[Pair, Array]
    pieces: dict[Pair, Array]

    def before(self) -> dict[Pair, float]:
        """Return by how many standard deviations the data at hand part every pair."""
        return {pair: float(_left(matrix[None])[0]) for pair, matrix in self.now.items()}

    def added(
        self, pairs: Sequence[Pair], chosen: Sequence[int], more: Sequence[int]
    ) -> dict[Pair, Array]:
        """
        Return by how many standard deviations pairs part with further pieces, shape (len(more),).

        Each piece of ``more`` is tried beside those that are in already, ``chosen``.
        """
        out = {}
        for pair in pairs:
            base = self.now[pair] + self.pieces[pair][list(chosen)].sum(axis=0)
            out[pair] = _left(base + self.pieces[pair][list(more)])
        return out


def _left(matrices: Array) -> Array:
    """Return what columns leave of the last one, its length, shape (K,)."""
    size = np.sqrt(np.maximum(np.diagonal(matrices, axis1=1, axis2=2), 1e-300))
    scaled = matrices / size[:, :, None]
    scaled /= size[:, None, :]
    each = np.arange(matrices.shape[1] - 1)
    scaled[:, each, each] += LOOSE
    try:
        # The last pivot of the factor is what is left, at half the work of solving.
        return np.asarray(size[:, -1] * np.linalg.cholesky(scaled)[:, -1, -1])
    except np.linalg.LinAlgError:  # one of them leaves nothing but rounding
        cross = scaled[:, :-1, -1:]
        taken = (cross * np.linalg.solve(scaled[:, :-1, :-1], cross)).sum(axis=(1, 2))
        return np.asarray(size[:, -1] * np.sqrt(np.maximum(1.0 - taken, 0.0)))


def normals(
    problem: Problem,
    model: Model,
    alternatives: Sequence[Alternative],
    scale: Scale,
    candidate: Candidate,
    now: Side,
) -> Normals:
    """
    Return what a candidate's pieces say of every pair of alternatives, beside the data at hand.

    Parameters
    ----------
    problem, model, alternatives, scale
        As `at_hand` takes them.
    now : Side
        As `at_hand` returned it.

    """
    ahead = [
        _ahead(problem, candidate, recording, alternatives, scale)
        for recording in candidate.recordings
    ]
    out = Normals({}, {})
    # The first is believed most: what parts it from each other decides.
    others = range(1, len(alternatives))
    for true, alternative in [pair for k in others for pair in ((0, k), (k, 0))]:
        names = sorted({n for side in (now, *ahead) for n in side.names[alternative]})
        held = _held(model.with_found(alternatives[alternative]), names)
        out.now[true, alternative] = np.diag(held) + _normal(
            _stacked(now, true, alternative, names)
        )
        stacks = [_stacked(side, true, alternative, names) for side in ahead]
        matrices = []
        for piece in candidate.pieces:
            stack, side = stacks[piece.recording], ahead[piece.recording]
            if piece.rows is not None:
                at = np.add.outer(np.array(piece.rows) * side.rows, np.arange(side.rows))
                stack = stack[:, at.ravel()]
            matrices.append(_normal(stack))
        out.pieces[true, alternative] = np.array(matrices)
    return out


def _normal(stack: Array) -> Array:
    return np.asarray(stack @ stack.T)


def _held(model: Model, names: Sequence[str]) -> Array:
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
    problem: Problem, model: Model, alternatives: Sequence[Alternative], scale: Scale
) -> Side:
    """
    Return what the alternatives say of the data at hand.

    Parameters
    ----------
    model : Model
        What is believed so far; everything is taken about it.
    alternatives : sequence of Alternative
        The explanations to tell apart.

    """
    few = problem.thinned(ROWS)
    return _side(few, model, alternatives, with_weights(scale, few), '')


def _ahead(
    problem: Problem,
    candidate: Candidate,
    recording: Recording,
    alternatives: Sequence[Alternative],
    scale: Scale,
) -> Side:
    """Return what the alternatives say of one recording of a candidate."""
    ahead = with_expected_effort(
        recording, candidate.model.robot, problem.recordings[0].load_of_effort
    )
    made = _measured(candidate.model, ahead, points=max(problem.rows) == 3)
    align = set(problem.align)
    align |= {'base'} if candidate.new_base else set()
    align |= {'tool'} if candidate.new_tool else set()
    further = Problem((made,), frozenset(align))
    mark = ' new' if candidate.new_tool else ''
    side = _side(further, candidate.model, alternatives, with_weights(scale, further), mark)
    if recording.joints.static:
        return side
    reported = float(np.ptp(recording.joints.t)) / EVERY / made.seen.t.size
    share = float(np.sqrt(min(reported, 1.0)))
    return replace(
        side,
        predicted=[p * share for p in side.predicted],
        columns=[c * share for c in side.columns],
    )


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
    return Side(predicted, columns, names, max(problem.rows))


def _label(label: str, problem: Problem, mark: str) -> str:
    """Return a column's name; frames of the new measurement are its own."""
    if label.startswith('base'):
        return f'{label} of {problem.recordings[0].name}'
    return label + mark if label.startswith('tool') else label


def _measured(model: Model, recording: Recording, *, points: bool) -> Recording:
    """Return the recording with measurements of an arm without any effect, to compare with."""
    t = recording.joints.t
    if not recording.joints.static:
        t = t[np.linspace(0, t.size - 1, min(SAMPLES, t.size)).round().astype(int)]
    poses = model.twin(0).poses(recording, t)
    seen = Measurements(t, poses.position, None if points else poses.rotation)
    return replace(recording, measured=seen)
