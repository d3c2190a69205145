# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Postures that an experiment may use, and ways between them: within limits, and free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...arm.clearance import Space
from ...arm.robot import Robot
from ...arrays import Array, halton, spread_over
from ...errors import DataError
from ...recording import JointMotion
from ..algebra.problem import Problem

USUAL_MINUTES = 60.0
"""Of robot motion that an experiment takes at most, unless given: an arm warms up in an hour."""


@dataclass(frozen=True, eq=False)
class Limits:
    """
    What an experiment may cost, and where it has to stay.

    Raises DataError: the minutes are not positive, or a box has no room.
    """

    minutes: float = USUAL_MINUTES
    """Of robot motion and of what has to be set up for it, at most [min]."""
    moving: float = np.inf
    """Of robot motion alone, at most [min]."""
    set_up: bool = True
    """Whether something in the cell may be changed for it: another tool, a moved instrument."""
    box: Array | None = None
    """Corners in the measuring frame that the arm stays between, shape (2, 3) [m]."""
    confirm: bool = False
    """Whether one is asked for where the question is closed, but some joints did not move widely:
    what depends on their angle looks like something else."""

    def __post_init__(self) -> None:
        least = min(self.minutes, self.moving)
        if not least > 0.0:
            raise DataError(f'an experiment needs minutes, got {least:g}')
        if self.box is None:
            return
        box = np.array(self.box, dtype=float)
        if box.shape != (2, 3) or not (box[0] < box[1]).all():
            raise DataError('the box of the cell is two corners, the lower one first, in metres')
        object.__setattr__(self, 'box', box)


_WIDE = 1.2
"""Half the range [rad, m] about the recorded middle that every joint may use, within its limits: the
instrument still sees the tool, and the arm does not turn over."""
STEP = 0.02
"""Approach of a station from either side [rad, m], for which there is room to a joint's limits."""
_DRAWN = 12
"""Postures drawn for each that is wanted, before fewer have to do."""
_LOOKED_FOR = 2000
"""Postures that are drawn to find one in the box of the cell."""
_CHECKED = 8
"""Places of a way between two postures that are checked."""
_GENTLE = 0.5
"""Share of the joints' limits of velocity and acceleration that an experiment uses at most."""
_RATE = 100.0
"""Samples per second that a path is predicted with."""


class Room:
    """
    Where an arm may go in an experiment; what was recorded, there it has been.

    ``home`` (n,) is the recorded posture in the middle of all, or the nearest to it that lies in
    the box; ``low`` and ``high`` are the range about it [rad, m]. Raises DataError: the box of the
    cell holds no posture near those recorded.
    """

    def __init__(self, problem: Problem, robot: Robot, limits: Limits) -> None:
        q = np.concatenate([r.joints.q for r in problem.recordings])
        self._robot, self._limits = robot, limits
        self._seen = q[spread_over(len(q), 50)]
        self.free = Space(robot, self._seen, limits.box).free
        middle = np.median(problem.recordings[0].joints.q, axis=0)
        self.home = q[int(np.argmin(np.abs(q - middle).sum(axis=1)))]
        inset = np.where(np.isfinite(robot.upper - robot.lower), STEP, 0.0)
        self.low = np.maximum(np.minimum(self.home - _WIDE, q.min(axis=0)), robot.lower + inset)
        self.high = np.minimum(np.maximum(self.home + _WIDE, q.max(axis=0)), robot.upper - inset)
        self.low = np.minimum(self.low, self.home)
        self.high = np.maximum(self.high, self.home)
        if limits.box is not None and not self.free(self.home[None])[0]:
            self.home = self._inside(middle)

    def _inside(self, middle: Array) -> Array:
        """Return the free posture nearest to the middle, of those recorded or drawn."""
        drawn = self.low + halton(self._robot.n, _LOOKED_FOR) * (self.high - self.low)
        for places in (self._seen, drawn):
            inside = places[self.free(places)]
            if len(inside):
                return np.asarray(inside[int(np.argmin(np.abs(inside - middle).sum(axis=1)))])
        raise DataError(
            'the box of the cell holds no posture near those recorded; give it more room, in the '
            'measuring frame and in metres'
        )

    def passed(self, q: Array) -> bool:
        """Return whether a motion that was recorded may be made again: it was free; in the box?"""
        return self._limits.box is None or bool(self.free(q).all())

    def spread(self, count: int, skip: int = 0) -> Array:
        """
        Return free postures that fill the range evenly, as far as there are, (count, n).

        The way from home to each is free too; later experiments ``skip`` some to go elsewhere.
        """
        unit = halton(self._robot.n, skip + _DRAWN * count)[skip:]
        q = self.low + unit * (self.high - self.low)
        some = q[np.flatnonzero(self.free(q))[: 2 * count]]
        kept = some[self._ways(np.broadcast_to(self.home, some.shape), some)][:count]
        if len(kept) >= min(count, 4) or self._limits.box is not None:
            return np.asarray(np.concatenate([kept, self.home[None]]) if len(kept) < 4 else kept)
        # Hardly anything is free: stay near to where the arm was.
        return np.asarray(self.home + 0.2 * (q[:count] - self.home))

    def way(self, stops: Sequence[Array]) -> bool:
        places = np.array(stops)
        return bool(self._ways(places[:-1], places[1:]).all())

    def _ways(self, start: Array, end: Array) -> Array:
        """Return which straight ways, between postures of shape (K, n) each, are free, (K,)."""
        share = np.linspace(0.0, 1.0, _CHECKED + 1)[:, None]
        places = start[:, None] + share * (end - start)[:, None]
        good = self.free(places.reshape(-1, self._robot.n))
        return np.asarray(good.reshape(len(start), _CHECKED + 1).all(axis=1))

    def linked(self, q: Array) -> Array:
        """Return stations with a stop at home wherever the straight way to the next is not free."""
        out = [q[0]]
        for place, good in zip(q[1:], self._ways(q[:-1], q[1:]), strict=True):
            out += [place] if good else [self.home, place]
        return np.array(out)

    def travel(self, stops: Sequence[Array], speed: float) -> JointMotion:
        """Return the motion from stop to stop, (n,), at rest at each, at a share of fastest."""
        robot = self._robot
        fastest, hardest = robot.max_velocity, robot.max_acceleration
        fast = _GENTLE * speed * np.where(np.isfinite(fastest), fastest, 1.0)
        hard = _GENTLE * np.where(np.isfinite(hardest), hardest, 5.0)
        pieces = [np.asarray(stops[0])[None]]
        for start, end in pairwise(stops):
            way = np.abs(end - start)
            # A cosine is pi/2 times faster than its mean, and hardest at its ends.
            span = max(
                float((np.pi / 2.0 * way / fast).max()),
                float(np.pi * np.sqrt(way / 2.0 / hard).max()),
                4.0 / _RATE,
            )
            count = int(np.ceil(span * _RATE))
            s = (1.0 - np.cos(np.pi * np.arange(1, count + 1) / count)) / 2.0
            pieces.append(start + s[:, None] * (end - start))
        q = np.concatenate(pieces)
        return JointMotion(np.arange(len(q)) / _RATE, q)


def joined(*motions: JointMotion) -> JointMotion:
    """Return motions one after the other; each begins where the one before ends."""
    t, q = motions[0].t, motions[0].q
    for motion in motions[1:]:
        t = np.concatenate([t, t[-1] + motion.t[1:] - motion.t[0]])
        q = np.concatenate([q, motion.q[1:]])
    return JointMotion(t, q)


_REACH = 1.3
"""The recorded range of every joint is widened by this factor, within its limits, for touches."""
_LEAST = 0.35
"""Half the range [rad, m] that touches use at least."""


def widened(problem: Problem, robot: Robot) -> tuple[Array, Array]:
    """Return the least and most of every joint that a touch uses: as recorded, a little wider, (n,)."""
    q = np.concatenate([r.joints.q for r in problem.recordings])
    middle = (q.min(axis=0) + q.max(axis=0)) / 2.0
    half = np.maximum(_REACH / 2.0 * np.ptp(q, axis=0), _LEAST)
    inset = np.where(np.isfinite(robot.upper - robot.lower), STEP, 0.0)
    low = np.maximum(middle - half, robot.lower + inset)
    high = np.maximum(np.minimum(middle + half, robot.upper - inset), low)
    return np.asarray(low), np.asarray(high)
