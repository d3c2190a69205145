# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What was promised and what was measured after a correction: in lines, and as a page to keep."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from weld_twin_msgs_py.files.input_files import InputFile
from weld_twin_nodes.offline.verifying import Left, Promise, Verification
from weld_twin_nodes.wording.quantities import millimetres
from weld_twin_nodes.wording.words import called, cause, listed

from .charts import Axis, Line, chart
from .footing import inputs_section
from .html import Html, document, figures, main, section, table, tag

_STATES = {
    'gone': 'went away',
    'stays': 'did not go away',
    'partly': 'went away in part',
    'grew': 'is larger than before, or was corrected the wrong way round',
    'over': 'was corrected too far, or has changed since',
    'open': 'does not show in this recording',
}
_SCALE = 1.15
"""Width of the drawing in units of the largest figure in it."""


def headline(found: Verification) -> str:
    """Return in a sentence what was promised, what was measured, and whether that was kept."""
    what = f'along {found.program}' if found.program else 'of the mended robot'
    noise = ''
    if found.program:
        noise = (
            f' ({millimetres(found.measured.least)} at least), without the '
            f'{millimetres(found.measured.noise)} of measuring noise'
        )
    return (
        f'{"Kept" if found.kept else "Not kept"}: promised {what} {_promised(found.promised)}, '
        f'measured {millimetres(found.measured.rms)} RMS{noise} ({found.samples} measurements).'
    )


def told(found: Verification) -> list[str]:
    """Return the lines of the terminal: the headline, what is wrong, what became of each cause."""
    return [headline(found), *found.notes, *(_told(found, left) for left in found.causes)]


def _promised(promise: Promise) -> str:
    if promise.low is None or promise.high is None:
        return f'{millimetres(promise.rms)} RMS'
    return f'{millimetres(promise.rms)} RMS ({millimetres(promise.low)} to {millimetres(promise.high)})'


def _told(found: Verification, left: Left) -> str:
    moves = f'as it was it moves the tool by {millimetres(left.rms_m)} here'
    if left.state == 'open':
        return f'{_name(left)}: {_STATES["open"]}; {moves}'
    return f'{_name(left)}: {state(found, left)}, {_share(left)} of it is left; {moves}'


def state(found: Verification, left: Left) -> str:
    """Return what became of a cause; of a program it is what the correction left of it."""
    if found.program and left.state in ('gone', 'stays'):
        return 'is corrected' if left.state == 'gone' else 'is not corrected'
    return _STATES[left.state]


def _name(left: Left) -> str:
    if len(left.sites) == 1:
        return cause(left.sites[0].effect, left.sites[0].joint)
    kind = left.sites[0].effect
    return f'{called(kind)} of {listed([str(site.joint) for site in left.sites])}'


def _share(left: Left) -> str:
    return f'{100.0 * left.share:.0f} ± {100.0 * left.std:.0f} %'


def verification_page(found: Verification, robot: str, inputs: Sequence[InputFile] = ()) -> str:
    """
    Return the page: one HTML file that needs nothing else.

    Parameters
    ----------
    found : Verification
    robot : str
    inputs : sequence of InputFile

    """
    title = f'{found.program} · {robot}' if found.program else robot
    body = main(
        ('After the correction', ''),
        title,
        headline(found),
        _figures(found),
        *(tag('p', note, class_='warn') for note in found.notes),
        _causes(found),
        _drawn(found),
        inputs_section(inputs),
    )
    return document(f'After the correction · {title}', body, charts=True)


def _figures(found: Verification) -> Html:
    span = ''
    if found.promised.low is not None and found.promised.high is not None:
        span = f'{millimetres(found.promised.low)} to {millimetres(found.promised.high)}'
    noise = (
        f'{millimetres(found.measured.least)} at least; noise of '
        f'{millimetres(found.measured.noise)} taken out'
        if found.program
        else 'with its noise'
    )
    cells = (
        ('Promised', millimetres(found.promised.rms), span),
        ('Measured', millimetres(found.measured.rms), noise),
        ('Kept', 'yes' if found.kept else 'no', f'{found.samples} measurements'),
    )
    return figures(cells)


def _causes(found: Verification) -> Html | None:
    if not found.causes:
        return None
    rows = [
        (
            _name(left),
            state(found, left),
            '' if left.state == 'open' else _share(left),
            millimetres(left.rms_m),
        )
        for left in found.causes
    ]
    return section(
        'What became of the causes',
        table(('Cause', 'Now', 'Left of it', 'As it was it moves the tool by'), rows),
        id_='causes',
        lead='What is left was held against what each cause of the diagnosis does on this motion.',
    )


def _drawn(found: Verification) -> Html:
    """Return the drawing of every measurement beside what was promised."""
    at = np.arange(1.0, len(found.off) + 1.0)
    lines = [Line('measured', 1e3 * found.off, 'after', points=len(found.off) < 200)]
    level = found.promised.rms if found.promised.high is None else found.promised.high
    lines.append(Line('promised at most, RMS', np.full(at.size, 1e3 * level), 'bad', dashed=True))
    picture = chart(
        'How far the tool is off',
        at,
        lines,
        (Axis('measurement'), Axis('off by', 'mm')),
        key='after',
        from_zero=True,
    )
    return section('Measurement by measurement', picture, id_='drawn')
