# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Effects that nearly cancel each other: a search that took a wrong turn, looked at again.

A frame that bends a whole motion one way and a second effect that bends it back imitate several
causes at once. Searched again without the one that does most, the others may come out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ..algebra.problem import Model, Problem
from ..beliefs import Beliefs
from ..hypotheses.search import Search, search
from .unseen_stretches import Unseen

TRIES = 2
"""Kinds that are left out, one at a time: the two that do most work against each other."""


def uncancelled(
    found: Search,
    posed: tuple[Problem, Model],
    exclude: Sequence[str],
    beliefs: Beliefs,
    progress: Callable[[str], None],
) -> Search:
    """
    Return the search, or one whose effects do not cancel and predict unseen stretches as well.

    Parameters
    ----------
    found : Search
    posed : (Problem, Model)
        What was searched.
    exclude : sequence of str
        Families taken out of the library.
    beliefs : Beliefs
    progress : callable
        Told what has been done.

    """
    parts = parts_of(_unseen(found))
    if found.dense or len(parts) < 2 or parts.sum() <= beliefs.cancel:
        return found
    progress('effects cancel each other: searching without the largest')
    most = (1.0 + beliefs.parted) * _left(found)
    names = [found.final.model.found[k].name for k in np.argsort(-parts)]
    trials = [
        search(*posed, (*exclude, name), beliefs, progress)
        for name in list(dict.fromkeys(names))[:TRIES]
    ]
    held = [t for t in trials if parts_of(_unseen(t)).sum() <= beliefs.cancel]
    best = min(held, key=_left, default=found)
    if best is found or _left(best) > most:
        return found
    # What was left out of this search is no family that somebody took out.
    library = replace(best.library, absent=found.library.absent)
    return replace(best, work=replace(best.work, library=library))


def parts_of(unseen: Unseen) -> Array:
    """
    Return the squared contribution of every effect over the square of their sum, (K,).

    Parameters
    ----------
    unseen : Unseen
        Of the final model.

    """
    parts = unseen.targets[1:]
    total = parts.sum(axis=0)
    return np.array([float(p @ p) / max(float(total @ total), 1e-300) for p in parts])


def _unseen(found: Search) -> Unseen:
    return Unseen.of(found.problem, found.scale, found.final, found.precision)


def _left(found: Search) -> float:
    unseen = _unseen(found)
    return unseen.rms(unseen.predict(range(len(unseen.parts))))
