# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One page per arm."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence

from weld_twin_core import __version__
from weld_twin_nodes.wording.quantities import millimetres, milliradians, percent
from weld_twin_report.report.answer import Answer
from weld_twin_report.report.cause_list import causes_section
from weld_twin_report.report.footing import checks_section
from weld_twin_report.report.gap_location import where_section
from weld_twin_report.report.html import Child, Html, document, section, table, tag
from weld_twin_report.report.opening import opening
from weld_twin_report.report.shrinking import shrink_section

from .data import Source
from .figures import ripple_over_range, ripple_spectrum, workspace
from .judged_split import Judged
from .owner_advice import blind_spots, owner_advice

_STYLE = 'figure { margin: 0 0 1.5rem; } figure img { width: 100%; background: #fff; }'
_HEADS = (
    'Fitted on; judged on',
    'Frames only: mean / max',
    'Got: mean / max',
    'RMS',
    'Orientation',
    'Goal',
    'Left: claimed (95 %) / got',
)


def robot_page(robot: str, sources: Sequence[Source], judged: Sequence[Judged]) -> str:
    """
    Return the page of one arm.

    Parameters
    ----------
    robot : str
    sources : sequence of Source
    judged : sequence of Judged
        The last is drawn in full.

    """
    main = judged[-1]
    diagnosis, answer = main.diagnosis, Answer(main.diagnosis)
    body = tag(
        'main',
        tag('header', tag('p', f'{robot.upper()} under a laser tracker', class_='kind')),
        opening(answer),
        _held_out(judged),
        _advice(main),
        _maps(main),
        where_section(answer),
        causes_section(answer),
        _ripple(main),
        _blind(main),
        shrink_section(diagnosis),
        checks_section(diagnosis),
        _recipe(sources),
    )
    title = f'{robot.upper()}: positional accuracy'
    return document(title, body, allowed='img-src data:', style=_STYLE)


def _held_out(judged: Sequence[Judged]) -> Html:
    rows = [_row(each) for each in judged]
    return section(
        'On poses never used for fitting',
        table(_HEADS, rows),
        id_='held-out',
        lead='Base and tool stay as fitted on the training poses. Left is RMS over RMS with only '
        'the frames fitted; claimed is what the diagnosis says of itself from stretches of its '
        'training poses.',
    )


def _row(judged: Judged) -> list[Child]:
    before, after, goal = judged.before, judged.after, judged.split.goal
    wanted = [f'mean {millimetres(goal.mean_m)}']
    if goal.max_m is not None:
        wanted.append(f'max {millimetres(goal.max_m)}')
    if goal.orientation_rad is not None:
        wanted.append(milliradians(goal.orientation_rad))
    low, high = judged.diagnosis.shrink.ci95
    return [
        judged.split.title,
        f'{millimetres(before.mean_m)} / {millimetres(before.max_m)}',
        f'{millimetres(after.mean_m)} / {millimetres(after.max_m)}',
        millimetres(after.rms_m),
        milliradians(after.orientation_rms_rad),
        ', '.join(wanted) + (': reached' if judged.reached else ': missed'),
        f'{100 * low:.1f} to {100 * high:.1f} % / {100 * after.rms_m / before.rms_m:.1f} %'
        + ('' if judged.within else ', outside'),
    ]


def _advice(judged: Judged) -> Html:
    items = [tag('li', text) for text in owner_advice(judged.diagnosis)]
    return section(
        'What an owner of this arm should do', tag('ul', *items, class_='sentences'), id_='owner'
    )


def _blind(judged: Judged) -> Html:
    items = [tag('li', text) for text in blind_spots(judged.diagnosis)]
    return section('What cannot be told apart', tag('ul', *items, class_='sentences'), id_='blind')


def _maps(judged: Judged) -> Html:
    measured = judged.split.test.measured
    assert measured is not None
    picture = workspace(measured.position, judged.before_parts[:3], judged.after_parts[:3])
    share = percent(judged.after.rms_m / judged.before.rms_m)
    return section(
        'The held-out poses from above',
        _figure(picture, f'{share} of the RMS error is left.'),
        id_='maps',
        lead='The colour scales of the two maps differ.',
    )


def _ripple(judged: Judged) -> Html:
    diagnosis = judged.diagnosis
    return section(
        'Ripple of the gears',
        _figure(
            ripple_over_range(diagnosis),
            'What each gear does to its joint over the range '
            'that was moved, offset and slope taken off.',
        ),
        _figure(
            ripple_spectrum(diagnosis),
            'The same by order. Dense to order 100; above, only '
            'lines that stand out by themselves.',
        ),
        id_='ripple',
    )


def _figure(svg: str, caption: str) -> Html:
    data = b64encode(svg.encode()).decode()
    picture = tag('img', src=f'data:image/svg+xml;base64,{data}', alt=caption)
    return tag('figure', picture, tag('figcaption', caption))


def _recipe(sources: Sequence[Source]) -> Html:
    items = [
        tag('li', tag('b', source.path.name), ': ', '; '.join(source.assumptions))
        for source in sources
    ]
    return section(
        'How the tables were read',
        tag('ul', *items, class_='sentences'),
        tag('p', f'weld_twin {__version__}', class_='note'),
        id_='recipe',
    )
