# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark from start to end: contenders take turns on the same arm, positions and seams."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from itertools import cycle
from pathlib import Path
from time import process_time
from typing import IO, Any, NamedTuple

import numpy as np

from weld_twin_core import __version__
from weld_twin_core.arm.bulk import BulkKernel
from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import transform
from weld_twin_core.arm.single_pose import SinglePose
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.motion.inverse import solve_path
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.files.whole_files import write_json

from .peers import PACKAGES, Peer, find_peers

DH_KEYS = ('theta', 'd', 'a', 'alpha')
SIZE = 1e-3
"""Standard deviation of an error [rad or m], that of an arm which was never calibrated."""


def calibrated_arm() -> Robot:
    """Return a UR5 whose DH values are all off nominal by about a millimetre or milliradian."""
    rng = np.random.default_rng(5)
    arm = load('ur5')
    rows: dict[str, Any] = {
        key: getattr(arm, key) + SIZE * rng.normal(size=arm.n) for key in DH_KEYS
    }
    tool = transform(np.eye(3), np.array([0.03, -0.02, 0.25]))
    return replace(arm, **rows, T_flange_tool=tool)


def random_positions(arm: Robot, count: int, seed: int = 0) -> Array:
    """Return joint positions of which no two are the same, shape (count, n) [rad]."""
    return np.random.default_rng(seed).uniform(-np.pi, np.pi, (count, arm.n))


def smooth_motion(arm: Robot, count: int) -> Array:
    """Return joint positions along a smooth seam, shape (count, n) [rad]."""
    s = np.linspace(0.0, 1.0, count)[:, None]
    phases = np.arange(arm.n)
    rates = 0.7 + 0.13 * ((5 * phases) % 7)
    return np.array([0.3, -1.2, 1.5, -1.9, -1.5, 0.2, 0.5])[phases] + 0.2 * np.sin(
        s * rates + phases
    )


def links(robot: Robot) -> list[Array]:
    """Return the constant transforms between joint axes, for ``links[0] Rz(q0) links[1] ...``."""
    out = [np.array(robot.T_world_base)]
    for i in range(robot.n):
        out.append(turn_z(robot.theta[i], robot.d[i]) @ turn_x(robot.alpha[i], robot.a[i]))
    out[-1] = out[-1] @ robot.T_flange_tool
    return out


def turn_z(angle: float, along: float) -> Array:
    """Return Rz(angle) Tz(along), shape (4, 4)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, along], [0, 0, 0, 1.0]])


def turn_x(angle: float, along: float) -> Array:
    """Return Rx(angle) Tx(along), shape (4, 4)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0, along], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1.0]])


_SMALL = Path(__file__).with_name('small_parent.py')


class Cost(NamedTuple):
    """Seconds on the clock, seconds of processor time, and the largest process [bytes]."""

    wall: float
    cpu: float
    peak: float


def cost_of(
    words: Sequence[str],
    *,
    environment: Mapping[str, str] | None = None,
    said: IO[str] | int = subprocess.DEVNULL,
    limit: float = 0.0,
) -> tuple[int, Cost]:
    """
    Run a program; return its exit code and what it cost.

    The memory of this process does not count, however large it is: see `small_parent`, whose own
    ten megabytes are the least that can be told.

    said: where what it prints goes, errors too; left out, nowhere.
    limit: after so long it is killed [s]; 0 for never.
    """
    read, write = os.pipe()
    try:
        process = subprocess.Popen(
            [sys.executable, '-I', '-S', str(_SMALL), str(write), str(limit), *words],
            stdout=said,
            stderr=subprocess.STDOUT,
            env=environment,
            pass_fds=[write],
        )
    finally:
        os.close(write)
    with os.fdopen(read, encoding='utf-8') as report:
        code, wall, cpu, peak = json.loads(report.readline())
    process.wait()
    return int(code), Cost(wall, cpu, peak)


OWN, REFERENCE = 'weld_twin', 'pinocchio'
"""The contender that the others are compared with."""


@dataclass(frozen=True)
class Contender:
    """One way to do a job."""

    name: str
    run: Callable[[], object]
    items: int = 1
    """How many poses, draws or runs one call does; a slow contender may do fewer of them."""
    gap: float = 0.0
    """Largest difference of its result to the reference."""


@dataclass(frozen=True)
class Workload:
    """A job: its contenders, the item their time is counted by, and how well they must agree."""

    title: str
    item: str
    contenders: Sequence[Contender]
    tolerance: float
    note: str = ''


@dataclass(frozen=True, eq=False)
class Outcome:
    """Processor seconds per item, shape (rounds,) for every contender."""

    workload: Workload
    seconds: dict[str, Array]

    def ratio(self, name: str) -> Array | None:
        """Return the reference's time over the contender's, per round; None without either."""
        if REFERENCE not in self.seconds:
            return None
        return np.asarray(self.seconds[REFERENCE] / self.seconds[name])

    def as_dict(self) -> dict[str, Any]:
        rows = {}
        for contender in self.workload.contenders:
            ratio = self.ratio(contender.name)
            rows[contender.name] = {
                'seconds_per_item': self.seconds[contender.name].tolist(),
                'ratio': None if ratio is None else ratio.tolist(),
                'gap': contender.gap,
                'items': contender.items,
            }
        load = self.workload
        return {
            'title': load.title,
            'item': load.item,
            'reference': [REFERENCE],
            'tolerance': load.tolerance,
            'note': load.note,
            'contenders': rows,
        }


def race(workload: Workload, rounds: int, least: float) -> Outcome:
    """Time contenders in turn, each so long a round [s]; raises DataError where their results differ."""
    for contender in workload.contenders:
        if not contender.gap <= workload.tolerance:
            raise DataError(
                f'{workload.title}: {contender.name} differs from the others by '
                f'{contender.gap:.3g}, more than {workload.tolerance:.3g}; nothing was timed'
            )
    calls = {c.name: _calls(c, least) for c in workload.contenders}
    seconds: dict[str, list[float]] = {c.name: [] for c in workload.contenders}
    for _ in range(rounds):
        for contender in workload.contenders:
            seconds[contender.name].append(_timed(contender, calls[contender.name]))
    return Outcome(workload, {name: np.array(values) for name, values in seconds.items()})


def _calls(contender: Contender, least: float) -> int:
    contender.run()
    calls, spent = 1, _timed(contender, 1) * contender.items
    while spent < 0.1 * least:
        calls *= 4
        spent = _timed(contender, calls) * contender.items * calls
    return max(1, round(calls * least / max(spent, 1e-9)))


def _timed(contender: Contender, calls: int) -> float:
    start = process_time()
    for _ in range(calls):
        contender.run()
    return (process_time() - start) / (calls * contender.items)


UNITS = ((1.0, 's'), (1e-3, 'ms'), (1e-6, 'us'), (1e-9, 'ns'))
"""Units of time, the largest that a figure reaches is used."""
LEFT_OUT = 'N = 1,000'
"""End of the titles that the brief table goes without."""


def lines(outcome: Outcome) -> Iterator[str]:
    """Yield a line for the workload and one for each contender."""
    load = outcome.workload
    yield f'{load.title} (per {load.item}; times: {REFERENCE} / contender)'
    for contender in load.contenders:
        seconds = float(np.median(outcome.seconds[contender.name]))
        yield f'  {contender.name:<26} {duration(seconds):>10}  {times(outcome, contender.name)}'
    if load.note:
        yield f'  {load.note}'


def page(outcomes: list[Outcome]) -> str:
    """Return a table in Markdown: own time, and times as fast as the reference and the others."""
    rows = [('workload', 'time', 'times as fast as', 'and as the others')]
    for outcome in outcomes:
        load = outcome.workload
        own = outcome.seconds[OWN]
        others = [
            f'{c.name} {short(np.median(outcome.seconds[c.name]) / np.median(own))}'
            for c in load.contenders
            if c.name not in (OWN, REFERENCE)
        ]
        rows.append(
            (
                load.title,
                f'{duration(float(np.median(own)))} per {load.item}',
                f'{REFERENCE}: **{times(outcome, OWN)}**',
                ', '.join(others),
            )
        )
    return markdown.table(*rows)


def brief(outcomes: list[Outcome]) -> str:
    """Return a shorter table, without ranges and small batches."""
    rows = [('one thread, in one run', 'times as fast')]
    for outcome in outcomes:
        load, ratio = outcome.workload, outcome.ratio(OWN)
        if ratio is not None and not load.title.endswith(LEFT_OUT):
            rows.append((load.title, f'{short(float(np.median(ratio)))} ({REFERENCE})'))
    return markdown.table(*rows)


def times(outcome: Outcome, name: str) -> str:
    """Return the median ratio and its range over the rounds."""
    ratio = outcome.ratio(name)
    if ratio is None:
        return '-'
    return f'{short(np.median(ratio))} ({short(ratio.min())} to {short(ratio.max())})'


def short(ratio: float) -> str:
    """Return a ratio with three digits, or all before the point."""
    return f'{ratio:,.0f}' if ratio >= 100.0 else f'{ratio:.3g}'


def duration(seconds: float) -> str:
    scale, unit = next((u for u in UNITS if seconds >= u[0]), UNITS[-1])
    return f'{seconds / scale:.3g} {unit}'


PLAIN = 'weld_twin, plain chain'
LOOPED = 500
"""Poses that peers are timed on: they loop, so that the time per pose does not depend on how many."""
CHAINED = 4096
"""Poses that the plain chain is timed on at the most: fewer than it hands to the kernels."""
EXACT = 1e-12
"""Difference [m or rad] that rounding may leave between two ways to the same number."""


def batches(robot: Robot, peers: dict[str, Peer], count: int) -> Iterator[Workload]:
    """Yield the workloads of many joint positions."""
    yield _poses(robot, peers, count)
    yield _jacobians(robot, peers, count)
    yield _derivatives(robot, peers, count)


def single(robot: Robot, peers: dict[str, Peer]) -> Workload:
    """Return the workload of one pose at a time, as a node has it."""
    q = random_positions(robot, 500, seed=2)
    wanted = forward(robot, q)
    live = Twin(robot).live()

    def step(one: Array) -> Array:
        position, rotation = live.step(0.0, one)[1]
        return np.column_stack([rotation, position])

    ways: dict[str, Callable[[Array], Array]] = {
        OWN: SinglePose(robot),
        'weld_twin, LiveTwin.step': step,
    }
    ways |= {name: peer.single for name, peer in peers.items()}
    contenders = []
    for name, way in ways.items():
        gap = max(np.abs(way(a)[:3] - b[:3]).max() for a, b in zip(q, wanted, strict=True))
        contenders.append(Contender(name, _one_by_one(way, q), 1, float(gap)))
    return Workload('one pose at a time', 'pose', contenders, EXACT)


def _one_by_one(way: Callable[[Array], Array], q: Array) -> Callable[[], object]:
    rows = cycle(list(q))
    return lambda: way(next(rows))


def _poses(robot: Robot, peers: dict[str, Peer], count: int) -> Workload:
    q = random_positions(robot, count)
    wanted = forward(robot, q[:LOOPED])
    kernel = BulkKernel(robot)
    out = kernel.poses(q)
    few = q[:CHAINED]
    contenders = [
        Contender(OWN, lambda: kernel.poses(q, out), count, _gap(out, wanted)),
        Contender(PLAIN, lambda: forward(robot, few), len(few)),
    ]
    for name, peer in peers.items():
        gap = _gap(peer.poses(q[:LOOPED]), wanted)
        contenders.append(Contender(name, partial(peer.poses, q[:LOOPED]), LOOPED, gap))
    return Workload(f'forward kinematics, N = {count:,}', 'pose', contenders, EXACT)


def _jacobians(robot: Robot, peers: dict[str, Peer], count: int) -> Workload:
    return Workload(
        f'poses and Jacobians, N = {count:,}',
        'pose',
        _with_screws(
            BulkKernel(robot, [('theta', i) for i in range(robot.n)]),
            random_positions(robot, count),
            {name: peer.screws for name, peer in peers.items()},
            lambda screws: screws.transpose(2, 0, 1),
        ),
        EXACT,
        'weld_twin leaves the Jacobians components first in memory',
    )


def _derivatives(robot: Robot, peers: dict[str, Peer], count: int) -> Workload:
    return Workload(
        f'poses and derivatives by {4 * robot.n} DH values, N = {count:,}',
        'pose',
        _with_screws(
            BulkKernel(robot, [(key, i) for i in range(robot.n) for key in ('theta', 'alpha')]),
            random_positions(robot, count),
            {name: peer.dh for name, peer in peers.items() if peer.dh},
            written_out,
        ),
        EXACT,
        'weld_twin gives them as two screws a row',
    )


def _with_screws(
    kernel: BulkKernel,
    q: Array,
    ways: Mapping[str, Callable[[Array], tuple[Array, Array]]],
    as_peers: Callable[[Array], Array],
) -> list[Contender]:
    """Return the contenders for poses and derivatives; ``as_peers`` brings screws into their form."""
    poses, out = kernel.screws(q)
    result = as_peers(out[..., :LOOPED])
    wanted = ways[REFERENCE](q[:LOOPED])[1] if REFERENCE in ways else result
    contenders = [
        Contender(OWN, lambda: kernel.screws(q, poses, out), len(q), _gap(result, wanted))
    ]
    for name, way in ways.items():
        gap = _gap(way(q[:LOOPED])[1], wanted)
        contenders.append(Contender(name, partial(way, q[:LOOPED]), LOOPED, gap))
    return contenders


def written_out(screws: Array) -> Array:
    """Return screws (6, 2 n, N) as derivatives by theta, d, a, alpha of every row (N, 6, 4 n)."""
    theta, alpha = screws[:, ::2], screws[:, 1::2]
    slides = [np.concatenate([screw[3:], np.zeros_like(screw[3:])]) for screw in (theta, alpha)]
    out: Array = np.stack([theta, *slides, alpha], axis=2).reshape(6, -1, screws.shape[-1])
    return np.transpose(out, (2, 0, 1))


def _gap(result: Array, wanted: Array) -> float:
    return float(np.abs(result[: len(wanted)] - wanted).max())


CLOSED = 1e-9
"""What inverse kinematics leaves open [m]."""
NEWTON_STEPS = 20
"""Steps to a point at most; it begins at the solution of the point before."""


def inverse(count: int, with_pinocchio: bool) -> Workload:
    robot = load('ur5')
    q = smooth_motion(robot, count)
    poses = forward(robot, q)

    def own() -> Array:
        return solve_path(robot, poses, seed=q[0]).q

    def gap_of(solved: Array) -> float:
        return float(np.abs(forward(robot, solved)[:, :3, 3] - poses[:, :3, 3]).max())

    def all_postures() -> Array:
        return solve_path(robot, poses).q

    contenders = [
        Contender(OWN, own, count, gap_of(own())),
        Contender(f'{OWN}, all postures', all_postures, count, gap_of(all_postures())),
    ]
    if with_pinocchio:
        newton = _newton(robot, poses, q[0])
        contenders.append(Contender('pinocchio', newton, count, gap_of(newton())))
    return Workload(
        f'inverse kinematics along {count:,} points',
        'point',
        contenders,
        CLOSED,
        "from a posture to start with, unless all are looked at; Pinocchio is given Newton's "
        'method from point to point',
    )


def _newton(robot: Robot, poses: Array, start: Array) -> Callable[[], Array]:
    import pinocchio as pin

    from .peers.pinocchio_peer import chain_model

    model, tool = chain_model(robot)
    data = model.createData()
    goals = [pin.SE3(pose) for pose in poses]

    def follow() -> Array:
        out = np.empty((len(goals), model.nq))
        q = start.copy()
        for goal, target in zip(goals, out, strict=True):
            for _ in range(NEWTON_STEPS):
                pin.computeJointJacobians(model, data, q)
                error = pin.log6(pin.updateFramePlacement(model, data, tool).actInv(goal)).vector
                if error @ error < (0.1 * CLOSED) ** 2:
                    break
                jacobian = pin.getFrameJacobian(model, data, tool, pin.LOCAL)
                q = q + np.linalg.solve(jacobian, error)
            target[:] = q
        return out

    return follow


@dataclass(frozen=True)
class Effort:
    """How much is done: sizes of the workloads and how long they are timed."""

    rounds: int = 21
    least: float = 0.05
    counts: tuple[int, ...] = (1000, 100_000)
    points: int = 1000


FULL = Effort()
QUICK = Effort(3, 0.01, (1000,), 100)
"""For a look, and for the tests: seconds instead of minutes."""


def benchmark(folder: Path, effort: Effort, say: Callable[[str], None]) -> None:
    """
    Run everything; write the results.

    They are ``benchmark.json`` and two tables of it, ``benchmark.md`` and ``brief.md``.

    Raises DataError: a contender's result is not that of the others.
    """
    robot = calibrated_arm()
    peers, missing = find_peers(robot)
    for name, reason in missing.items():
        say(f'{name} is left out: {reason}')
    outcomes = []
    for workload in _workloads(effort, peers):
        outcomes.append(race(workload, effort.rounds, effort.least))
        for line in lines(outcomes[-1]):
            say(line)
    (folder / 'benchmark.md').write_text(page(outcomes), encoding='utf-8')
    (folder / 'brief.md').write_text(brief(outcomes), encoding='utf-8')
    results = {
        'schema': 'weld_twin/benchmark/1',
        'machine': _machine(),
        'left_out': missing,
        'workloads': [outcome.as_dict() for outcome in outcomes],
    }
    write_json(folder / 'benchmark.json', results)


def _workloads(effort: Effort, peers: dict[str, Peer]) -> Iterator[Workload]:
    robot = calibrated_arm()
    for count in effort.counts:
        yield from batches(robot, peers, count)
    yield single(robot, peers)
    yield inverse(effort.points, 'pinocchio' in peers)


def _machine() -> dict[str, Any]:
    versions = {'weld_twin': __version__}
    for package in ('numpy', 'scipy', *PACKAGES.values()):
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            continue
    return {
        'processor': _processor(),
        'processors': os.cpu_count(),
        'load': os.getloadavg()[0],
        'python': platform.python_version(),
        'versions': versions,
    }


def _processor() -> str:
    try:
        text = Path('/proc/cpuinfo').read_text(encoding='utf-8')
    except OSError:
        return platform.processor()
    names = [line.partition(':')[2] for line in text.splitlines() if line.startswith('model name')]
    return names[0].strip() if names else platform.machine()
