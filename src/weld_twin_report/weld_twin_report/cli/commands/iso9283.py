# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Pose and path accuracy and repeatability by ISO 9283, of a robot placed where it was measured."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from rich.console import Console
from rich.table import Table

from weld_twin_core import __version__
from weld_twin_core.arm.robot import Robot
from weld_twin_core.diagnosis.algebra.problem import frames_named
from weld_twin_core.diagnosis.frames.aligned import frames_only
from weld_twin_core.errors import DataError
from weld_twin_core.metrics.performance import (
    Performance,
    measured_of,
    performance_of,
    pose_cycles,
    stops,
)
from weld_twin_core.recording import Recording
from weld_twin_nodes.cli.given import Given, inputs_of, refuse_changed

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


NUMBERS = 6
"""Of one frame."""
WANTED = 3
"""
Coordinates measured at different poses, over numbers fitted. A fit takes its share of the squared
error away: of three coordinates a number, one in three, so that accuracy looks 18 % better.
"""
ROWS = 4000
"""Measurements that frames are fitted on at most; twelve numbers need no more."""


def placed(recording: Recording, robot: Robot, align: frozenset[str]) -> tuple[Robot, list[str]]:
    """Return the robot in the frame of the measurements, and sentences that say how."""
    if not align:
        return robot, ['base and tool are where the robot file has them; nothing was fitted']
    names = ' and '.join(sorted(align))
    numbers, measured = NUMBERS * len(align), measured_of(recording)
    each = 3 if measured.rotation is None else 6
    result = stops(recording)
    seen = len(pose_cycles(result, robot)) if recording.joints.static else measured.t.size
    if each * seen < WANTED * numbers:
        raise DataError(
            f'{names} cannot be fitted on {seen} different pose{"s"[: seen > 1]}: the fit takes '
            f'{numbers} of {each * seen} measured coordinates; measure the frames and put them '
            'into the robot file, or measure more poses'
        )
    some = np.unique(np.linspace(0, measured.t.size - 1, ROWS).round().astype(int))
    model = frames_only(recording.with_measured(measured.take(some)), robot, align)
    say = (
        f'{names} {"were" if len(align) > 1 else "was"} fitted to this recording, {numbers} '
        f'numbers on {seen} poses, so that the accuracy is what is left after the best fit; the '
        'standard has the frames measured beforehand'
    )
    return replace(model.robot, T_world_base=model.bases[0]), [say]
