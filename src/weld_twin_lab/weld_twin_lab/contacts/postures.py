# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How many postures a place needs: at random, and as the program proposes them.

Arms whose every joint and link is a little wrong touch sockets at three places. What the model then
predicts is judged at a fourth place, which is never used.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.contacts import spreads
from weld_twin_core.diagnosis.advice.next_touches import next_touches
from weld_twin_core.diagnosis.algebra.fit import fit
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, Scale
from weld_twin_core.diagnosis.frames.aligned import aligned
from weld_twin_core.diagnosis.hypotheses.library import plain_causes
from weld_twin_core.recording import Recording

from ..blind.simulator import require_simulator
from ..study import Parts
from .sealed import ARMS
from .touching import postures_at, touching

SPOTS = {
    'a': (0.5, 0.1, 0.15),
    'b': (0.1, 0.5, 0.35),
    'c': (0.35, -0.35, 0.25),
}
"""Places [m] that are used, within reach of all arms."""
JUDGED = (0.3, 0.35, 0.45)
"""The place [m] that is not."""
ERRORS = {
    'joint_offset': ('offset', 1e-3),
    'link_length': ('da', 2e-4),
    'link_offset': ('dd', 2e-4),
    'link_twist': ('dalpha', 1e-3),
}
"""Spread of every error [rad, m], between what calibrations of a maker have corrected."""
SLACK = 3e-5
"""Of the ball in its socket [m], standard deviation of each coordinate."""
STEPS = (4, 6, 8, 10, 12, 16, 20)
"""Postures at every place that are tried at random."""
PLENTY = 50
"""Postures at every place that stand for all that touches can tell."""
FIRST = 4
"""Postures at every place before the program is asked for the next."""
ASKED = 2
"""Times that it is asked for a dozen more: twelve a place in the end."""
REACHABLE = 0.9
"""Share of the shrink that counts as reached."""


class _Cell(NamedTuple):
    """An arm that is wrong, and the postures in which its shrink is judged."""

    robot: Robot
    causes: list[dict[str, Any]]
    judged: Recording

    def left(self, model: Model) -> float:
        """Return the spread of predicted points at the place that is not used [m]."""
        points = model.twin(0).poses(self.judged, self.judged.joints.t).position
        assert self.judged.contacts is not None
        return float(np.concatenate(list(spreads(self.judged.contacts, points).values())).mean())

    def touched(self, q: Array, labels: Sequence[str], rng: np.random.Generator) -> Recording:
        """Return touches from postures near those wanted, with the ball's slack."""
        where = np.array([SPOTS[label] for label in labels])
        loose = where + rng.normal(0.0, SLACK, where.shape)
        return touching(self.robot, self.causes, q, labels, loose, (), rng)


def case(seed: int) -> dict[str, Any]:
    """
    Return the shrink of one arm with more and more postures, at random and as proposed.

    Parameters
    ----------
    seed : int
        Decides the arm, its errors and the postures.

    """
    rng = np.random.default_rng(seed)
    cell = _cell(seed, rng)
    pool = {label: postures_at(cell.robot, np.array(p), PLENTY, rng) for label, p in SPOTS.items()}
    every = cell.touched(*_taken(pool, PLENTY), rng)
    full, before = _left(cell, every)
    entry: dict[str, Any] = {'seed': seed, 'robot': cell.robot.name, 'before_m': before}
    entry |= {'plenty_m': full, 'random_m': {}, 'proposed_m': {}}
    for count in STEPS:
        entry['random_m'][count] = _left(cell, cell.touched(*_taken(pool, count), rng))[0]
    for count, recording in _proposed(cell, pool, rng):
        entry['proposed_m'][count] = _left(cell, recording)[0]
    return entry


def _cell(seed: int, rng: np.random.Generator) -> _Cell:
    tool = np.eye(4)
    tool[:3, 3] = [0.02, -0.03, 0.15]
    robot = catalog.load(ARMS[seed % len(ARMS)]).with_frames(tool=tool)
    causes = [
        {'effect': name, 'joint': joint, key: float(rng.normal(0.0, size))}
        for name, (key, size) in ERRORS.items()
        for joint in robot.joint_names
    ]
    where = np.array(JUDGED)
    q = postures_at(robot, where, PLENTY, rng)
    places = np.tile(where, (len(q), 1))
    return _Cell(robot, causes, touching(robot, causes, q, ['judged'] * len(q), places, (), rng))


def _taken(pool: dict[str, Array], count: int) -> tuple[Array, list[str]]:
    """Return the first postures of every place, and what each touches."""
    q = [own[:count] for own in pool.values()]
    labels = [label for label, own in pool.items() for _ in own[:count]]
    return np.concatenate(q), labels


def _left(cell: _Cell, recording: Recording) -> tuple[float, float]:
    """
    Return the spread that is left where nothing was used, and the nominal one [m].

    All constant errors and springs are fitted, as large as machines have them: what postures tell
    is asked, and not what a search makes of it.
    """
    problem, nominal = aligned(recording, cell.robot, '', ())
    view = problem.features(nominal)[0].view
    plain = nominal.with_found(tuple(plain_causes(cell.robot, view, ('constant', 'load'))))
    return cell.left(fit(problem, plain, _scale(problem)).model), cell.left(nominal)


def _scale(problem: Problem) -> Scale:
    return Scale(SLACK, 1.0, tuple(np.ones(m) for m in problem.samples))


def _proposed(
    cell: _Cell, pool: dict[str, Array], rng: np.random.Generator
) -> Iterator[tuple[int, Recording]]:
    """Yield touches with a dozen more each time, those that are proposed; never a new place."""
    q, labels = _taken(pool, FIRST)
    for _ in range(ASKED):
        recording = cell.touched(q, labels, rng)
        problem, model = aligned(recording, cell.robot, '', ())
        wanted = next_touches(problem, model, (), _scale(problem), elsewhere=False)
        if wanted is None:
            return
        q = np.concatenate([q, np.array(wanted['motion']['q'])])
        labels = [*labels, *wanted['motion']['contact']]
        yield len(q) // len(SPOTS), cell.touched(q, labels, rng)


def postures(count: int, part: Parts) -> dict[str, Any]:
    """
    Return which share of the reachable shrink so many postures a place give, in the mean.

    Parameters
    ----------
    count : int
        Arms.
    part : Parts
        Keeps every arm.

    """
    require_simulator()
    cases = [part(f'arm_{seed:03d}', partial(case, seed)) for seed in range(count)]
    score: dict[str, Any] = {'arms': len(cases)}
    for how in ('random_m', 'proposed_m'):
        shares: dict[str, list[float]] = {}
        for each in cases:
            reach = each['before_m'] - each['plenty_m']
            for number, left in each[how].items():
                shares.setdefault(number, []).append((each['before_m'] - left) / reach)
        mean = {number: float(np.mean(share)) for number, share in shares.items()}
        enough = [int(number) for number, share in mean.items() if share >= REACHABLE]
        score[how.removesuffix('_m')] = {'share': mean, 'enough': min(enough, default=None)}
    return score
