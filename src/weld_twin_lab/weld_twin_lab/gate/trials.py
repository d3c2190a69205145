# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One trial of the gate: a mistake to be named, or a sound recording not to complain about."""

from __future__ import annotations

import csv
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import quaternion_from_matrix
from weld_twin_core.diagnosis.soundness.gate import examine
from weld_twin_core.diagnosis.soundness.mending import Given
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.bags import read_recording, write_recording
from weld_twin_msgs_py.tables import read_table

from .mistakes import KINDS, Hidden, Made
from .sound import Sound, draw

TRIES = 200
"""Draws of a sound recording until one is found that the mistake shows in."""


def mistake(seed: int, kind: str, way: str, number: int) -> dict[str, Any]:
    """
    Return whether the gate named a mistake of a kind, drawn by number, in a bag or a table.

    A mistake that only stands among those that are alike is not named, and counted apart.
    """
    drawn = [seed, list(KINDS).index(kind), list(WAYS).index(way), number]
    rng = np.random.default_rng(drawn)
    sound, (robot, recording, said) = _made(kind, way, rng)
    verdict = looked(recording, robot, sound.align, way)
    return {
        'kind': kind,
        'way': way,
        'number': number,
        'what': said,
        **_plain(sound),
        **verdict,
        **judged(kind, verdict),
    }


def judged(kind: str, verdict: Mapping[str, Any]) -> dict[str, bool]:
    """Return whether a mistake is named, and whether it only stands among those alike."""
    right = kind in (*verdict['kinds'], *verdict['dated'])
    return {'right': right, 'only_alike': not right and kind in verdict['alike']}


def _made(kind: str, way: str, rng: np.random.Generator) -> tuple[Sound, Made]:
    """Return a recording in which the mistake shows, and the same with it."""
    for _ in range(TRIES):
        sound = draw(rng, rich=True)
        if (way == 'table') != sound.recording.joints.static:
            continue
        with suppress(Hidden):
            return sound, KINDS[kind](sound, rng)
    raise DataError(f'no recording shows a mistake of kind {kind}')


def complaint(seed: int, number: int) -> dict[str, Any]:
    """Return whether the gate was silent about a sound recording, drawn by number."""
    rng = np.random.default_rng([seed, 1000, number])
    sound = draw(rng)
    static = sound.recording.joints.static
    way = 'table' if static and rng.random() < 0.5 else 'bag'
    verdict = looked(sound.recording, sound.robot, sound.align, way)
    return {
        'number': number,
        'way': way,
        **_plain(sound),
        **verdict,
        'right': not verdict['kinds'],
    }


def _plain(sound: Sound) -> dict[str, Any]:
    causes = sound.about['causes']
    assert isinstance(causes, list)
    return {**sound.about, 'align': list(sound.align), 'causes': [dict(c) for c in causes]}


def looked(recording: Recording, robot: Robot, align: tuple[str, ...], way: str) -> dict[str, Any]:
    """Return what the gate says of a recording after it was a bag or a table."""
    begin = time.perf_counter()
    with TemporaryDirectory() as folder:
        try:
            read = WAYS[way](recording, robot, Path(folder))
            examined = examine(Given((read,), robot, frozenset(align)))
        except DataError as error:
            return {
                'kinds': ['refused'],
                'alike': [],
                'dated': [],
                'sentences': [str(error)],
                'seconds': 0.0,
            }
    alike = [pair for item in examined.unsound for pair in item.alike]
    alike += [pair for slip in examined.slips for pair in slip.alike]
    return {
        'kinds': sorted({item.kind for item in examined.unsound}),
        'alike': sorted({kind for kind, _ in alike}),
        'dated': sorted({slip.kind for slip in examined.slips}),
        'sentences': [
            *(item.sentence for item in examined.unsound),
            *(slip.sentence(read) for slip in examined.slips),
        ],
        'seconds': time.perf_counter() - begin,
    }


def as_bag(recording: Recording, robot: Robot, folder: Path) -> Recording:
    """Return the recording after it was a bag in the folder."""
    write_recording(folder / 'bag', recording, robot)
    return read_recording(folder / 'bag', robot, one_clock=False)


def as_table(recording: Recording, robot: Robot, folder: Path) -> Recording:
    """Return the stations of a recording after they were a table, read without any option."""
    seen = recording.measured
    assert seen is not None
    q = recording.joints.at(seen.t)[0]
    heads = [*robot.joint_names, 'x', 'y', 'z']
    rows = np.concatenate([q, seen.position], axis=1)
    if seen.rotation is not None:
        heads += ['qx', 'qy', 'qz', 'qw']
        rows = np.concatenate([rows, quaternion_from_matrix(seen.rotation)], axis=1)
    path = folder / 'table.csv'
    with path.open('w', newline='', encoding='utf-8') as file:
        writer = csv.writer(file)
        writer.writerow(heads)
        writer.writerows([f'{value:.9f}' for value in row] for row in rows)
    return read_table(path, robot).recording


WAYS = {'bag': as_bag, 'table': as_table}
"""How a recording is written and read again, as a user has it."""
