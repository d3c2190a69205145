# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One trial of the gate: a mistake to be named, or a sound recording not to complain about."""

from __future__ import annotations

import csv
import time
from collections.abc import Mapping, Sequence
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
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.tables import read_table
from weld_twin_nodes.offline.task_pool import Task

from ..study import Study, listed, require_simulator
from .mistakes import KINDS, MOVING_ONLY, Hidden, Made, Sound, draw

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


GOAL_NAMED = 0.95
"""Least share of the mistakes of every kind that must be named."""


HEADS = ('named first', 'only among the alike')
NUMBERS = frozenset({'trials', 'named', 'only_alike'})


def result(trials: Sequence[Mapping[str, Any]], seed: int) -> dict[str, Any]:
    """
    Return shares named by kind, complaints, what went wrong, and whether the goals are met.

    What stands only among the alike of another mistake is counted beside, and not as named.

    trials: those without a ``kind`` are of sound recordings.
    """
    mistakes = [t for t in trials if 'kind' in t]
    sound = [t for t in trials if 'kind' not in t]
    tried = {t['kind'] for t in mistakes}
    named = {k: _share([m for m in mistakes if m['kind'] == k]) for k in KINDS if k in tried}
    complaints = [s for s in sound if not s['right']]
    goals = [n['named'] >= GOAL_NAMED * n['trials'] for n in named.values()]
    return {
        'seed': seed,
        'named': named,
        'sound': {'trials': len(sound), 'complaints': len(complaints)},
        'missed': [dict(m) for m in mistakes if not m['right']],
        'complaints': [dict(s) for s in complaints],
        'passed': all(goals) and not complaints,
    }


def _share(trials: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    out: dict[str, Any] = {
        'trials': len(trials),
        'named': sum(bool(t['right']) for t in trials),
        'only_alike': sum(bool(t['only_alike']) for t in trials),
    }
    for way in sorted({str(t['way']) for t in trials}):
        mine = [t for t in trials if t['way'] == way]
        out[way] = {'trials': len(mine), 'named': sum(bool(t['right']) for t in mine)}
    return out


def table(content: Mapping[str, Any]) -> str:
    ways = sorted({w for counts in content['named'].values() for w in counts} - NUMBERS)
    rows = [
        [
            kind,
            *(_cell(counts.get(way)) for way in ways),
            _cell(counts),
            counts['only_alike'] or '-',
        ]
        for kind, counts in content['named'].items()
    ]
    sound = content['sound']
    made = markdown.table(('mistake', *ways, *HEADS), *rows)
    return f'{made}\nsound recordings: {sound["complaints"]} complaints on {sound["trials"]}\n'


def page(content: Mapping[str, Any]) -> str:
    out = [
        '# The gate, measured',
        '[What is found and how](../../unsound.md). Every kind of mistake was made in recordings '
        'that a simulator drew, then written as a bag or as a table and read again. Sound ones '
        'have causes of all families, big ones among them, on rich and poor motions.',
        table(content),
    ]
    if missed := content['missed']:
        rows = [
            [m['kind'], m['way'], m['what'], ', '.join((*m['kinds'], *m['dated'])) or 'nothing']
            for m in missed
        ]
        out += ['## Missed', markdown.table(('mistake', 'in', 'what was done', 'named'), *rows)]
    return '\n\n'.join(part.rstrip() for part in out) + '\n'


def _cell(counts: Mapping[str, Any] | None) -> str:
    return '-' if not counts else f'{counts["named"]} of {counts["trials"]}'


def run(study: Study) -> bool:
    require_simulator()
    args = study.args
    kinds = listed(args.kinds) or list(KINDS)
    for kind in kinds:
        if kind not in KINDS:
            raise DataError(f'there is no mistake {kind!r}; there are ' + ', '.join(KINDS))
    tasks = [
        Task(mistake, (args.seed, kind, way, number), f'{kind} {way}')
        for kind in kinds
        for way in WAYS
        for number in range(args.draws)
        if not (way == 'table' and kind in MOVING_ONLY)
    ]
    tasks += [Task(complaint, (args.seed, n), 'sound') for n in range(args.sound)]
    content = result(study.tasks(tasks, 'trying the gate'), args.seed)
    study.write('gate', content, page(content))
    passed = bool(content['passed'])
    print(f'\ngate: {"passed" if passed else "FAILED"}, {study.out / "gate.json"}')
    return passed
