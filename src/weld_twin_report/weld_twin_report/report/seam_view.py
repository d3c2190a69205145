# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The seam in space, coloured by deviation, as it is and with what is thought mended."""

import numpy as np

from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_nodes.wording.mending import as_it_is, parted, remaining_with, switches, trusted
from weld_twin_nodes.wording.quantities import counted, millimetres, percent
from weld_twin_nodes.wording.words import listed

from .charts import Axis, Line, chart
from .html import Child, Html, joined, section, tag
from .page_data import along, at_rest, drawn, left_out, seen_at, static
from .sections import Content, on_page

_LINE = (
    'The thin line is where the model of the robot has the tool, the coloured one where it was '
    'measured, its deviation enlarged.'
)
_STATIONS = (
    'Each line goes from where the model of the robot has the tool to a dot where it was measured, '
    'its deviation enlarged.'
)
_LISTED = 3
"""Samples that are named where they are not drawn, the farthest off first chosen."""
_TENTH = 0.1
"""Part of the gap below which what is left is reported with a decimal."""
_RECORDINGS = 6
"""Recordings drawn over time."""


@on_page('answer', 30)
def seam_section(page: Content) -> Html | None:
    """Return switches, two views and the deviation over time; None where contacts took its place."""
    diagnosis = page.diagnosis
    if diagnosis.contacts is not None:
        return None
    stations = at_rest(diagnosis)
    changes = bool(switches(diagnosis)) or bool(diagnosis.model.found)
    count = len(diagnosis.traces.t)
    charts = [_chart(diagnosis, k) for k in range(min(count, _RECORDINGS))]
    more = count - len(charts)
    note = tag('p.note', f'{more} more recordings are not drawn.') if more > 0 else None
    title = 'Deviation by station' if stations else 'Deviation along the recording'
    return section(
        'What if' if switches(diagnosis) else ('The stations' if stations else 'The seam'),
        _switches(diagnosis),
        _figures(diagnosis) if switches(diagnosis) else None,
        tag('div', *_panels(diagnosis, changes), class_='panels' if changes else 'panels one'),
        _controls(stations),
        tag('p#instant.instant'),
        tag('noscript', tag('p', 'The pictures need scripts switched on.')),
        joined([tag('h3', title), *charts, note]),
        id_='seam',
        lead=f'{_STATIONS if stations else _LINE} Drag to turn; click it first, then the wheel '
        'or two fingers zoom.',
    )


def _switches(diagnosis: Diagnosis) -> Html | None:
    result = switches(diagnosis)
    if not result:
        return None
    boxes = [
        tag('label', tag('input', type='checkbox', data_switch=k, checked=''), ' ', switch.label)
        for k, switch in enumerate(result)
    ]
    buttons = [
        tag('button', text, type='button', data_all=value)
        for text, value in (('as it is', 'off'), ('all mended', 'on'))
    ]
    return tag(
        'fieldset.switches', tag('legend', 'Take as mended:'), *boxes, tag('span.views', *buttons)
    )


def _figures(diagnosis: Diagnosis) -> Html:
    """Return the figures that follow the switches."""
    remaining = remaining_with(diagnosis, range(len(switches(diagnosis))))
    share = remaining.rms_after / max(remaining.rms, 1e-300)
    cells: tuple[tuple[str, str, str, Child], ...] = (
        ('Left then', 'now-rms', millimetres(remaining.rms_after), 'RMS, on data not used for fitting'),
        ('At the worst spot', 'now-max', millimetres(remaining.largest_after), joined([
            f'of {_counting(diagnosis)}', tag('span#now-verdict', data_before=': ')])),
        ('Of the gap', 'now-share', percent(share, int(share < _TENTH)), 'of its RMS is left'),
    )  # fmt: skip
    return tag(
        'dl.figures',
        *(
            tag('div', tag('dt', name), tag('dd', value, id_=key), tag('dd.note', note))
            for name, key, value, note in cells
        ),
    )


def _counting(diagnosis: Diagnosis) -> str:
    out, every = left_out(diagnosis)
    return f'the {every - out} samples that count' if out else 'all samples'


def _panels(diagnosis: Diagnosis, changes: bool) -> list[Html]:
    after = (
        'With what is ticked mended'
        if switches(diagnosis)
        else _after_words(diagnosis).capitalize()
    )
    sides = [('before', 'As it is', 'Seam coloured by deviation as it is')]
    if changes:
        sides.append(('after', after, 'Seam coloured by deviation with causes mended'))
    return [
        tag(
            'figure',
            tag('figcaption', title, ', deviation ', tag('span.times'), ' larger'),
            tag('canvas', data_side=side, tabindex='0', role='img', aria_label=label),
        )
        for side, title, label in sides
    ]


def _controls(stations: bool) -> Html:
    views = [
        tag('button', name.capitalize(), type='button', data_view=name)
        for name in ('angled', 'top', 'front', 'side')
    ]
    slider = tag(
        'label',
        'Deviation drawn ',
        tag('output#times.times'),
        ' larger ',
        tag('input#stretch', type='range', min='0', max='1', step='0.01'),
    )
    signs = '○ the instant looked at'
    return tag(
        'div.controls',
        tag('canvas#legend', role='img', aria_label='Colour scale'),
        tag('div.views', *views),
        slider,
        tag(
            'span.signs',
            signs
            if stations
            else f'▲ direction of travel (both ways where it goes to and fro)   {signs}',
        ),
    )


def _chart(diagnosis: Diagnosis, k: int) -> Html:
    index = drawn(diagnosis, k)
    if not index.size:
        return tag('p', 'No samples.')
    remaining, before = parted(diagnosis)[0][k], as_it_is(diagnosis, k)
    dots = static(diagnosis, k)
    lines = [Line('as it is', _size(before[index]), 'before', points=dots)]
    if switches(diagnosis) or diagnosis.model.found:
        lines.append(Line(_after_words(diagnosis), _size(remaining[index]), 'after', points=dots))
    floor = np.full(index.size, 1e3 * diagnosis.gap.noise_floor_m)
    lines.append(Line('measuring noise', floor, 'soft', dashed=True))
    axes = (Axis('station') if dots else Axis('time', 's'), Axis('deviation', 'mm'))
    recording = diagnosis.recordings[k] if k < len(diagnosis.recordings) else None
    title = recording.name if recording is not None else f'recording {k + 1}'
    title += _left_out(diagnosis, k)
    return chart(title, along(diagnosis, k)[index], lines, axes, key=f'run{k}', from_zero=True)


def _left_out(diagnosis: Diagnosis, k: int) -> str:
    """Return which samples of a recording are not drawn, for they would hide all the others."""
    out = np.flatnonzero(~trusted(diagnosis, k))
    if not out.size:
        return ''
    size = np.linalg.norm(diagnosis.traces.before[k], axis=1)
    worst = sorted(out[np.argsort(-size[out])][:_LISTED].tolist())
    places = [seen_at(diagnosis, k, sample, float(size[sample])) for sample in worst]
    if out.size > _LISTED:
        places.append(f'{out.size - _LISTED} more')
    return f' ({counted(out.size, "sample")} left out: {listed(places)})'


def _after_words(diagnosis: Diagnosis) -> str:
    """Return what the second line and picture show: what may be mended, or what only fits best."""
    named = diagnosis.effects or diagnosis.families or switches(diagnosis)
    return 'with that mended' if named else 'as far as what fits best leaves it'


def _size(deviation: np.ndarray) -> np.ndarray:
    return np.asarray(1e3 * np.linalg.norm(deviation, axis=1))
