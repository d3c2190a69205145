# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Free forms beside a name, at its own place: what they still predict, the formula does not say.

A joint may lose motion by any law; what the instrument and the frames do is a free smooth field
over the workspace. They are added to everything that is named, so that they need to find no more
than what the name misses.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...twin.features import Features
from ..algebra.problem import Problem, Scale
from ..hypotheses.search import Search
from ..unseen.regions import posture_regions
from ..unseen.unseen_stretches import Taken, Unseen
from .groups import smooth_field, spanned
from .whole_arm import lost_motion, moves


class Beside(NamedTuple):
    """
    What a free form predicts that the names do not.

    Attributes
    ----------
    at, on : str
        Place and dependence of the free form.
    gain : float
        Share of the squared error that it takes off on unseen data, by the way of leaving out,
        stretches of time or regions of posture, that shows less.
    steady : float
        The same in standard errors between the parts left out.
    share : float
        RMS of what it takes off over that of the largest effect named at this place.

    """

    at: str
    on: str
    gain: float
    steady: float
    share: float


def beside_names(found: Search, unseen: Unseen) -> list[Beside]:
    """
    Return what free forms at the places of the effects found predict beside all of them.

    Parameters
    ----------
    found : Search
    unseen : Unseen
        Of its final model.

    """
    problem, model = unseen.problem, found.final.model
    if problem.touched or not model.found:
        return []
    features = problem.features(model)
    sizes = [unseen.rms(part) for part in unseen.targets[1:]]
    whole = range(len(unseen.parts))
    bases = [u.base(whole) for u in (unseen, unseen.by(posture_regions(problem)))]
    out = []
    for at, on, columns in _forms(problem, unseen.scale, features, {e.at for e in model.found}):
        own = [s for e, s in zip(model.found, sizes, strict=True) if at in (e.at, 'instrument')]
        told = worse_of([base.taken(columns) for base in bases])
        share = float(np.sqrt(max(told.fall, 0.0))) / max([*own, 1e-12])
        out.append(Beside(at, on, told.gain, told.steady, share))
    return out


def _forms(
    problem: Problem, scale: Scale, features: list[Features], places: set[str]
) -> Iterator[tuple[str, str, Array]]:
    """Yield place, dependence and columns, whitened and of unit mean square, (E, rows)."""
    field = [smooth_field(problem, k, maker) for k, maker in enumerate(features)]
    # Where noise hides the squares of the place, its linear part may still show.
    linear = [np.concatenate([part[k : k + 3] for k in range(0, len(part), 9)]) for part in field]
    named = [('instrument', 'place', field), ('instrument', 'place', linear)]
    moving = not problem.at_rest
    for i, joint in enumerate(features[0].twin.robot.joint_names if moving else ()):
        if joint in places and moves(features, i):
            ways = [
                lost_motion(problem, k, maker, features, i) for k, maker in enumerate(features)
            ]
            named.append((joint, 'direction', ways))
    for at, on, parts in named:
        columns = spanned(problem, scale, at, on, (), parts).columns
        if columns.size:
            yield at, on, columns


def worse_of(ways: Sequence[Taken]) -> Taken:
    """Return the least that columns take off over the ways of leaving out, and the most left."""
    gains, steadies, falls, left = zip(*ways, strict=True)
    return Taken(min(gains), min(steadies), min(falls), max(left))
