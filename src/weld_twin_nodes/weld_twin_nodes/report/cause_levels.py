# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is certain of each cause: its place, what it depends on, its name, and its curve."""

from __future__ import annotations

import numpy as np

from weld_twin_core.diagnosis.result import Cause, Diagnosis, Site
from weld_twin_core.effects.joint_curve import JointCurve

from .curve_plot import curve_figure
from .html import Html, joined, section, table, tag
from .quantities import odds, percent
from .words import DEPENDENCES, place_name, site_name

_CURVES = ('joint_curve', 'frame_curve')
_SHOWN = 4
"""Causes in the table, largest share first; more are noise to a reader."""
LEVEL_HEADS = ('Share of the gap', 'Where', 'Depends on', 'Name')
_PICTURED = 6
"""Curves that are drawn."""


def levels_section(diagnosis: Diagnosis) -> Html | None:
    """Return the causes level by level, with the curves that are in the twin; None without any."""
    if not diagnosis.causes:
        return None
    rows = [level_row(cause) for cause in diagnosis.causes[:_SHOWN]]
    rest = diagnosis.shares
    return section(
        'What is certain',
        table(LEVEL_HEADS, rows, 'levels'),
        tag(
            'p',
            f'Shares are of the squared gap on data not used for fitting. '
            f'{percent(rest.noise)} is noise, {percent(rest.unexplained)} is left unexplained.',
            class_='note',
        ),
        _curves(diagnosis),
        id_='levels',
        lead='Each level stands for itself: the place can be certain while the name is not.',
    )


def level_row(cause: Cause) -> list[str]:
    """Return share, place, dependence and name of a cause, each with its odds."""
    low, high = cause.share_ci90
    return [
        f'{percent(cause.share)} ({percent(low)} to {percent(high)})',
        _alternatives([(place_name(at), p) for at, p in cause.place]),
        _alternatives([(DEPENDENCES.get(on, on), p) for on, p in cause.dependence]),
        _names(cause),
    ]


def _alternatives(told: list[tuple[str, float]]) -> str:
    return ', '.join(f'{name} ({odds(p)})' for name, p in told[:3])


def _names(cause: Cause) -> str:
    named = [(site, p) for site, p in cause.name if site.effect not in _CURVES]
    if not named:
        return 'none that the library knows; its curve is below' if cause.name else 'none'
    return _alternatives([(site_name(site), p) for site, p in named])


def _curves(diagnosis: Diagnosis) -> Html | None:
    found = [
        (k, effect)
        for k, effect in enumerate(diagnosis.model.found)
        if isinstance(effect, JointCurve) and effect.over != 'constant'
    ]
    if not found:
        return None
    spreads = _spreads(diagnosis)
    figures = [curve_figure(effect, spreads[k]) for k, effect in found[:_PICTURED]]
    title = tag('h3', 'The curves in the twin')
    note = (
        'Each was measured, not derived: a spline with the band in which it lies with 90 %. It is '
        'in the twin, in predictions and in corrected programs like any other effect.'
    )
    return joined([title, tag('p', note, class_='note'), tag('div', *figures, class_='curves')])


def _spreads(diagnosis: Diagnosis) -> list[np.ndarray | None]:
    """Return the covariance of every found effect's coordinates, None where it is not known."""
    found = diagnosis.model.found
    posterior = diagnosis.posterior
    if posterior is None:
        return [None] * len(found)
    what = posterior.directions
    starts = what.frame_count + np.concatenate([[0], np.cumsum(what.sizes)]).astype(int)
    out: list[np.ndarray | None] = []
    for effect in found:
        matching = [
            k
            for k, other in enumerate(what.effects)
            if Site(other.name, other.site) == Site(effect.name, effect.site)
            and other.key == effect.key
        ]
        if not matching:
            out.append(None)
            continue
        rows = slice(starts[matching[0]], starts[matching[0] + 1])
        out.append(posterior.covariance[rows, rows])
    return out
