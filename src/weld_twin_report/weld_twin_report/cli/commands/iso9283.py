# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Pose and path accuracy and repeatability by ISO 9283."""

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from weld_twin_core import __version__
from weld_twin_core.diagnosis.algebra.problem import frames_named
from weld_twin_core.metrics.performance import Performance, performance_of
from weld_twin_nodes.cli.given import Given, inputs_of, refuse_changed
from weld_twin_nodes.offline.placed_robot import placed

from ...report import performance_page as words

SCHEMA = 'weld_twin/iso9283/1'
RESULT = 'iso9283.json'
WIDTH = 100
"""Columns of the table, whatever the terminal has."""
FAR = 0.1
"""Accuracy [m] from which two frames are mixed up rather than an arm inaccurate."""


def run(given: Given) -> int:
    """Find the cycles, evaluate them, write the results, print a table."""
    inputs = inputs_of(recording=given.bag, robot=given.robot)
    nominal = given.load_robot()
    align = frames_named(given.align, '--align')
    recording = given.read_bag(given.bag, nominal)
    robot, notes = placed(recording, nominal, align)
    result = performance_of(recording, robot)
    notes += _warnings(result, align)
    refuse_changed(inputs)
    content = {
        'schema': SCHEMA,
        'version': __version__,
        'robot': robot.name,
        'recording': recording.name,
        'align': given.align,
        **result.as_dict(),
        'notes': [*notes, *recording.notes],
        'inputs': [item.as_dict() for item in inputs],
    }
    page = words.performance_page(result, recording, robot.name, notes, inputs)
    given.write_results(RESULT, page, content)
    _print(result, notes, Console(width=WIDTH, highlight=False, markup=False))
    given.say_page()
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
    console.print(words.sentence(result))
    paths = [] if result.path is None else [words.path_row(result.path)]
    poses = words.pose_rows(result)
    for heads, rows in ((words.POSE_HEADS, poses), (words.PATH_HEADS, paths)):
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
