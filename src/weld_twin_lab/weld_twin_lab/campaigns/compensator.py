# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Drawn goals go through a compensator in a cell, and as many without nodes."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from weld_twin_core.arm.chain import forward
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError, TwinError
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.goal_correction import GoalLimits, Refusal, Start, corrected_goal
from weld_twin_core.twin.goal_motion import Goal, course, fine_times
from weld_twin_core.twin.program_model import ProgramModel
from weld_twin_core.twin.reversals import approached
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.files.whole_files import read_json
from weld_twin_nodes.cli.given import Given
from weld_twin_nodes.offline.correcting import program_model

from ..study import tabled
from . import write_result
from .drawn_cells import (
    CHANGES,
    NOTHING,
    Arm,
    Known,
    arms_of,
    cell_of,
    drawn_goal,
    learned,
    right_and_wrong,
    true_effects,
)
from .message_packages import messages_importable

LIMITS = GoalLimits(acceleration=20.0)
"""As a compensator has them that is told nothing else."""


def judged(name: str, seed: int, goals: int) -> list[dict[str, Any]]:
    """Return what becomes of the goals of one arm that stands where each of them begins."""
    robot, causes, rng = cell_of(name, seed)
    with TemporaryDirectory() as place:
        file = Path(place) / 'diagnosis.json'
        file.write_text(learned(robot, causes, rng).text)
        try:
            model = program_model(robot, file)
        except TwinError:  # a compensator does not take it either
            return []
    true = ProgramModel(robot, true_effects(robot, causes))
    rows = []
    for _ in range(goals):
        goal, inside = drawn_goal(robot, rng)
        start = Start(goal.q[0], False, rng.choice([-1.0, 1.0], robot.n))
        corrected, best = (corrected_goal(each, goal, LIMITS, start) for each in (model, true))
        before, _ = _off(true, goal, goal, start)
        row = {'robot': name, 'arm': seed, 'after': '', 'inside': inside, 'before_m': before}
        row['best_m'] = before if isinstance(best, Refusal) else best.after
        if isinstance(corrected, Refusal):
            row |= {'verdict': 'refused', 'after_m': before, 'bound_m': None}
        else:
            after, worst = _off(true, corrected.goal.later(-corrected.waits), goal, start)
            row |= {'verdict': 'corrected', 'after_m': after, 'worst_m': worst}
            row |= {'bound_m': corrected.bound}
        rows.append(row)
    return rows


def _off(true: ProgramModel, run: Goal, goal: Goal, start: Start) -> tuple[float, float]:
    """Return how far the arm with the true causes is from where a goal means it, RMS and most [m]."""
    at: Array = fine_times(goal)
    way = Recording('goal', JointMotion(at, course(run, at).q))
    came = approached(way, start.came, start.q)
    real = Twin(true.robot, true.effects).poses(came).position[-at.size :]
    apart = real - forward(true.robot, course(goal, at).q)[:, :3, 3]
    squares = (apart**2).sum(axis=1)
    return float(np.sqrt(squares.mean())), float(np.sqrt(squares.max()))


WORSE = (2e-5, 0.05)
"""A goal is worse if it is farther off than before by more than this [m], and by this share."""
WORTH = 0.5
"""Share of its error that a goal must be able to gain to count among those to be corrected."""
CORRECTED = 0.95
"""Share of those that must be."""
HELD = (0.88, 0.95)
"""Share of the corrected goals whose largest distance, on the way, must stay within what was told."""
IN_A_CELL, WITHOUT = 24, 8
"""Goals of each arm in a cell, and without nodes: bounds of one arm hold or fail together, for they are
told of one model."""
APART = 1000
"""Between the seeds of the arms in cells and of those without."""
SIZES = ('before_m', 'after_m', 'best_m')
"""RMS distances of a goal [m]: as it is, corrected, and corrected by the true causes."""
LARGEST = ('worst_m', 'bound_m')
"""Its largest distance when it is corrected [m], and what was told of that."""


def run(args: Given, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return what became of every goal and of every change."""
    begun = time.monotonic()
    with messages_importable():
        from .compensator_trial import other_arm, tried

        known = _before(args)

        def keep(said: str) -> None:
            tell(said)
            results = _made(args, known, '')
            write_result(args.out, 'compensator', time.monotonic() - begun, results)

        for arm in unfinished(known, args.goals, args.seed):
            for said in tried(arm, IN_A_CELL, right_and_wrong(arm), known):
                keep(f'{arm.name} {arm.seed}: {said}')
            keep(f'{arm.name} {arm.seed}: {_in_words(arm.of(known.rows))}')
        other = other_arm(args.seed)
        tell(other)
        done = {row['arm'] for row in known.without}
        for arm in arms_of(args.without_cell, WITHOUT, args.seed + APART):
            if arm.seed not in done:
                known.without.extend(judged(arm.name, arm.seed, WITHOUT))
                keep(f'{len(known.without)} goals without a cell: {_in_words(known.without)}')
    return _made(args, known, other)


def _made(args: Given, known: Known, other: str) -> dict[str, Any]:
    """Return what goes into the file."""
    results = summary(known.rows, known.changes, other, known.without)
    return {**results, 'seed': args.seed, 'goals': known.rows, 'goals_without': known.without}


def unfinished(known: Known, goals: int, seed: int) -> list[Arm]:
    """Return the arms that lack a change, or some of their goals."""
    changed = {change['robot'] for change in known.changes if change['change'] == CHANGES[-1]}
    return [
        arm
        for arm in arms_of(goals, IN_A_CELL, seed)
        if sum(not row['after'] for row in arm.of(known.rows)) < IN_A_CELL
        or (arm.changed and arm.name not in changed)
    ]


def _before(args: Given) -> Known:
    """Return the goals and changes of the file, none where there is no file yet."""
    file = Path(args.out)
    if not args.go_on or not file.exists():
        return Known([], [], [])
    content = read_json(file)
    if content['seed'] != args.seed:
        raise DataError(
            f"the goals of '{file}' were drawn with --seed {content['seed']}; go on with it"
        )
    return Known(content['goals'], content['changes'], content['goals_without'])


def _in_words(rows: Sequence[dict[str, Any]]) -> str:
    counts = counted(rows)
    return ', '.join(f'{key} {counts[key]}' for key in ('goals', 'corrected', 'worse', 'held'))


def worse(row: dict[str, Any]) -> bool:
    """Return whether a goal came out farther off than it was."""
    return bool(row['after_m'] > row['before_m'] + max(WORSE[0], WORSE[1] * row['before_m']))


def worth(row: dict[str, Any]) -> bool:
    """Return whether a goal is among those to be corrected."""
    return bool(row['inside'] and row['best_m'] <= (1.0 - WORTH) * row['before_m'])


def _held(row: dict[str, Any]) -> bool:
    return bool(row['worst_m'] <= row['bound_m'])


def spread(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return in how many arms all, most and fewer than half of the bounds held."""
    arms: dict[tuple[str, int], list[bool]] = {}
    for row in rows:
        if row['verdict'] == 'corrected' and row['bound_m'] is not None:
            arms.setdefault((row['robot'], row['arm']), []).append(_held(row))
    shares = [sum(holds) / len(holds) for holds in arms.values()]
    return {
        'arms': len(arms),
        'all': sum(share == 1.0 for share in shares),
        'most': sum(share >= HELD[0] for share in shares),
        'fewer_than_half': sum(share < 0.5 for share in shares),
        'least': min(shares, default=None),
    }


def counted(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return what goals come to."""
    done = [row for row in rows if row['verdict'] == 'corrected']
    bound = [row for row in done if row['bound_m'] is not None]
    to_do = [row for row in rows if worth(row)]
    middle = {
        key: float(np.median([row[key] for row in of])) if of else None
        for keys, of in ((SIZES, done), (LARGEST, bound))
        for key in keys
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
        'held': sum(_held(row) for row in bound),
        'median': middle,
    }


def summary(
    rows: Sequence[dict[str, Any]],
    changes: Sequence[dict[str, Any]],
    other: str,
    without: Sequence[dict[str, Any]] = (),
) -> dict[str, Any]:
    """Return what all of it comes to, and whether it passed."""
    calm = [row for row in rows if not row['after']]
    unchanged = [c for c in changes if c['change'] == NOTHING]
    totals, beside = counted(calm), counted(without)
    after = _counted_by('after', [row for row in rows if row['after']])
    covered = (totals['held'] + beside['held']) / ((totals['bounds'] + beside['bounds']) or 1)
    goals = {
        'none worse': not any(worse(row) for row in (*rows, *without)),
        'corrected where it pays': totals['of_them_corrected'] >= CORRECTED * totals['to_correct'],
        'changes noticed': all(c['noticed'] for c in changes if c not in unchanged),
        'nothing noticed without a change': not any(c['noticed'] for c in unchanged),
        'nothing corrected after a change': all(not row['corrected'] for row in after.values()),
        'model of another arm refused': other.startswith('exit code 2'),
        'bound holds': HELD[0] <= covered <= HELD[1],
    }
    return {
        'passed': all(goals.values()),
        'reached': goals,
        'held': covered,
        'spread': spread((*calm, *without)),
        'totals': totals,
        'robots': _counted_by('robot', calm),
        'without_cell': {
            'arms': len({row['arm'] for row in without}),
            'robots': _counted_by('robot', without),
            'totals': beside,
        },
        'after_a_change': after,
        'changes': list(changes),
        'other_arm': other,
    }


def _counted_by(key: str, rows: Sequence[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    names = dict.fromkeys(row[key] for row in rows)
    return {name: counted([row for row in rows if row[key] == name]) for name in names}


def table(result: dict[str, Any]) -> str:
    """Return the tables of the page: the arms, and the changes."""
    arms = [*result['robots'].items(), ('all', result['totals'])]
    lines = [tabled(COLUMNS, arms), _changes(result)]
    more = result['without_cell']
    if more and more['robots']:
        arms = [*more['robots'].items(), ('all', more['totals'])]
        lines.append(tabled(COLUMNS, arms))
    lines.append(_spread(result))
    return '\n\n'.join(lines)


def _spread(result: dict[str, Any]) -> str:
    """Return how differently bounds held in the arms of both tables."""
    counts = result['spread']
    if not counts['arms']:
        return ''
    return (
        f'{result["held"]:.1%} of all bounds held: all of them in {counts["all"]} of {counts["arms"]} '
        f'arms, at least {HELD[0]:.0%} in {counts["most"]}, fewer than half in '
        f'{counts["fewer_than_half"]}; {counts["least"]:.0%} in the worst'
    )


def _millimetres(key: str) -> Callable[[Any], str]:
    """Return what tells the median of a distance [mm]; nothing where there is none."""

    def in_words(row: Any) -> str:
        value = row[1]['median'][key]
        return '' if value is None else f'{value * 1e3:.4f}'

    return in_words


COLUMNS: dict[str, Callable[[Any], object]] = {
    'arm': lambda row: row[0],
    'goals': lambda row: row[1]['goals'],
    'corrected': lambda row: row[1]['corrected'],
    'of those that gain half': lambda row: (
        f'{row[1]["of_them_corrected"]} of {row[1]["to_correct"]}'
    ),
    'refused of those outside': lambda row: (
        f'{row[1]["outside"] - row[1]["outside_corrected"]} of {row[1]["outside"]}'
    ),
    'worse': lambda row: row[1]['worse'],
    'before, mm': _millimetres('before_m'),
    'after': _millimetres('after_m'),
    'true causes': _millimetres('best_m'),
    'at most': _millimetres('worst_m'),
    'bound reported': _millimetres('bound_m'),
    'within it': lambda row: f'{row[1]["held"]} of {row[1]["bounds"]}',
}
"""Columns of the tables of arms, each a name and what its goals come to."""


def _changes(result: dict[str, Any]) -> str:
    rows = []
    for kind, one in result['after_a_change'].items():
        noticed = max(c['seconds'] for c in result['changes'] if c['change'] == kind)
        rows.append((kind, one['goals'], one['refused'], one['worse'], f'{noticed:.1f} s'))
    head = ('change', 'goals after its notice', 'refused', 'worse', 'noticed within')
    return markdown.table(head, *rows)
