# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Free forms beside a name, at its own place: what they still predict, the formula does not say.

Lost motion of a joint is free in the gaps it trails in, and in angle, speed and load by the way it
goes; what the instrument and the frames do is a free smooth field over the workspace. They are
added to everything that is named, so that they need to find no more than what the name misses.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...effects.associative_scan import play
from ...effects.curve import QUANTITIES, basis
from ...twin.features import Features
from ...twin.resampling import Picker
from ..algebra.problem import Problem, Scale
from ..hypotheses.search import Search
from ..unseen.regions import posture_regions
from ..unseen.unseen_stretches import Base, Unseen
from .groups import LEAST, smooth_field, spanned
from .sparse_groups import RIDGES, steadiness

GAPS = (5e-5, 2e-4, 8e-4, 2e-3, 1e-2, 4e-2)
"""Widths [rad, or tens of centimetres] of gaps in series: from half of what the finest play is to
what takes a tenth of a radian to build up."""
TURNED = 1e-4
"""Travel [rad, or tens of centimetres] after which a joint counts as going the other way: teeth
have changed flanks by then."""
BENT = 4
"""Knots over the angle for each way: straight, bent, and bent back."""
SHARES = (0.02, 0.1, 0.4)
"""Shares of the joint's largest speed about which what depends on the way may set in."""
SLIDING = 0.1
"""Metres of a joint that slides which are looked at as a radian of one that turns."""


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
    sizes = [float(np.sqrt((part**2).mean())) for part in unseen.targets[1:]]
    whole = range(len(unseen.parts))
    bases = [u.base(whole) for u in (unseen, unseen.by(posture_regions(problem)))]
    out = []
    for at, on, columns in _forms(problem, unseen.scale, features, {e.at for e in model.found}):
        own = [s for e, s in zip(model.found, sizes, strict=True) if at in (e.at, 'instrument')]
        gain, steady, fall = worse_of([told_by(base, columns) for base in bases])
        share = float(np.sqrt(max(fall, 0.0))) / max([*own, 1e-12])
        out.append(Beside(at, on, gain, steady, share))
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
        if joint in places and _moves(features, i):
            ways = [_lost(problem, k, maker, features, i) for k, maker in enumerate(features)]
            named.append((joint, 'direction', ways))
    for at, on, parts in named:
        columns = spanned(problem, scale, at, on, (), parts).columns
        if columns.size:
            yield at, on, columns


def _moves(features: list[Features], i: int) -> bool:
    return max(float(np.ptp(m.run.view.q[:, i])) for m in features) > LEAST['angle']


def _lost(problem: Problem, k: int, maker: Features, features: list[Features], i: int) -> Array:
    """Return what joint i may lose by the way it goes, shape (E, c, M)."""
    view, unit = maker.view, SLIDING if maker.twin.robot.prismatic[i] else 1.0
    q = maker.joint_view.joint(i)
    widths = unit * np.array([*GAPS, TURNED])[:, None]
    trails = play(q, widths, np.full(len(widths), q[0])) - q
    trails = Picker(maker.recording.joints, maker.run.view.t).pick(trails)
    way = trails[-1] / (-0.5 * widths[-1])
    angles = [m.view.q[:, i] for m in features]
    knots = np.linspace(min(map(np.min, angles)), max(map(np.max, angles)), BENT)
    speed = view.qd[:, i]
    fastest = max(float(np.abs(m.view.qd[:, i]).max()) for m in features)
    rest = QUANTITIES['direction'](view, i)
    about = np.tanh(speed / (np.array(SHARES)[:, None] * max(fastest, LEAST['speed'])))
    shapes = [
        *trails[:-1],
        *(way * basis(knots.tolist(), view.q[:, i])),
        *about,
        *(rest, np.abs(rest), speed, way * QUANTITIES['load'](view, i)),
    ]
    return np.asarray(problem.seen(k, maker.column(('q', i))) * np.array(shapes)[:, None, :])


def told_by(base: Base, columns: Array) -> tuple[float, float, float]:
    """Return what columns take off the squared unseen error: share, steadiness, mean square."""
    labels = base.unseen.labels
    names = np.unique(labels)
    before, told = base.residual**2, (-np.inf, 0.0, 0.0)
    one = np.array([before[labels == n].mean() for n in names])
    for residual in base.extended(columns, RIDGES):
        after = residual**2
        fall = float(before.mean() - after.mean())
        gain = fall / max(float(before.mean()), 1e-300)
        if gain > told[0]:
            two = np.array([after[labels == n].mean() for n in names])
            told = (gain, steadiness(one, two), fall)
    return told


def worse_of(ways: Sequence[tuple[float, float, float]]) -> tuple[float, float, float]:
    """Return the least of each over the ways of leaving out."""
    gains, steadies, falls = zip(*ways, strict=True)
    return min(gains), min(steadies), min(falls)
