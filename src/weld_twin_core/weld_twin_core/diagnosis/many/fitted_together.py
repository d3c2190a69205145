# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Many small errors instead of a few: whether all kinds fitted together predict better."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..hypotheses.search import MANY, Search
from ..unseen.unseen_stretches import Unseen
from .small_errors import many_small

SEVERAL = 4
"""From this many on, the many are tried, and taken if they predict unseen stations better."""
BETTER = 0.95
MEMBER = 0.3
"""Share of what all of them leave from which an effect counts as one of the many; a few large ones
that tiny ones mend are one cause that the library lacks."""


def fitted_together(
    found: Search, exclude: Sequence[str], progress: Callable[[str], None]
) -> Search:
    """
    Return what was found, or all families fitted together where that explains stations better.

    Parameters
    ----------
    found : Search
        The effects found one by one.
    exclude : sequence of str
        Families taken out of the library.
    progress : callable
        Told what has been done.

    """
    model = found.small.model
    if not (found.work.problem.recordings[0].joints.static and len(model.found) >= SEVERAL):
        return found
    progress('many small errors at once: fitting them together')
    final, scale, precision = many_small(found.problem, model, exclude, progress)
    together = replace(found, scale=scale, final=final, precision=precision, slots=(), dense=True)
    if found.crowded:
        return together
    unseen = _unseen(together)
    left = _unseen_rms(unseen)
    many = _members(unseen, left) >= MANY
    return together if many and left < BETTER * _unseen_rms(_unseen(found)) else found


def _unseen(found: Search) -> Unseen:
    return Unseen.of(found.problem, found.scale, found.final, found.precision)


def _unseen_rms(unseen: Unseen) -> float:
    return unseen.rms(unseen.predict(range(len(unseen.parts))))


def _members(unseen: Unseen, left: float) -> int:
    """Return how many effects move the tool by more than a share of what is left [m]."""
    sizes = np.array([unseen.rms(part) for part in unseen.targets[1:]])
    return int((sizes > MEMBER * left).sum())
