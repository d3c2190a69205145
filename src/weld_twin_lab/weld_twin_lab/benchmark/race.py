# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Contenders taking turns on the same arm, positions and seams: time and memory, and what came of it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time
from typing import IO, Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import transform
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files import markdown

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

    def screw(axis: str, angle: float, along: float) -> Array:
        turn = Rotation.from_euler(axis, angle).as_matrix()
        return transform(turn, along * np.eye(3)['xyz'.index(axis)])

    rows = zip(robot.theta, robot.d, robot.alpha, robot.a, strict=True)
    out = [np.array(robot.T_world_base)]
    out += [screw('z', theta, d) @ screw('x', alpha, a) for theta, d, alpha, a in rows]
    out[-1] = out[-1] @ robot.T_flange_tool
    return out


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
    load = outcome.workload
    yield f'{load.title} (per {load.item}; times: {REFERENCE} / contender)'
    for contender in load.contenders:
        seconds = float(np.median(outcome.seconds[contender.name]))
        yield f'  {contender.name:<26} {duration(seconds):>10}  {times(outcome, contender.name)}'
    if load.note:
        yield f'  {load.note}'


def page(outcomes: list[Outcome]) -> str:
    rows = [('workload', 'time', 'times as fast as', 'and as the others')]
    for outcome in outcomes:
        load = outcome.workload
        seconds = {name: float(np.median(own)) for name, own in outcome.seconds.items()}
        others = ', '.join(
            f'{c.name} {short(seconds[c.name] / seconds[OWN])}'
            for c in load.contenders
            if c.name not in (OWN, REFERENCE)
        )
        time = f'{duration(seconds[OWN])} per {load.item}'
        rows.append((load.title, time, f'{REFERENCE}: **{times(outcome, OWN)}**', others))
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
