# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Drawn goals go through a compensator in a cell, and as many without nodes.

In a cell the injector is the real arm, with a controller, a twin, an analyzer and a compensator.
Every goal runs twice over the same way, once as it is and once by the compensator, each time from
the same side. What the tool does is heard on `/measured/tool_pose`.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from rclpy.action import ActionClient

from weld_twin_core.arm.chain import forward
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError, TwinError
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.goal_correction import GoalLimits, Refusal, Start, corrected_goal
from weld_twin_core.twin.goal_motion import Goal, approached, course, fine_times
from weld_twin_core.twin.program_model import ProgramModel
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.files.whole_files import read_json
from weld_twin_msgs_py.files.yaml_file import yaml_text
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import AUDIT, DEVIATION, MEASURED_POSE
from weld_twin_nodes.cli.given import Given
from weld_twin_nodes.harness import Cell
from weld_twin_nodes.harness.controller import Controller
from weld_twin_nodes.offline.correcting import program_model

from ..study import shown, tabled
from . import write_result
from .drawn_cells import (
    CHANGES,
    HOMES,
    INSIDE,
    NOTHING,
    Arm,
    DrawnGoal,
    Known,
    Learned,
    arms_of,
    cell_of,
    drawn_goal,
    goals_of,
    learned,
    right_and_wrong,
    true_effects,
)
from .message_packages import messages_importable

PACE = 20.0
"""How many times as fast as they say goals run: nothing in these cells hangs on speed."""
RETURN = 1.5
"""Length of a way back, or to where a goal begins [s]."""
NEAR_TURN = np.arange(-0.2, 0.2, 0.01)
"""Times around a turn [s] at which the arm is looked at too: play is taken up in some hundredths."""
NOTICE = 30.0
"""Longest time [s] after a change until goals count."""
SETTLED = 1.5
"""Time [s] in which everything that is under way has arrived."""
JUMP = 4.0
"""By how much the clock of the measurements jumps [s]: the most that an injector takes."""
CALM = 10.0
"""Time [s] without a change in which nothing may be noticed."""
EACH = 3
"""Goals after each change."""
AFTER = 100_000
"""Number of the first goal after a change: those before are counted from 0."""
LIMITS = GoalLimits(acceleration=20.0)
"""As a compensator has them that is told nothing else."""


class CellTrial:
    def __init__(
        self, cell: Cell, folder: Path, arm: Arm, models: tuple[Learned, Learned | None]
    ) -> None:
        from control_msgs.action import FollowJointTrajectory

        self.cell, self.kind, self.arm, self.name = cell, FollowJointTrajectory, arm, arm.name
        self.robot, self.causes, self.rng = cell_of(arm.name, arm.seed)
        self.right, self.wrong = models
        self.model = folder / 'diagnosis.json'
        self.model.write_text(self.right.text)
        self._late = 0
        self._begin()

    def _begin(self) -> None:
        cell, robot = self.cell, self.robot
        self.controller = cell.add(
            Controller, robot.joint_names, HOMES[self.name], PACE, self._turns
        )
        common = {'robot': self.name, 'reliable_inputs': True}
        cell.start('error_injector', effects=self._effects(), **common)
        cell.start('forward_kinematics_twin', model=str(self.model), **common)
        self.analyzer = cell.start('deviation_analyzer', **common)
        self.compensator = cell.start(
            'compensator', model=str(self.model), apply=True, managed=False, **common
        )
        self.audit: list[dict[str, Any]] = []
        cell.node.create_subscription(
            AUDIT.message_class(), '/compensator/audit', self._audited, AUDIT.requested.to_rclpy()
        )
        self.measured = cell.collect(MEASURED_POSE.name)
        self.deviations = cell.collect(DEVIATION.name)
        action = 'follow_joint_trajectory'
        self._through = ActionClient(cell.node, self.kind, f'/compensator/{action}')
        self._direct = ActionClient(cell.node, self.kind, f'/joint_trajectory_controller/{action}')
        for client in (self._through, self._direct):
            cell.wait(client.server_is_ready, 'the actions')
        cell.meet()
        cell.wait(lambda: len(self.deviations) > 0, 'a deviation')

    def _turns(self, goal: Goal) -> Array:
        """Return times [s] of a goal around where joints with play turn around: much happens there."""
        at = fine_times(goal)
        played = [e['joint'] for e in self.causes if e['effect'] == 'backlash']
        ways = [course(goal, at).qd[:, self.robot.joint_names.index(name)] for name in played]
        turns = [at[1:][np.diff(np.sign(qd)) != 0.0] for qd in ways]
        near = np.concatenate([*turns, at[:1]])[:, None] + NEAR_TURN
        return np.asarray(near[(near > at[0]) & (near < at[-1])])

    def _audited(self, message: Any) -> None:
        self.audit.append(json.loads(message.data))

    def _effects(self, *more: dict[str, Any]) -> str:
        return yaml_text([*self.causes, *more])

    # Goals -----------------------------------------------------------------------------------

    def run(self, goal: Goal, *, through: bool) -> tuple[bool, dict[str, Any]]:
        """Run a goal; return whether it was taken, and its audit line."""
        message = self.kind.Goal()
        message.trajectory.joint_names = list(self.robot.joint_names)
        message.trajectory.points = self.cell.messages.trajectory_points(*goal)
        client, lines = (self._through if through else self._direct), len(self.audit)
        asked = client.send_goal_async(message)
        self.cell.wait(asked.done, 'the answer')
        if through:
            self.cell.wait(lambda: len(self.audit) > lines, 'the audit')
        line = self.audit[-1] if through else {}
        if not asked.result().accepted:
            return False, line
        result = asked.result().get_result_async()
        self.cell.wait(result.done, 'the result', limit=60.0)
        return True, line

    def to(self, q: Array) -> None:
        """Bring the arm to a posture, uncorrected."""
        here = self.controller.q
        t = np.linspace(0.0, RETURN, 16)
        s = (0.5 - 0.5 * np.cos(np.pi * t / RETURN))[:, None]
        self.run(Goal(t, here + s * (q - here)), through=False)

    def off(self, goal: Goal, waits: float = 0.0) -> tuple[float, float]:
        """Return how far the real tool was from where the last goal meant it, RMS and most [m]."""
        track = {stamp + self._late: t - waits for stamp, t in self.controller.track}
        self.measured_until(max(track))
        meant, real = [], []
        for message in self.measured.messages:
            t = track.get(from_messages.stamp_ns(message))
            if t is not None and t >= 0.0:
                real.append(from_messages.pose(message)[0])
                meant.append(t)
        self.measured.messages.clear()
        self.deviations.messages.clear()
        way = course(goal, np.minimum(np.array(meant), goal.t[-1]))
        # The arm is looked at more often where it turns; each look stands for its part of the time.
        share = np.gradient(np.array(meant)) if len(meant) > 1 else None
        return _sizes(np.array(real) - forward(self.robot, way.q)[:, :3, 3], share)

    def measured_until(self, stamp: int) -> None:
        """Wait until the tool was measured at a stamp [ns]."""
        messages = self.measured.messages
        self.cell.wait(
            lambda: bool(messages) and from_messages.stamp_ns(messages[-1]) >= stamp,
            'the measurements',
        )

    def judged(self, drawn: DrawnGoal, after: str) -> dict[str, Any]:
        """Return what became of a goal, run as it is and through the compensator."""
        goal = drawn.goal
        came = np.sign(goal.q[min(3, len(goal.q) - 1)] - goal.q[0])
        offs = []
        taken, line = True, dict[str, Any]()
        for through in (False, True):
            self.to(goal.q[0] - 0.05 * came)
            self.to(goal.q[0])
            taken, line = self.run(goal, through=through)
            if taken:
                offs.append(self.off(goal, line.get('waits_s', 0.0)))
        true = ProgramModel(self.robot, true_effects(self.robot, self.causes))
        best = corrected_goal(true, goal, LIMITS, Start(goal.q[0], False, came))
        return {
            'robot': self.name,
            'arm': self.arm.seed,
            'after': after,
            'inside': drawn.inside,
            'model': line['model'],
            'verdict': line['verdict'],
            'why': line['why'],
            'before_m': offs[0][0],
            'after_m': offs[-1][0],
            'worst_m': offs[-1][1],
            'best_m': min(np.inf if isinstance(best, Refusal) else best.after, offs[0][0]),
            'expected_m': line.get('expected_after_m'),
            'bound_m': line.get('bound_m'),
            'largest_m': line.get('largest_m'),
        }

    # Changes ---------------------------------------------------------------------------------

    def changed(self, what: str) -> dict[str, Any]:
        """Change something, and wait for the notice; return how long that took."""
        count, limit = len(self.compensator.log), CALM if what == NOTHING else NOTICE
        acting: tuple[dict[str, Any], ...] = ()
        # The tracker that the model was learned with; goals are judged without its noise.
        noise = {'effect': 'measurement_noise', 'sigma': self.right.noise}
        if what == 'wrong model':
            assert self.wrong is not None
            self.model.write_text(self.wrong.text)
            self._reload()
        elif what == 'clock jumped':
            acting = ({'effect': 'time_delay', 'delay': JUMP},)
            self._late = round(JUMP * 1e9)
        elif what == 'load changed':
            # A torch of another weight bends the shoulder and the elbow.
            bent = zip(self.robot.joint_names[1:3], (4e-4, -5e-4), strict=True)
            acting = tuple(
                {'effect': 'joint_offset', 'joint': at, 'offset': by} for at, by in bent
            )
        self._inject(*acting, noise)
        begun = time.monotonic()
        if what == 'tracker lost':
            self.analyzer.stop()

        def noticed() -> bool:
            log = self.compensator.log[count:]
            return 'does not hold' in log or 'is lost' in log

        # The arm goes to and fro meanwhile: measurements of one place tell of one place.
        while not noticed() and time.monotonic() - begun < limit:
            self.to(HOMES[self.name] + INSIDE * self.rng.uniform(-1.0, 1.0, self.robot.n))
        seconds = round(time.monotonic() - begun, 2)
        self._inject(*acting)
        return {'robot': self.name, 'change': what, 'noticed': noticed(), 'seconds': seconds}

    def restore(self) -> None:
        self._late = 0
        self._inject()
        self.model.write_text(self.right.text)
        self._reload()
        end = time.monotonic() + SETTLED
        self.cell.wait(lambda: time.monotonic() > end, 'what is under way')
        self.measured.messages.clear()
        count = len(self.deviations)
        self.cell.wait(lambda: len(self.deviations) > count + 30, 'deviations')
        self._reload()

    def _inject(self, *more: dict[str, Any]) -> None:
        done = self.cell.set_parameter('error_injector', 'effects', self._effects(*more))
        assert done.successful, done.reason

    def _reload(self) -> None:
        for node in ('forward_kinematics_twin', 'compensator'):
            answer = self.cell.trigger(f'/{node}/reload')
            assert answer.success, answer.message


def tried(
    arm: Arm, goals: int, models: tuple[Learned, Learned | None], known: Known
) -> Iterator[str]:
    """Add what becomes of an arm's goals and changes to what is known, and yield now and then so far."""
    done = sum(not row['after'] for row in arm.of(known.rows))
    with _cell() as (cell, folder):
        trial = CellTrial(cell, folder, arm, models)
        for k, drawn in enumerate(goals_of(arm, done, goals - done), done + 1):
            known.rows.append(trial.judged(drawn, ''))
            if k % 10 == 0:
                yield f'{k} of {goals} goals'
        if arm.changed:
            yield from _changed(trial, known)


def _changed(trial: CellTrial, known: Known) -> Iterator[str]:
    """Change the cell in every way that is not known yet, nothing first: that too could be noticed."""
    changes = {c['change'] for c in known.changes if c['robot'] == trial.name}
    if changes:
        trial.restore()  # a tracker that was never heard cannot be lost
    for k, what in enumerate((NOTHING, *CHANGES)):
        if what in changes:
            continue
        change = trial.changed(what)
        if what != NOTHING:
            for drawn in goals_of(trial.arm, AFTER + EACH * k, EACH):
                known.rows.append(trial.judged(drawn, what))
        known.changes.append(change)
        yield str(change)
        if what != CHANGES[-1]:
            trial.restore()


@contextmanager
def _cell() -> Iterator[tuple[Cell, Path]]:
    with TemporaryDirectory() as place, Cell(Path(place) / 'cell') as cell:
        yield cell, Path(place)


def other_arm(seed: int) -> str:
    names = ('ur5', 'ur10e')
    robot, causes, rng = cell_of(names[1], seed)
    text = learned(robot, causes, rng).text
    with _cell() as (cell, folder):
        model = folder / 'diagnosis.json'
        model.write_text(text)
        process = cell.start('compensator', robot=names[0], model=str(model), managed=False)
        code = process.end(60.0)
        return f'exit code {code}: {process.log.strip().splitlines()[-1]}'


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
    return _sizes(real - forward(true.robot, course(goal, at).q)[:, :3, 3])


def _sizes(apart: Array, share: Array | None = None) -> tuple[float, float]:
    """Return RMS, each by its share, and most of the lengths of vectors (N, 3) [m]."""
    squares = (apart**2).sum(axis=1)
    return float(np.sqrt(np.average(squares, weights=share))), float(np.sqrt(squares.max()))


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
    results = summary(known.rows, known.changes, other, known.without)
    return {**results, 'seed': args.seed, 'goals': known.rows, 'goals_without': known.without}


def unfinished(known: Known, goals: int, seed: int) -> list[Arm]:
    changed = {change['robot'] for change in known.changes if change['change'] == CHANGES[-1]}
    return [
        arm
        for arm in arms_of(goals, IN_A_CELL, seed)
        if sum(not row['after'] for row in arm.of(known.rows)) < IN_A_CELL
        or (arm.changed and arm.name not in changed)
    ]


def _before(args: Given) -> Known:
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
    return bool(row['after_m'] > row['before_m'] + max(WORSE[0], WORSE[1] * row['before_m']))


def worth(row: dict[str, Any]) -> bool:
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
    parts = [
        tabled(COLUMNS, [*part['robots'].items(), ('all', part['totals'])])
        for part in (result, result['without_cell'])
        if part is result or (part and part['robots'])
    ]
    return '\n\n'.join([parts[0], _changes(result), *parts[1:], _spread(result)])


def _spread(result: dict[str, Any]) -> str:
    counts = result['spread']
    if not counts['arms']:
        return ''
    return (
        f'{result["held"]:.1%} of all bounds held: all of them in {counts["all"]} of {counts["arms"]} '
        f'arms, at least {HELD[0]:.0%} in {counts["most"]}, fewer than half in '
        f'{counts["fewer_than_half"]}; {counts["least"]:.0%} in the worst'
    )


DISTANCES = {
    'before, mm': 'before_m',
    'after': 'after_m',
    'true causes': 'best_m',
    'at most': 'worst_m',
    'bound reported': 'bound_m',
}
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
    **{words: shown(1, 'median', key, by='{:.4f}', times=1e3) for words, key in DISTANCES.items()},
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
