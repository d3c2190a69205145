# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""An ISO 9283 evaluation: its rows of text, for page and terminal, and its page."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from weld_twin_core.metrics.performance import PathTest, Performance, PoseTest
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.files.input_files import InputFile
from weld_twin_nodes.wording.quantities import MISSING, millimetres, turned

from .answer import recorded_at
from .charts import Axis, Line, chart
from .footing import inputs_section
from .html import Figure, Html, document, figures, main, pairs, said_section, section, table


def performance_page(
    result: Performance,
    recording: Recording,
    robot: str,
    notes: Sequence[str],
    inputs: Sequence[InputFile] = (),
) -> str:
    """Return the page; notes say how the frames were had."""
    subject = [robot, recording.name, recorded_at([recording])]
    body = main(
        ('Positional accuracy ', 'ISO 9283'),
        ' · '.join(part for part in subject if part),
        sentence(result),
        _figures(result),
        _poses(result),
        None if result.path is None else _path(result.path),
        said_section('What the standard asks for beyond this', result.lacking, 'lacking'),
        said_section('How it was measured', [*notes, *recording.notes], 'notes'),
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
        [Line('accuracy', 1e3 * path.at, 'before'), Line('repeatability', 1e3 * path.rt, 'after')],
        (Axis('along the path', 'm'), Axis('distance', 'mm')),
        from_zero=True,
    )
    return section(
        'The path',
        picture,
        id_='path',
        lead='At every point of the path, in the plane square to it. AT and RT are the largest.',
    )


POSE_HEADS = (
    *('pose', 'at [mm]', 'cycles', 'AP [mm]', 'RP [mm]', 'AP [° (mrad)]', 'RP [° (mrad)]'),
    *('vAP [mm]', 'drift [mm]'),
)
PATH_HEADS = ('path', 'cycles', 'AT', 'RT', 'cycle takes')
MEANINGS = (
    ('AP', 'pose accuracy: from the commanded position to the middle of those reached'),
    ('RP', 'pose repeatability: mean distance from that middle plus three standard deviations'),
    (
        'vAP',
        'variation of pose accuracy: how far apart the middles are by where the arm came from',
    ),
    ('drift', 'largest change of AP and of RP from one ten cycles to another'),
    ('AT', 'path accuracy: largest distance of the mean path from the commanded one'),
    ('RT', 'path repeatability: as RP, at the point of the path where it is largest'),
)
"""What each criterion is, in words; `weld_twin_core.metrics.iso9283` has the clauses."""


def pose_rows(result: Performance) -> list[tuple[str, ...]]:
    """Return a row for each pose, as `POSE_HEADS` has it."""
    return [_pose_row(f'P{k}', pose) for k, pose in enumerate(result.poses, 1)]


def _pose_row(name: str, pose: PoseTest) -> tuple[str, ...]:
    f = pose.performance
    where = ', '.join(f'{1e3 * value:.0f}' for value in pose.command)
    turns = (
        None if turn is None else float(np.linalg.norm(turn)) for turn in (f.ap_rad, f.rp_rad)
    )
    drifted = MISSING
    if pose.drift is not None:
        drifted = f'{_thousandth(pose.drift.dap_m)} / {_thousandth(pose.drift.drp_m)}'
    return (
        name,
        where,
        str(f.cycles),
        *map(_thousandth, (f.ap_m, f.rp_m)),
        *(MISSING if turn is None else f'{turned(turn)} ({1e3 * turn:.3f})' for turn in turns),
        _thousandth(pose.variation_m),
        drifted,
    )


def _thousandth(value: Any) -> str:
    """Return metres in mm, without the unit, which the head has."""
    return MISSING if value is None else f'{1e3 * value:.3f}'


def path_row(path: PathTest) -> tuple[str, ...]:
    """Return the row of a path, as `PATH_HEADS` has it."""
    f = path.performance
    length = f'{path.arc[-1]:.2f} m long'
    return length, str(f.cycles), millimetres(f.at_m), millimetres(f.rt_m), f'{path.seconds:.1f} s'


def sentence(result: Performance) -> str:
    """Return the answer in one or two short sentences."""
    parts = []
    if result.poses:
        ap = max(pose.performance.ap_m for pose in result.poses)
        rp = max(pose.performance.rp_m for pose in result.poses)
        parts.append(_short('Poses', ap, rp))
    if result.path is not None:
        parts.append(_short('Path', result.path.performance.at_m, result.path.performance.rt_m))
    return ' '.join(parts)


def _short(what: str, accuracy: float, repeatability: float) -> str:
    return (
        f'{what}: {millimetres(accuracy)} from the command, repeated within '
        f'{millimetres(repeatability)}.'
    )
