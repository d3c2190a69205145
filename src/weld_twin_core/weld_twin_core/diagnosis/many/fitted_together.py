# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Many small errors instead of a few: whether all kinds fitted together predict better."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..beliefs import Beliefs
from ..hypotheses.search import Search
from ..unseen.unseen_stretches import Unseen
from .small_errors import many_small


def fitted_together(
    found: Search, exclude: Sequence[str], beliefs: Beliefs, progress: Callable[[str], None]
) -> Search:
    """
    Return what was found, or all families fitted together where that explains stations better.

    Parameters
    ----------
    found : Search
        The effects found one by one.
    exclude : sequence of str
        Families taken out of the library.
    beliefs : Beliefs
    progress : callable
        Told what has been done.

    """
    model = found.small.model
    if not (
        found.work.problem.recordings[0].joints.static and len(model.found) >= beliefs.several
    ):
        return found
    progress('many small errors at once: fitting them together')
    final, scale, precision = many_small(found.problem, model, exclude, beliefs, progress)
    together = replace(found, scale=scale, final=final, precision=precision, slots=(), dense=True)
    if found.crowded:
        return together
    unseen = _unseen(together)
    left = _unseen_rms(unseen)
    many = _members(unseen, beliefs.member * left) >= beliefs.many
    return together if many and left < beliefs.better * _unseen_rms(_unseen(found)) else found


def _unseen(found: Search) -> Unseen:
    return Unseen.of(found.problem, found.scale, found.final, found.precision)


def _unseen_rms(unseen: Unseen) -> float:
    return unseen.rms(unseen.predict(range(len(unseen.parts))))


def _members(unseen: Unseen, least: float) -> int:
    """Return how many effects move the tool by more than this, RMS [m]."""
    sizes = np.array([unseen.rms(part) for part in unseen.targets[1:]])
    return int((sizes > least).sum())
