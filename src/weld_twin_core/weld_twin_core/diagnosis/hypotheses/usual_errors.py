# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What every arm is off by a little: zeros, links, bearings, wheels and springs of all joints.

None is worth a name. Beside them a cause that hangs on how a joint moves is weighed. Else a formula
with a number more takes that number for what they do: friction that is uneven trails, on a joint
that never rests, by a constant, and so does a zero; play has no such number, and would be told as
friction. They are Gaussian about zero, each moves the tool as far as the others, and how far that is
on this arm is learned: at most as far as the noise does, for what moves it farther is a cause. Where
nothing is left for them they are nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ..algebra.definite import EMPTY
from ..algebra.fit import Fit, design, solve_scaled
from ..algebra.learned_sizes import learned_precision, projected
from ..algebra.problem import Problem, Scale
from ..algebra.still_joints import hardly_moves, moved_most, plain_causes

ON = ('constant', 'angle', 'load')
"""What they depend on: on the posture alone. What hangs on how a joint moves is none of these."""


@dataclass(frozen=True, eq=False)
class UsualErrors:
    """Small errors everywhere, as far as one fit shows how large they are."""

    problem: Problem
    scale: Scale
    columns: Array
    """Whitened, each as large as it usually is on this arm, shape (P, rows)."""
    count: float
    """Number of rows that are independent beside them."""

    @classmethod
    def beside(
        cls, problem: Problem, scale: Scale, now: Fit, effective: Callable[[Fit], float]
    ) -> UsualErrors:
        """
        Return those that a fit leaves room for, beside its frames and effects.

        problem, scale: that the fit is of.
        effective: number of independent rows of a fit.
        """
        features = problem.features(now.model)
        have = {effect.key for effect in now.model.found}
        view = features[moved_most(features, None)].view
        # All at zero, but for those in the model and those that the data cannot show.
        small = [e for e in plain_causes(now.model.robot, view, ON) if e.key not in have]
        shown = [e for e in small if not hardly_moves(features, e)]
        every = (problem.effect_columns(features, e, atoms=False) for e in shown)
        rows = [problem.whitened(each, scale) for each in every]
        columns = np.concatenate([np.zeros((0, now.residual.size)), *rows])
        free = cls(problem, scale, _sized(problem, scale, columns, now), 0.0)
        # As long as they are missing what is left is theirs, and looks far from independent.
        count = effective(replace(now, residual=free.beyond(now)[0]))
        # A row counts as part of one, but how large they are is believed in full.
        return cls(
            problem, scale, free.columns * np.sqrt(min(count / now.residual.size, 1.0)), count
        )

    def left(self, result: Fit) -> float:
        """Return what a fit leaves beside them, whitened squares, its own numbers fitted anew."""
        return self.beyond(result)[1]

    def beyond(self, result: Fit) -> tuple[Array, float]:
        """Return the residual beside them, (rows,), and its squares with what their sizes cost."""
        own = design(self.problem, result.model, self.scale)
        cross = own @ self.columns.T
        normal = np.block([[own @ own.T, cross], [cross.T, self._normal]])
        right = np.concatenate([own @ result.residual, self.columns @ result.residual])
        step = solve_scaled(normal, right, 0.0)
        explained = step[: len(own)] @ own + step[len(own) :] @ self.columns
        return result.residual - explained, result.rss - float(right @ step)

    @cached_property
    def _normal(self) -> Array:
        """Return the normal matrix of their columns, each believed to be as large as usual."""
        return np.asarray(self.columns @ self.columns.T + np.eye(len(self.columns)))


def _sized(problem: Problem, scale: Scale, columns: Array, now: Fit) -> Array:
    """Return columns as large as a fit shows them to be."""
    own = design(problem, now.model, scale)
    both = np.concatenate([own, columns])
    # What moved the tool by more than the noise would be a cause by itself.
    most = 1.0 / np.sqrt(np.maximum((columns**2).mean(axis=1), EMPTY))
    precision, _ = learned_precision(
        *projected(both @ both.T, both @ now.residual, now.rss, len(own)),
        now.residual.size - len(own),
        np.zeros(len(columns), int),
        most,
        most**-2.0,
    )
    return np.asarray(columns / np.sqrt(precision)[:, None])


def usual(kinds: Iterable[Effect | type[Effect]]) -> bool:
    """Return whether effects are all of kinds that every arm has a little of."""
    return all(kind.traits.depends_on in ON for kind in kinds)
