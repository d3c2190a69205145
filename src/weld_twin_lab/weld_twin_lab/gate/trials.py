# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One trial of the gate: a mistake to be named, or a sound recording not to complain about."""

from __future__ import annotations

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

from ..blind.scoring import measured_of
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
        **sound.about,
        **verdict,
        **judged(kind, verdict),
    }


def judged(kind: str, verdict: Mapping[str, Any]) -> dict[str, bool]:
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
    about = {'number': number, 'way': way, **sound.about}
    return {**about, **verdict, 'right': not verdict['kinds']}


def looked(recording: Recording, robot: Robot, align: tuple[str, ...], way: str) -> dict[str, Any]:
    begin = time.perf_counter()
    with TemporaryDirectory() as folder:
        try:
            read = WAYS[way](recording, robot, Path(folder))
            examined = examine(Given((read,), robot, frozenset(align)))
        except DataError as error:
            none: dict[str, Any] = {'alike': [], 'dated': []}
            return {'kinds': ['refused'], **none, 'sentences': [str(error)], 'seconds': 0.0}
    unsound, slips = examined.unsound, examined.slips
    alike = [*(item.alike for item in unsound), *(slip.alike for slip in slips)]
    return {
        'kinds': sorted({item.kind for item in unsound}),
        'alike': sorted({kind for pairs in alike for kind, _ in pairs}),
        'dated': sorted({slip.kind for slip in slips}),
        'sentences': [
            *(item.sentence for item in unsound),
            *(slip.sentence(read) for slip in slips),
        ],
        'seconds': time.perf_counter() - begin,
    }


def as_bag(recording: Recording, robot: Robot, folder: Path) -> Recording:
    write_recording(folder / 'bag', recording, robot)
    return read_recording(folder / 'bag', robot, one_clock=False)


def as_table(recording: Recording, robot: Robot, folder: Path) -> Recording:
    """Return the stations of a recording after they were a table, read without any option."""
    seen = measured_of(recording)
    q = recording.joints.at(seen.t)[0]
    heads = [*robot.joint_names, 'x', 'y', 'z']
    rows = np.concatenate([q, seen.position], axis=1)
    if seen.rotation is not None:
        heads += ['qx', 'qy', 'qz', 'qw']
        rows = np.concatenate([rows, quaternion_from_matrix(seen.rotation)], axis=1)
    path = folder / 'table.csv'
    np.savetxt(path, rows, '%.9f', ',', header=','.join(heads), comments='')
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

    def counts(mine: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        return {'trials': len(mine), 'named': sum(bool(t['right']) for t in mine)}

    ways = sorted({t['way'] for t in trials})
    return {
        **counts(trials),
        'only_alike': sum(bool(t['only_alike']) for t in trials),
        **{way: counts([t for t in trials if t['way'] == way]) for way in ways},
    }


def table(content: Mapping[str, Any]) -> str:
    ways = sorted({w for counts in content['named'].values() for w in counts} - NUMBERS)
    rows = [
        (kind, *(_cell(own.get(way)) for way in ways), _cell(own), own['only_alike'] or '-')
        for kind, own in content['named'].items()
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
