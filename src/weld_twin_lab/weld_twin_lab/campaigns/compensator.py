# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Send drawn goals through a compensator in a cell, and change the cell under it.

A diagnosis learns each of six arms with sure causes. Goals run as they are and through the compensator.
Then a clock jumps, the load changes, the model is a wrong one, the tracker is lost. A stream of
poses races a relay that copies them.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files import markdown

from .compensating import NOTHING
from .latency import pose_table

if TYPE_CHECKING:
    from .compensating.trial import Known

WORSE = (2e-5, 0.05)
"""A goal is worse if it is farther off than before by more than this [m], and by this share."""
WORTH = 0.5
"""Share of its error that a goal must be able to gain to count among those to be corrected."""
CORRECTED = 0.95
"""Share of those that must be."""
HELD = (0.88, 0.95)
"""Share of the corrected goals whose RMS distance, over the way, must stay within what was told."""
OF_AN_ARM = 8
"""Goals of each arm that is judged without nodes: bounds of one arm hold or fail together, for they are
told of one model."""
SLOWER = 1.5
"""Times the latency of a relay that copies which poses may take."""
POSES = 500.0
"""Poses a second in the race."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        '--goals', type=int, default=500, metavar='N', help='goals of all arms (default: 500)'
    )
    parser.add_argument(
        '--without-cell',
        type=int,
        default=500,
        metavar='N',
        help='goals of all arms that are judged without nodes, 0 for none (default: 500)',
    )
    parser.add_argument('--seed', type=int, default=7, metavar='N', help='decides what is drawn')
    parser.add_argument(
        '--go-on',
        action='store_true',
        help='keep the goals and changes that the file has, and try the others',
    )
    parser.add_argument(
        '--turns', type=int, default=20, metavar='N', help='turns of the race of poses, 0 for none'
    )


def run(args: argparse.Namespace, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return what became of every goal and of every change, and the race."""
    from .building.message_packages import messages_importable
    from .compensating.drawn_cells import HOMES

    with messages_importable(), _beside() as beside:
        from .compensating.drawn_cells import right_and_wrong
        from .compensating.trial import other_arm

        known = _before(args)
        each = -(-args.goals // len(HOMES))
        models = {
            name: beside.submit(right_and_wrong, name, args.seed)
            for name in unfinished(known, each)
        }
        without = _without_cell(args.without_cell, args.seed, known, beside)
        _in_cells(args, each, known, models, without, tell)
        other = other_arm(args.seed)
        tell(other)
        poses = race(args, tell)
        while without:
            wait(without, return_when=FIRST_COMPLETED)
            _gather(without, known)
            tell(f'{len(known.without)} goals without a cell: {_told(known.without)}')
            _keep(args, known, 0.0)
    return _made(args, known, other, poses)


def _in_cells(
    args: argparse.Namespace,
    each: int,
    known: Known,
    models: Mapping[str, Future[Any]],
    without: list[Future[Any]],
    tell: Callable[[str], None],
) -> None:
    """Try every arm that is not through yet; what the next one needs is learned meanwhile."""
    from .compensating.trial import tried

    begun = time.monotonic()
    for name, model in models.items():
        for said in tried(name, args.seed, each, model.result(), known):
            tell(f'{name}: {said}')
            _gather(without, known)
            _keep(args, known, time.monotonic() - begun)
        tell(f'{name}: {_told([row for row in known.rows if row["robot"] == name])}')


def _made(
    args: argparse.Namespace, known: Known, other: str, poses: dict[str, Any] | None
) -> dict[str, Any]:
    """Return what goes into the file."""
    found = summary(known.rows, known.changes, other, poses, known.without)
    return {**found, 'seed': args.seed, 'goals': known.rows, 'goals_without': known.without}


def _gather(without: list[Future[Any]], known: Known) -> None:
    """Take over the goals without a cell that are judged."""
    for own in [each for each in without if each.done()]:
        without.remove(own)
        known.without.extend(own.result())


def _keep(args: argparse.Namespace, known: Known, seconds: float) -> None:
    """Write what is known so far, for `--go-on`."""
    from .keeping.result_file import write_result

    write_result(args.out, 'compensator', seconds, _made(args, known, '', None))


def unfinished(known: Known, each: int) -> list[str]:
    """Return the arms that lack a change, or some of so many goals."""
    from .compensating.drawn_cells import HOMES
    from .compensating.trial import CHANGES

    changed = {change['robot'] for change in known.changes if change['change'] == CHANGES[-1]}
    calm = [row['robot'] for row in known.rows if not row['after']]
    return [name for name in HOMES if name not in changed or calm.count(name) < each]


def race(args: argparse.Namespace, tell: Callable[[str], None]) -> dict[str, Any] | None:
    """Return how long poses take beside a relay that copies them; None without turns."""
    from .compensating.pose_race import race as raced

    return raced(args.turns, POSES, tell) if args.turns else None


@contextmanager
def _beside() -> Iterator[Executor]:
    """Give a process that computes whenever the cell leaves it time."""
    pool = ProcessPoolExecutor(1, get_context('spawn'), initializer=os.nice, initargs=(5,))
    try:
        yield pool
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _without_cell(
    goals: int, seed: int, known: Known, beside: Executor
) -> list[Future[list[dict[str, Any]]]]:
    """Begin to judge goals without nodes, arm after arm, those that are not known yet."""
    from .compensating.drawn_cells import HOMES
    from .compensating.without_cell import judged

    kinds, done = [*HOMES], {row['arm'] for row in known.without}
    return [
        beside.submit(judged, kinds[k % len(kinds)], seed + 1 + k, OF_AN_ARM)
        for k in range(-(-goals // OF_AN_ARM))
        if seed + 1 + k not in done
    ]


def _before(args: argparse.Namespace) -> Known:
    """Return the goals and changes of the file, none where there is no file yet."""
    from .compensating.trial import Known

    file = Path(args.out)
    if not args.go_on or not file.exists():
        return Known([], [], [])
    found = json.loads(file.read_text(encoding='utf-8'))
    if found['seed'] != args.seed:
        raise DataError(
            f"the goals of '{file}' were drawn with --seed {found['seed']}; go on with it"
        )
    return Known(found['goals'], found['changes'], found['goals_without'])


def _told(rows: Sequence[dict[str, Any]]) -> str:
    found = counted(rows)
    return ', '.join(f'{key} {found[key]}' for key in ('goals', 'corrected', 'worse', 'held'))


def worse(row: dict[str, Any]) -> bool:
    """Return whether a goal came out farther off than it was."""
    return bool(row['after_m'] > row['before_m'] + max(WORSE[0], WORSE[1] * row['before_m']))


def worth(row: dict[str, Any]) -> bool:
    """Return whether a goal is among those to be corrected."""
    return bool(row['inside'] and row['best_m'] <= (1.0 - WORTH) * row['before_m'])


def counted(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return what goals come to."""
    import numpy as np

    done = [row for row in rows if row['verdict'] == 'corrected']
    bound = [row for row in done if row['bound_m'] is not None]
    to_do = [row for row in rows if worth(row)]
    middle = {
        key: float(np.median([row[key] for row in done])) if done else None
        for key in ('before_m', 'after_m', 'best_m', 'bound_m')
    }
    return {
        'goals': len(rows),
        'corrected': len(done),
        'refused': sum(row['verdict'] == 'refused' for row in rows),
        'worse': sum(worse(row) for row in rows),
        'to_correct': len(to_do),
        'of_them_corrected': sum(row['verdict'] == 'corrected' for row in to_do),
        'outside': sum(not row['inside'] for row in rows),
        'outside_corrected': sum(not row['inside'] for row in done),
        'bounds': len(bound),
        'held': sum(row['after_m'] <= row['bound_m'] for row in bound),
        'median': middle,
    }


def summary(
    rows: Sequence[dict[str, Any]],
    changes: Sequence[dict[str, Any]],
    other: str,
    poses: dict[str, Any] | None,
    without: Sequence[dict[str, Any]] = (),
) -> dict[str, Any]:
    """Return what all of it comes to, and whether it passed."""
    calm = [row for row in rows if not row['after']]
    kinds = list(dict.fromkeys(row['after'] for row in rows))
    unchanged = [c for c in changes if c['change'] == NOTHING]
    totals, beside = counted(calm), counted(without)
    after = {kind: counted([r for r in rows if r['after'] == kind]) for kind in kinds if kind}
    held = (totals['held'] + beside['held']) / ((totals['bounds'] + beside['bounds']) or 1)
    goals = {
        'none worse': not any(worse(row) for row in (*rows, *without)),
        'corrected where it pays': totals['of_them_corrected'] >= CORRECTED * totals['to_correct'],
        'changes noticed': all(c['noticed'] for c in changes if c not in unchanged),
        'nothing noticed without a change': not any(c['noticed'] for c in unchanged),
        'nothing corrected after a change': all(not row['corrected'] for row in after.values()),
        'model of another arm refused': other.startswith('exit code 2'),
        'bound holds': HELD[0] <= held <= HELD[1],
    }
    if poses is not None:
        goals['poses in time'] = max(poses['ratio'].values()) <= SLOWER and not poses['lost']
    return {
        'passed': all(goals.values()),
        'reached': goals,
        'held': held,
        'totals': totals,
        'robots': _by_arm(calm),
        'without_cell': {
            'arms': len({row['arm'] for row in without}),
            'robots': _by_arm(without),
            'totals': beside,
        },
        'after_a_change': after,
        'changes': list(changes),
        'other_arm': other,
        'poses': poses,
    }


def _by_arm(rows: Sequence[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    names = dict.fromkeys(row['robot'] for row in rows)
    return {name: counted([row for row in rows if row['robot'] == name]) for name in names}


HEAD = (
    'arm',
    'goals',
    'corrected',
    'of those that gain half',
    'refused of those outside',
    'worse',
    'before, mm',
    'after',
    'true causes',
    'bound reported',
    'within it',
)


def table(result: dict[str, Any]) -> str:
    """Return the tables of the page: the arms, the changes, the race of poses."""
    arms = [*result['robots'].items(), ('all', result['totals'])]
    lines = [markdown.table(HEAD, *(_row(name, one) for name, one in arms)), _changes(result)]
    more = result['without_cell']
    if more and more['robots']:
        arms = [*more['robots'].items(), ('all', more['totals'])]
        lines.append(markdown.table(HEAD, *(_row(name, one) for name, one in arms)))
    poses = result['poses']
    if poses is not None:
        lines.append(pose_table(poses))
    return '\n\n'.join(lines)


def _row(name: str, one: dict[str, Any]) -> tuple[str, ...]:
    """Return a row of an arm."""
    middle = [one['median'][key] for key in ('before_m', 'after_m', 'best_m', 'bound_m')]
    return (
        name,
        str(one['goals']),
        str(one['corrected']),
        f'{one["of_them_corrected"]} of {one["to_correct"]}',
        f'{one["outside"] - one["outside_corrected"]} of {one["outside"]}',
        str(one['worse']),
        *('' if value is None else f'{value * 1e3:.4f}' for value in middle),
        f'{one["held"]} of {one["bounds"]}',
    )


def _changes(result: dict[str, Any]) -> str:
    """Return a row for each kind of change."""
    rows = []
    for kind, one in result['after_a_change'].items():
        noticed = max(c['seconds'] for c in result['changes'] if c['change'] == kind)
        rows.append((kind, one['goals'], one['refused'], one['worse'], f'{noticed:.1f} s'))
    head = ('change', 'goals after its notice', 'refused', 'worse', 'noticed within')
    return markdown.table(head, *rows)
