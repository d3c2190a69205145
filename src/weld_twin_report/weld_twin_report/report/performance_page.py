# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of an ISO 9283 evaluation: one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Sequence

from weld_twin_core.metrics.performance import PathTest, Performance
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.files.input_files import InputFile
from weld_twin_nodes.wording.quantities import millimetres

from .charts import Axis, Line, chart
from .footing import inputs_section
from .headline import recorded_at
from .html import Html, document, section, table, tag
from .performance_table import MEANINGS, POSE_HEADS, path_row, pose_rows, sentence


def performance_page(
    found: Performance,
    recording: Recording,
    robot: str,
    notes: Sequence[str],
    inputs: Sequence[InputFile] = (),
) -> str:
    """
    Return the page.

    Parameters
    ----------
    found : Performance
    recording : Recording
    robot : str
        Its name.
    notes : sequence of str
        How the frames were had, and what else a reader must know.
    inputs : sequence of InputFile

    """
    subject = [robot, recording.name, recorded_at([recording])]
    body = tag(
        'main',
        tag(
            'header',
            tag('p', 'Positional accuracy ', tag('b', 'ISO 9283'), class_='kind'),
            tag('p', ' · '.join(part for part in subject if part), class_='subject'),
        ),
        tag('section', tag('h1', sentence(found)), _figures(found), id_='verdict'),
        _poses(found),
        None if found.path is None else _path(found.path),
        _told('What the standard asks for beyond this', found.lacking, 'lacking'),
        _told('How it was measured', [*notes, *recording.notes], 'notes'),
        _meanings(),
        inputs_section(inputs),
    )
    return document(f'ISO 9283 · {robot} · {recording.name}', body, charts=True)


def _figures(found: Performance) -> Html:
    poses = [pose.performance for pose in found.poses]
    cells = []
    if poses:
        count = f'{len(poses)} pose{"s"[: len(poses) > 1]}'
        cells += [
            ('AP', millimetres(max(p.ap_m for p in poses)), f'the worst of {count}'),
            ('RP', millimetres(max(p.rp_m for p in poses)), f'the worst of {count}'),
        ]
    if found.path is not None:
        f = found.path.performance
        of = f'of {f.cycles} cycles of the path'
        cells += [('AT', millimetres(f.at_m), of), ('RT', millimetres(f.rt_m), of)]
    return tag(
        'dl',
        *(
            tag('div', tag('dt', name), tag('dd', value), tag('dd', note, class_='note'))
            for name, value, note in cells
        ),
        class_='figures',
    )


def _poses(found: Performance) -> Html | None:
    if not found.poses:
        return None
    return section(
        'Poses',
        table(POSE_HEADS, pose_rows(found)),
        id_='poses',
        lead='Each row is one commanded pose that was measured more than once.',
    )


def _path(path: PathTest) -> Html:
    length, cycles, *_, takes = path_row(path)
    picture = chart(
        f'{length}, {cycles} cycles of {takes}',
        path.arc,
        [
            Line('accuracy', 1e3 * path.at, 'before'),
            Line('repeatability', 1e3 * path.rt, 'after'),
        ],
        (Axis('along the path', 'm'), Axis('distance', 'mm')),
        from_zero=True,
    )
    return section(
        'The path',
        picture,
        id_='path',
        lead='At every point of the path, in the plane square to it. AT and RT are the largest.',
    )


def _told(title: str, sentences: Sequence[str], name: str) -> Html | None:
    if not sentences:
        return None
    items = [tag('li', f'{text[:1].upper()}{text[1:]}.') for text in sentences]
    return section(title, tag('ul', *items, class_='sentences'), id_=name)


def _meanings() -> Html:
    pairs = [part for name, text in MEANINGS for part in (tag('dt', name), tag('dd', text))]
    return section('What the letters mean', tag('dl', *pairs, class_='pairs'), id_='meanings')
