# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""From recordings to a fitted set of effects: baseline, selection, many small errors, final fit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from .fit import Fit, fit, robust_fit, robust_scale
from .library import Library, build
from .problem import Model, Problem, Scale
from .score import effective_share
from .select import Workspace, backward, forward
from .small_errors import many_small

SEARCH_ROWS = 9000
"""Rows a search works on: what is found there is fitted again on all."""
FIT_ROWS = 30000
ROUNDS = 3
MANY = 8
"""So many units found one by one on stations mean many small errors acting together."""
Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Search:
    """
    What a search found.

    Attributes
    ----------
    problem, scale : Problem, Scale
        All measurements, with the final noise and weights.
    baseline : Fit
        Frames and known effects only.
    final : Fit
    precision : array, shape (K,)
        Prior precision of the final fit's coordinates.
    work : Workspace
        The library that rivals are drawn from.
    small : Fit
        The final fit on the workspace's measurements.
    dense : bool
        Whether many small errors were fitted together.

    """

    problem: Problem
    scale: Scale
    baseline: Fit
    final: Fit
    precision: Array
    work: Workspace
    small: Fit
    dense: bool

    @property
    def library(self) -> Library:
        """Return the library searched."""
        return self.work.library

    def effective(self, found: Fit) -> float:
        """Return the number of independent rows of a fit on the workspace's measurements."""
        return effective_rows(self.work.problem, found)


def effective_rows(problem: Problem, found: Fit) -> float:
    """Return the number of independent rows of a fit's residual."""
    share = effective_share(found.residual, problem.rows, problem.samples)
    return share * found.residual.size


def search(
    problem: Problem, start: Model, exclude: Sequence[str], progress: Progress
) -> Search:
    """Return the effects that earn their place, fitted on all measurements."""
    full = problem.thinned(FIT_ROWS)
    baseline, scale = robust_fit(full, start, full.unit_scale())
    progress('baseline fitted')
    small = problem.thinned(SEARCH_ROWS)
    model, dense = baseline.model, False
    work, now = _workspace(small, model, exclude)
    for _ in range(ROUNDS):
        before = names(model)
        steps = forward(work, now, lambda f: effective_rows(small, f), MANY, progress)
        if steps:
            now = backward(work, steps[-1].fit, lambda f: effective_rows(small, f))
        model = now.model
        dense = small.recordings[0].joints.static and len(model.found) >= MANY
        if dense or names(model) == before:
            break
        work, now = _workspace(small, model, exclude)
    if dense:
        progress('many small errors at once: fitting them together')
        final, scale, precision = many_small(full, model, exclude, progress)
        return Search(full, scale, baseline, final, precision, work, now, True)
    final, scale = robust_fit(full, model, robust_scale(full, full.residuals(model)), rounds=1)
    return Search(full, scale, baseline, final, np.zeros(0), work, now, False)


def names(model: Model) -> list[tuple[str, str | None, int]]:
    """Return what tells one set of found effects from another."""
    return sorted(
        ((e.name, e.site, e.coordinates().size) for e in model.found),
        key=lambda item: (item[0], item[1] or '', item[2]),
    )


def _workspace(problem: Problem, model: Model, exclude: Sequence[str]) -> tuple[Workspace, Fit]:
    scale = robust_scale(problem, problem.residuals(model))
    now = fit(problem, model, scale, None, 4)
    return Workspace.of(problem, scale, build(problem, now.model, scale, exclude)), now
