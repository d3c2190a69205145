# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Pose and path accuracy and repeatability by ISO 9283.

Finds the poses that the arm stopped at twice or more, and the path that it went twice or more.
Writes iso9283.json and a page to read (report.html) to the directory.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from weld_twin_nodes.cli.options import (
    ALIGN,
    ROBOT,
    TOPICS,
    folder_output,
    inputs_of,
    output,
    robot_of,
    topics_of,
)

if TYPE_CHECKING:
    from rich.console import Console

    from weld_twin_core.metrics.performance import Performance

EXAMPLE = 'weld-twin iso9283 my_cycles --robot ur5 --out accuracy'
SCHEMA = 'weld_twin/iso9283/1'
RESULT, PAGE = 'iso9283.json', 'report.html'
WIDTH = 100
"""Columns of the table, whatever the terminal has."""
FAR = 0.1
"""Accuracy [m] from which two frames are mixed up rather than an arm inaccurate."""


OPTIONS = (
    'BAG                      recording of the cell',
    ROBOT,
    ALIGN,
    folder_output('directory for the results'),
    TOPICS,
)


def run(args: argparse.Namespace) -> int:
    """Find the cycles, evaluate them, write the results, print a table."""
    from rich.console import Console

    from weld_twin_core import __version__
    from weld_twin_core.diagnosis.algebra.problem import frames_named
    from weld_twin_core.metrics.performance import performance_of
    from weld_twin_msgs_py.bags import read_recording
    from weld_twin_msgs_py.files.whole_files import write_json, write_text
    from weld_twin_nodes.offline.placed_robot import placed

    from ...report.performance_page import performance_page

    nominal = robot_of(args)
    align = frames_named(args.align, '--align')
    recording = read_recording(args.bag, nominal, topics_of(args))
    robot, notes = placed(recording, nominal, align)
    result = performance_of(recording, robot)
    notes += _warnings(result, align)
    with output(args, RESULT) as place:
        inputs = inputs_of(recording=args.bag, robot=args.robot)
        page = performance_page(result, recording, robot.name, notes, inputs)
        write_text(place / PAGE, page)
        content = {
            'schema': SCHEMA,
            'version': __version__,
            'robot': robot.name,
            'recording': recording.name,
            'align': args.align,
            **result.as_dict(),
            'notes': [*notes, *recording.notes],
            'inputs': [item.as_dict() for item in inputs],
        }
        write_json(place / RESULT, content)
    _print(result, notes, Console(width=WIDTH, highlight=False, markup=False))
    print(f'report: {Path(args.out) / PAGE}')
    return 0


def _warnings(result: Performance, align: frozenset[str]) -> list[str]:
    """Return a sentence where the measuring frame cannot be that of the robot."""
    sizes = [pose.performance.ap_m for pose in result.poses]
    sizes += [] if result.path is None else [result.path.performance.at_m]
    if max(sizes) < FAR or len(align) == 2:
        return []
    return [
        f'measurements and commands are {max(sizes):.2f} m apart, so the measuring frame is '
        'hardly that of the robot; --align base or base,tool fits it'
    ]


def _print(result: Performance, notes: Sequence[str], console: Console) -> None:
    from rich.table import Table

    from ...report.performance_page import PATH_HEADS, POSE_HEADS, path_row, pose_rows, sentence

    console.print(sentence(result))
    paths = [] if result.path is None else [path_row(result.path)]
    for heads, rows in ((POSE_HEADS, pose_rows(result)), (PATH_HEADS, paths)):
        if rows:
            table = Table(box=None, pad_edge=False)
            for head in heads:
                table.add_column(head, header_style='dim')
            for row in rows:
                table.add_row(*row)
            console.print(table)
    for text in result.lacking:
        console.print(f'lacking: {text}')
    for text in notes:
        console.print(f'note: {text}')
