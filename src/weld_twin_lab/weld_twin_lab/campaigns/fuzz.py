# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Broken files of every kind are read, and recordings that hardly say anything diagnosed."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.effects import JointOffset
from weld_twin_core.effects.effect import Effect
from weld_twin_core.effects.plausible import beyond
from weld_twin_core.errors import DataError, TwinError
from weld_twin_core.recording import JointMotion, Measurements, Recording, Signal
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.files import markdown
from weld_twin_nodes.cli.given import Given

from ..real_arms.unseen import traceback_text
from .broken_files import targets
from .hunt import CPU_LIMIT, MEMORY_LIMIT, Finding, hunt, try_all

ROBOTS = ('slide', 'turn', 'planar', 'ur5', 'franka_panda', 'nine')
ALIGNS = ('', 'base', 'tool', 'base,tool')
ERRORS = ('none', 'offset', 'huge', 'jumbled')


@dataclass(frozen=True)
class Draw:
    """What a degenerate recording is made of."""

    robot: str = 'ur5'
    """One of `ROBOTS`."""
    stations: bool = True
    """At rest, else in motion."""
    count: int = 20
    """Measurements."""
    turned: bool = False
    """Whether orientations were measured."""
    align: str = ''
    still: int = 0
    """Joints that do not move, counted from the last."""
    travel: float = 0.5
    """Half the range that the others move over [rad or m]."""
    grid: float = 0.0
    """Step that positions are rounded to [degrees]; none at 0."""
    repeats: int = 1
    """How often every posture comes."""
    noise: float = 2e-5
    """Of the instrument, [m]."""
    flat: int = 0
    """Coordinates that were not measured and are zero throughout."""
    error: str = 'none'
    """One of `ERRORS`."""
    warm: bool = False
    """Whether a temperature was recorded, ever the same."""
    seed: int = 0


def drawn(seed: int) -> Draw:
    """Return one of many recordings, always the same for a seed."""
    rng = np.random.default_rng(seed)
    stations = bool(rng.random() < 0.7)
    return Draw(
        robot=str(rng.choice(ROBOTS)),
        stations=stations,
        count=int(rng.integers(1, 61)) if stations else int(rng.integers(2, 300)),
        turned=bool(rng.random() < 0.4),
        align=str(rng.choice(ALIGNS)),
        still=int(rng.integers(0, 10)),
        travel=float(rng.choice([0.0, 1e-6, 0.02, 0.5, 1.5])),
        grid=float(rng.choice([0.0, 0.0, 1.0, 10.0])),
        repeats=int(rng.choice([1, 1, 2, 10])),
        noise=float(rng.choice([0.0, 1e-9, 2e-5, 1e-3])),
        flat=int(rng.choice([0, 0, 1, 2, 3])),
        error=str(rng.choice(ERRORS)),
        warm=bool(rng.random() < 0.2),
        seed=seed,
    )


def robot_of(name: str) -> Robot:
    """Return a robot by name; those that are not in the catalogue are as plain as can be."""
    if name in catalog.names():
        return catalog.load(name)
    rows: dict[str, list[dict[str, Any]]] = {
        'slide': [{'name': 'axis', 'type': 'prismatic'}],
        'turn': [{'name': 'axis', 'a': 0.5}],
        'planar': [{'name': 'one', 'a': 0.4}, {'name': 'two', 'a': 0.3}],
        'nine': [
            {'name': f'j{k}', 'a': 0.1, 'd': 0.05, 'alpha': (-1.0) ** k * np.pi / 2.0}
            for k in range(9)
        ],
    }
    return Robot.from_mapping({'name': name, 'joints': rows[name]})


def recording_of(draw: Draw) -> tuple[Recording, Robot]:
    """Return the recording of a draw, and the robot it is diagnosed as."""
    robot, rng = robot_of(draw.robot), np.random.default_rng(draw.seed)
    q = _positions(draw, robot, rng)
    t = np.arange(float(draw.count)) * (1.0 if draw.stations else 0.01)
    commanded = Recording('drawn', JointMotion(t, q, None, draw.stations))
    poses = Twin(robot, _effects(draw, robot)).poses(commanded, t)
    position = np.array(poses.position + draw.noise * rng.standard_normal((draw.count, 3)))
    if draw.error == 'jumbled':
        position = position[rng.permutation(draw.count)]
    position[:, : draw.flat] = 0.0
    rotation = poses.rotation if draw.turned else None
    warmth = Signal(t, np.full(t.size, 21.0)) if draw.warm else None
    measured = Measurements(t, position, rotation)
    return Recording('drawn', commanded.joints, measured, temperature=warmth), robot


def _positions(draw: Draw, robot: Robot, rng: np.random.Generator) -> Array:
    count = -(-draw.count // draw.repeats)
    if draw.stations:
        moved = rng.uniform(-1.0, 1.0, (count, robot.n))
    else:
        phase = np.arange(count)[:, None] * 0.01 * rng.uniform(0.5, 3.0, robot.n)
        moved = np.sin(phase + rng.uniform(0.0, 6.0, robot.n))
    middle = 0.5 * (np.maximum(robot.lower, -1.0) + np.minimum(robot.upper, 1.0))
    q = middle + draw.travel * moved
    q[:, robot.n - min(draw.still, robot.n) :] = middle[robot.n - min(draw.still, robot.n) :]
    if draw.grid:
        step = np.where(robot.prismatic, 1e-3, 1.0) * np.radians(draw.grid)
        q = step * np.rint(q / step)
    return np.repeat(q, draw.repeats, axis=0)[: draw.count]


def _effects(draw: Draw, robot: Robot) -> tuple[Effect, ...]:
    sizes = {'offset': 1e-3, 'huge': 0.5}
    if draw.error not in sizes:
        return ()
    return (JointOffset(robot.joint_names[draw.seed % robot.n], sizes[draw.error]),)


def tried(draw: Draw) -> dict[str, Any]:
    """Return what came of a draw: status, or refusal, or traceback, and what must not be."""
    recording, robot = recording_of(draw)
    out: dict[str, Any] = {'draw': asdict(draw), 'status': None, 'traceback': None, 'wrong': []}
    try:
        diagnosis = diagnose([recording], robot, align=draw.align)
        diagnosis.as_dict()
    except TwinError as error:
        return out | {'status': 'refused', 'sentence': str(error)}
    except Exception:  # what is counted here is exactly what nobody expected
        return out | {'traceback': traceback_text()}
    wrong = []
    if diagnosis.status == 'identified' and not (diagnosis.effects or diagnosis.families):
        wrong.append('identified with nothing named')
    wrong += [
        f'{each.effect.name} of {each.effect.site}: {name} = {value:.3g}'
        for each in diagnosis.effects
        for name, value, _ in beyond(robot, each.effect)
    ]
    return out | {'status': diagnosis.status, 'wrong': wrong}


def worst_of(count: int, first: int, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return how many draws, from the first on, ended how, and those that went wrong."""
    statuses: Counter[str] = Counter()
    bad = []
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')
        for seed in range(first, first + count):
            came = tried(drawn(seed))
            statuses[came['status'] or 'traceback'] += 1
            if came['traceback'] or came['wrong']:
                bad.append(came)
                last = (came['traceback'] or came['wrong'][0]).strip().splitlines()[-1]
                tell(f'recording {seed}: {last}')
    return {'first': first, 'count': count, 'statuses': dict(statuses), 'bad': bad}


def run(args: Given, tell: Callable[[str], None]) -> dict[str, Any]:
    names = list(targets())
    chosen = [name for name in args.only.split(',') if name] or names
    if unknown := set(chosen) - set(names):
        listed = ', '.join(names)
        raise DataError(f'no kind of file is called {min(unknown)!r}; there are {listed}')
    findings: dict[str, Finding] = {}
    kinds = {}
    for name in chosen:
        tally = hunt(name, args.seed, args.cases, findings)
        kinds[name] = asdict(tally)
        tell(f'{name}: {tally.right} read, {tally.refused} refused, {tally.wrong} wrong')
    for finding in findings.values():
        tell(f'{finding.target} {finding.case}: {finding.what} ({finding.times} times)')
    malicious = try_all()
    for name, outcome in malicious.items():
        tell(f'{name}: {outcome}')
    recordings = worst_of(args.recordings, args.seed, tell) if args.recordings else {'bad': []}
    passed = not (findings or recordings['bad'])
    passed = passed and all(text.startswith('refused') for text in malicious.values())
    return {
        'passed': passed,
        'seed': args.seed,
        'cases_of_each': args.cases,
        'cpu_limit_s': CPU_LIMIT,
        'memory_limit_mb': MEMORY_LIMIT / 1e6,
        'kinds': kinds,
        'findings': [asdict(finding) for finding in findings.values()],
        'malicious': malicious,
        'recordings': recordings,
    }


def table(result: dict[str, Any]) -> str:
    kinds = [
        (name, row['right'], row['refused'], row['wrong']) for name, row in result['kinds'].items()
    ]
    outcomes = result['malicious'].values()
    refused = sum(text.startswith('refused') for text in outcomes)
    kinds.append(('malicious', 0, refused, len(outcomes) - refused))
    return markdown.table(('kind', 'read', 'refused', 'wrong'), *kinds)
