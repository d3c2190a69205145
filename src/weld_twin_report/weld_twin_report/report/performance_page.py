# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of an ISO 9283 evaluation: one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Sequence

from weld_twin_core.metrics.performance import PathTest, Performance
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.files.input_files import InputFile
from weld_twin_nodes.wording.quantities import millimetres

from .answer import recorded_at
from .charts import Axis, Line, chart
from .footing import inputs_section
from .html import Figure, Html, document, figures, main, pairs, section, sentences, table
from .performance_table import MEANINGS, POSE_HEADS, path_row, pose_rows, sentence


def performance_page(
    result: Performance,
    recording: Recording,
    robot: str,
    notes: Sequence[str],
    inputs: Sequence[InputFile] = (),
) -> str:
    """
    Return the page.

    Parameters
    ----------
    robot : str
        Its name.
    notes : sequence of str
        How the frames were had, and what else a reader must know.

    """
    subject = [robot, recording.name, recorded_at([recording])]
    body = main(
        ('Positional accuracy ', 'ISO 9283'),
        ' · '.join(part for part in subject if part),
        sentence(result),
        _figures(result),
        _poses(result),
        None if result.path is None else _path(result.path),
        _told('What the standard asks for beyond this', result.lacking, 'lacking'),
        _told('How it was measured', [*notes, *recording.notes], 'notes'),
        section('What the letters mean', pairs(MEANINGS), id_='meanings'),
        inputs_section(inputs),
    )
    return document(f'ISO 9283 · {robot} · {recording.name}', body, charts=True)


def _figures(result: Performance) -> Html:
    poses = [pose.performance for pose in result.poses]
    cells: list[Figure] = []
    if poses:
        count = f'{len(poses)} pose{"s"[: len(poses) > 1]}'
        cells += [
            ('AP', millimetres(max(p.ap_m for p in poses)), f'the worst of {count}'),
            ('RP', millimetres(max(p.rp_m for p in poses)), f'the worst of {count}'),
        ]
    if result.path is not None:
        f = result.path.performance
        of = f'of {f.cycles} cycles of the path'
        cells += [('AT', millimetres(f.at_m), of), ('RT', millimetres(f.rt_m), of)]
    return figures(cells)


def _poses(result: Performance) -> Html | None:
    if not result.poses:
        return None
    return section(
        'Poses',
        table(POSE_HEADS, pose_rows(result)),
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


def _told(title: str, texts: Sequence[str], name: str) -> Html | None:
    if not texts:
        return None
    return section(title, sentences(f'{t[:1].upper()}{t[1:]}.' for t in texts), id_=name)
