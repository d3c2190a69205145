# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Do the formulas of the names hold? Free forms instead of them and at their places, and noise.

At their places lost motion of a joint is free in the gaps it trails in, and in angle, speed and
load by the way it goes; what the instrument and the frames do is a free smooth field over the
workspace. They are added to everything that is named, so that they need to find no more than what
the name misses.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...effects.associative_scan import play
from ...effects.curve import QUANTITIES, basis
from ...twin.features import Features
from ...twin.resampling import Picker
from ..algebra.problem import Problem, Scale
from ..beliefs import Beliefs
from ..hypotheses.search import Search
from ..hypotheses.usual_errors import UsualErrors
from ..unseen.folds import least_gain
from ..unseen.unseen_stretches import Unseen
from ..verdict.decision import Verdict
from .curved import Curved
from .groups import LEAST, smooth_field, spanned
from .scatter import Scatter, scatter

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
FIELD = 'instrument'
"""A free field over the workspace speaks against every formula: it is what each of them bends to."""


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


class Missed(NamedTuple):
    """
    What the formulas of the names miss.

    Attributes
    ----------
    scattered : tuple of Scatter
        Joints that noise comes from beyond doubt, largest first.
    forms : tuple of Beside
        Free forms that predict beyond doubt what a name should.

    """

    scattered: tuple[Scatter, ...] = ()
    forms: tuple[Beside, ...] = ()

    @property
    def in_words(self) -> tuple[tuple[str, str], ...]:
        """Return the places where formulas do not hold, each with the free form that predicts most."""
        best: dict[str, Beside] = {}
        for one in self.forms:
            if one.at not in best or one.gain > best[one.at].gain:
                best[one.at] = one
        return tuple((at, _misses(one)) for at, one in best.items())


def missed(result: Search, unseen: Unseen, beliefs: Beliefs) -> Missed:
    """Return what the formulas of the effects found miss, as far as it is beyond doubt."""
    if result.dense:
        return Missed()
    loose = [
        one
        for one in sorted(scatter(result, unseen), key=lambda one: -one.share)
        if one.share >= beliefs.beaten_share and one.steady >= beliefs.scatter_sure
    ]
    forms = [one for one in beside_names(result, unseen) if _fails(one, beliefs)]
    if forms:
        # A field is what small errors everywhere do as well: names fail by what is beyond those.
        own = result.problem, result.scale, result.final
        small = UsualErrors.beside(*own, lambda fit: float(fit.residual.size))
        at = {(one.at, one.on) for one in forms}
        beyond = beside_names(result, unseen.along(small.columns))
        forms = [one for one in beyond if (one.at, one.on) in at and _fails(one, beliefs)]
    return Missed(tuple(loose), tuple(forms))


def no_noise(
    verdict: Verdict, alternative: Curved | None, remaining: Missed, beliefs: Beliefs
) -> Verdict:
    """
    Return 'unknown' in the place of 'none' where what looks like noise follows something.

    Parameters
    ----------
    verdict : Verdict
        Of any other status, nothing changes.
    alternative : Curved or None
        The free-form explanation, whether or not it can be carried to another motion.

    """
    if verdict.status != 'none':
        return verdict
    reasons = [
        f'what remains is no noise of the instrument: {100.0 * one.share:.0f} % of it lies along '
        f'the motion of {one.joint}'
        for one in remaining.scattered
    ]
    form = None if alternative is None else alternative.form
    if form and form.gain >= beliefs.beaten_share and form.steady >= beliefs.beaten_steady:
        places = ' and '.join(str(part.group) for part in form.parts)
        reasons.append(
            f'no effect in the library explains the gap, but it is no noise: {places} predicts '
            f'{100.0 * form.gain:.0f} % of it on unseen stretches'
        )
    return replace(verdict, status='unknown', reasons=tuple(reasons)) if reasons else verdict


def _fails(one: Beside, beliefs: Beliefs) -> bool:
    """Return whether a free form takes off more than what a formula may miss."""
    if one.on == 'place':
        clear = one.gain >= beliefs.dependence_gain and one.steady >= beliefs.dependence_sure
        return clear and one.share >= beliefs.field_misses
    clear = one.gain >= beliefs.group_share and one.steady >= beliefs.structure_sure
    return clear and one.share >= beliefs.misfit_share


def _misses(one: Beside) -> str:
    return (
        f'a free curve at {one.at}, depending on {one.on}, still predicts '
        f'{100.0 * one.gain:.0f} % of what is left on unseen stretches: the formula of what was '
        'found does not hold'
    )


def beside_names(result: Search, unseen: Unseen) -> list[Beside]:
    """Return what free forms at the places of the effects found predict beside all of them."""
    problem, model = unseen.problem, result.final.model
    if problem.touched or not model.found:
        return []
    features = problem.features(model)
    sizes = [unseen.rms(part) for part in unseen.targets[1:]]
    bases = unseen.bases()
    out = []
    for at, on, columns in _forms(problem, unseen.scale, features, {e.at for e in model.found}):
        own = [s for e, s in zip(model.found, sizes, strict=False) if at in (e.at, 'instrument')]
        reported = least_gain([base.gain(columns) for base in bases])
        share = float(np.sqrt(max(reported.fall, 0.0))) / max([*own, 1e-12])
        out.append(Beside(at, on, reported.share, reported.steady, share))
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
