# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark from start to end."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core import __version__
from weld_twin_core.arm.bulk import BulkKernel
from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.single_pose import SinglePose
from weld_twin_core.arrays import Array
from weld_twin_core.motion.inverse import solve_path
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.files.whole_files import write_json

from .peers import PACKAGES, Peer, find_peers
from .race import (
    OWN,
    REFERENCE,
    Contender,
    Workload,
    brief,
    calibrated_arm,
    lines,
    page,
    race,
    random_positions,
    smooth_motion,
)

PLAIN = 'weld_twin, plain chain'
LOOPED = 500
"""Poses that peers are timed on: they loop, so that the time per pose does not depend on how many."""
CHAINED = 4096
"""Poses that the plain chain is timed on at the most: fewer than it hands to the kernels."""
EXACT = 1e-12
"""Difference [m or rad] that rounding may leave between two ways to the same number."""


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
    """Run everything, and write benchmark.json and two tables; raises DataError where results differ."""
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
        yield _poses(robot, peers, count)
        yield _jacobians(robot, peers, count)
        yield _derivatives(robot, peers, count)
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
