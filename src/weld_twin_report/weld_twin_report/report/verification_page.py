# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What was promised and what was measured after a correction: in lines, and as a page to keep."""

from collections.abc import Callable, Sequence

import numpy as np

from weld_twin_msgs_py.files.input_files import InputFile
from weld_twin_nodes.offline.verifying import Promise, RemainingCause, Verification
from weld_twin_nodes.wording.quantities import millimetres
from weld_twin_nodes.wording.words import called, cause, listed

from .charts import Axis, Line, chart
from .footing import inputs_section
from .html import Html, columns, document, figures, main, section, tag

_STATES = {
    'gone': 'went away',
    'stays': 'did not go away',
    'partly': 'went away in part',
    'grew': 'is larger than before, or was corrected the wrong way round',
    'over': 'was corrected too far, or has changed since',
    'open': 'does not show in this recording',
}


def headline(result: Verification) -> str:
    """Return in a sentence what was promised, what was measured, and whether that was kept."""
    what = f'along {result.program}' if result.program else 'of the mended robot'
    noise = ''
    if result.program:
        noise = (
            f' ({millimetres(result.measured.least)} at least), without the '
            f'{millimetres(result.measured.noise)} of measuring noise'
        )
    return (
        f'{"Kept" if result.kept else "Not kept"}: promised {what} {_promised(result.promised)}, '
        f'measured {millimetres(result.measured.rms)} RMS{noise} ({result.samples} measurements).'
    )


def result_lines(result: Verification) -> list[str]:
    """Return the lines of the terminal: the headline, what is wrong, what became of each cause."""
    return [
        headline(result),
        *result.notes,
        *(_of_cause(result, remaining) for remaining in result.causes),
    ]


def _promised(promise: Promise) -> str:
    if promise.low is None or promise.high is None:
        return f'{millimetres(promise.rms)} RMS'
    return f'{millimetres(promise.rms)} RMS ({millimetres(promise.low)} to {millimetres(promise.high)})'


def _of_cause(result: Verification, remaining: RemainingCause) -> str:
    moves = f'as it was it moves the tool by {millimetres(remaining.rms_m)} here'
    if remaining.state == 'open':
        return f'{_name(remaining)}: {_STATES["open"]}; {moves}'
    return f'{_name(remaining)}: {state(result, remaining)}, {_share(remaining)} of it is left; {moves}'


def state(result: Verification, remaining: RemainingCause) -> str:
    """Return what became of a cause; of a program it is what the correction left of it."""
    if result.program and remaining.state in ('gone', 'stays'):
        return 'is corrected' if remaining.state == 'gone' else 'is not corrected'
    return _STATES[remaining.state]


def _name(remaining: RemainingCause) -> str:
    if len(remaining.sites) == 1:
        return cause(remaining.sites[0].effect, remaining.sites[0].joint)
    kind = remaining.sites[0].effect
    return f'{called(kind)} of {listed([str(site.joint) for site in remaining.sites])}'


def _share(remaining: RemainingCause) -> str:
    return f'{100.0 * remaining.share:.0f} ± {100.0 * remaining.std:.0f} %'


def verification_page(result: Verification, robot: str, inputs: Sequence[InputFile] = ()) -> str:
    """Return the page: one HTML file that needs nothing else."""
    title = f'{result.program} · {robot}' if result.program else robot
    body = main(
        ('After the correction', ''),
        title,
        headline(result),
        _figures(result),
        *(tag('p.warn', note) for note in result.notes),
        _causes(result),
        _drawn(result),
        inputs_section(inputs),
    )
    return document(f'After the correction · {title}', body, charts=True)


def _figures(result: Verification) -> Html:
    span = ''
    if result.promised.low is not None and result.promised.high is not None:
        span = f'{millimetres(result.promised.low)} to {millimetres(result.promised.high)}'
    noise = (
        f'{millimetres(result.measured.least)} at least; noise of '
        f'{millimetres(result.measured.noise)} taken out'
        if result.program
        else 'with its noise'
    )
    cells = (
        ('Promised', millimetres(result.promised.rms), span),
        ('Measured', millimetres(result.measured.rms), noise),
        ('Kept', 'yes' if result.kept else 'no', f'{result.samples} measurements'),
    )
    return figures(cells)


def _causes(result: Verification) -> Html | None:
    if not result.causes:
        return None
    shown: dict[str, Callable[[RemainingCause], str]] = {
        'Cause': _name,
        'Now': lambda cause: state(result, cause),
        'Left of it': lambda cause: '' if cause.state == 'open' else _share(cause),
        'As it was it moves the tool by': lambda cause: millimetres(cause.rms_m),
    }
    lead = 'What is left was held against what each cause of the diagnosis does on this motion.'
    causes = columns(result.causes, shown)
    return section('What became of the causes', causes, id_='causes', lead=lead)


def _drawn(result: Verification) -> Html:
    """Return the drawing of every measurement beside what was promised."""
    at = np.arange(1.0, len(result.off) + 1.0)
    lines = [Line('measured', 1e3 * result.off, 'after', points=len(result.off) < 200)]
    level = result.promised.rms if result.promised.high is None else result.promised.high
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
