# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The seam in three dimensions, coloured by deviation before and after."""

from __future__ import annotations

from typing import Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.result import Diagnosis, Traces

from .html import Html, section, tag

_POINTS = 3000
"""Points on the page, over all recordings; more cannot be told apart on a screen."""
_LINE = (
    'The thin line is where the twin has the tool, the coloured one where it was measured, its '
    'deviation enlarged.'
)
_STATIONS = (
    'Each line goes from where the twin has the tool to a dot where it was measured, its '
    'deviation enlarged.'
)
_SHOWN = 0.04
"""Part of the seam's extent that a large deviation is drawn at."""


def seam_data(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return positions and deviations in whole micrometres, and how to show them."""
    traces = diagnosis.traces
    each = max(50, _POINTS // max(len(traces.measured), 1))
    runs = []
    for k, measured in enumerate(traces.measured):
        good = trusted(traces, k)
        before, after = traces.before[k][good], traces.after[k][good]
        measured = measured[good]
        kept = thinned(np.linalg.norm(before, axis=1), np.linalg.norm(after, axis=1), each)
        static = k < len(diagnosis.recordings) and diagnosis.recordings[k].joints.static
        runs.append(
            {
                'dots': bool(static),
                'path': _micrometres((measured - before)[kept]),
                'before': _micrometres(before[kept]),
                'after': _micrometres(after[kept]),
            }
        )
    top = _large(tuple(part[trusted(traces, k)] for k, part in enumerate(traces.before)))
    return {'runs': runs, 'top': round(1e6 * top, 1), 'stretch': _stretch(traces.measured, top)}


def trusted(traces: Traces, k: int) -> np.ndarray:
    """Return which samples of a recording to draw: a gross outlier would hide all the others."""
    if traces.trusted:
        return traces.trusted[k]
    return np.ones(traces.t[k].size, dtype=bool)


def thinned(before: Array, after: Array, most: int) -> np.ndarray:
    """Return an index of at most so many samples, the largest deviations among them."""
    count = before.size
    if count <= most:
        return np.arange(count)
    bins = np.array_split(np.arange(count), most // 2)
    kept = {int(b[np.argmax(v[b])]) for b in bins for v in (before, after)}
    return np.array(sorted(kept | {0, count - 1}))


def _micrometres(points: Array) -> list[float]:
    return [round(float(value), 1) for value in (1e6 * points).ravel()]


def _large(parts: tuple[Array, ...]) -> float:
    """Return a deviation [m] that hardly any sample exceeds, never quite nothing."""
    sizes = [np.linalg.norm(part, axis=1) for part in parts if part.size]
    return max(float(np.percentile(np.concatenate(sizes), 98)), 1e-6) if sizes else 1e-6


def _stretch(measured: tuple[Array, ...], top: float) -> int:
    """Return how much larger than life deviations are drawn: 1, 2 or 5 times a power of ten."""
    points = np.concatenate([*measured, np.zeros((0, 3))])
    extent = float(np.ptp(points, axis=0).max()) if points.size else 1.0
    wanted = max(_SHOWN * extent / top, 1.0)
    power = 10 ** int(np.floor(np.log10(wanted)))
    return int(power * max(step for step in (1, 2, 5) if step * power <= wanted * 1.0001))


def at_rest(diagnosis: Diagnosis) -> bool:
    """Tell whether all that was recorded are stations at rest."""
    return bool(diagnosis.recordings) and all(r.joints.static for r in diagnosis.recordings)


def seam_section(diagnosis: Diagnosis) -> Html:
    """Return the two views; the page's script draws them."""
    after = 'with the effects found' if diagnosis.model.found else 'the same, nothing was found'
    stations = at_rest(diagnosis)
    panels = [
        tag(
            'figure',
            tag('figcaption', title),
            tag('canvas', data_side=side, tabindex='0', role='img', aria_label=label),
        )
        for side, title, label in (
            ('before', 'Before: the twin as given', 'Seam coloured by deviation before'),
            ('after', f'After: {after}', 'Seam coloured by deviation after'),
        )
    ]
    views = [
        tag('button', name.capitalize(), type='button', data_view=name)
        for name in ('angled', 'top', 'front', 'side')
    ]
    slider = tag(
        'label',
        'Deviation drawn ',
        tag('output', id_='times'),
        ' larger ',
        tag('input', type='range', id_='stretch', min='0', max='1', step='0.01'),
    )
    return section(
        'The stations' if stations else 'The seam',
        tag('div', *panels, class_='panels'),
        tag(
            'div',
            tag('canvas', id_='legend', role='img', aria_label='Colour scale'),
            tag('div', *views, class_='views'),
            slider,
            class_='controls',
        ),
        tag('noscript', tag('p', 'The picture needs scripts switched on.')),
        id_='seam',
        lead=f'{_STATIONS if stations else _LINE} Drag to turn, scroll or pinch to zoom.',
    )
