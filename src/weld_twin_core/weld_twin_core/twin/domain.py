# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What was recorded, how far outside of it a motion goes, in words, and what to apply there."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arm.chain import forward
from ..arm.robot import Robot
from ..arrays import Array
from ..recording import Recording

_LEAST_MARGIN = 0.02
"""A joint this near [rad or m] to where it was recorded counts as recorded there: one degree."""
_MOST_MARGIN = 0.8
"""Never farther than this [rad or m], however few stations there are."""
_LEFT_OUT = 0.95
"""Share of the measurements, each left out in turn, that shall lie inside what the others show."""
_WIDER = 1.5
"""The margin in units of what that takes: with six joints and few stations the next one lies
outside more often than the last one did."""
_AS_FAR_AGAIN = 1.0
"""From fewer than 19 measurements no distance can be read that holds 95 of 100: a joint then counts
as recorded as far beyond as it moved, in units of its range."""
_SPACINGS = 3.0
"""At least so many mean distances between neighbours: of stations drawn evenly a further one lies
nearer than that to one of them, joint by joint, in 95 of 100 cases."""
_SPEED_MARGIN = (1.25, 0.05)
"""Faster than recorded from this factor and this much [rad/s or m/s] on: differences ring."""
_LOAD_MARGIN = (1.25, 5.0)
"""The same of force [N] and torque [N m]: force sensors drift by some newtons."""
_WARM_MARGIN = 2.0
"""Warmer or colder than recorded from here on [K]; thermometers stand anywhere."""

_FADES = 4.0
"""Margins beyond the first over which doubt sets in: commands must not jump at a border."""


_TESTED = 3
"""Places from which on each can be left out and foretold from the others."""
_ALONE = 0.1
"""Distance [m] from a place within which it is believed where no place could be left out: that of a
plate with sockets. Of an arm touched at one place alone, a third of the others came out worse."""


@dataclass(frozen=True, eq=False)
class Spots:
    """Where contacts were, as the arm has it."""

    robot: Robot
    """It says where a posture has the tool point."""
    at: Array
    """The middle of every place, seen from the base, shape (P, 3) [m]."""
    reach: float
    """How far from the nearest of them the model was tested: the greatest distance from a place to
    the next, as each was foretold from the others [m]."""

    @classmethod
    def of(cls, recordings: Sequence[Recording], robot: Robot) -> Spots | None:
        """Return the places of contacts, a recording each; None where an instrument measured."""
        if any(recording.contacts is None for recording in recordings):
            return None
        bare = robot.with_frames(base=np.eye(4))
        at = np.array([_points(bare, r.joints.q).mean(axis=0) for r in recordings])
        reach = _ALONE
        if len(at) >= _TESTED:
            apart = np.linalg.norm(at[:, None] - at, axis=2) + np.diag(np.full(len(at), np.inf))
            reach = max(reach, float(apart.min(axis=1).max()))
        return cls(bare, at, reach)

    def away(self, q: Array) -> Array:
        """Return how far the tool point is from the nearest place, shape (M,) [m]."""
        points = _points(self.robot, q)
        return np.asarray(np.linalg.norm(points[:, None] - self.at, axis=2).min(axis=1))

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers and lists."""
        return {'at': self.at.tolist(), 'reach': self.reach}


def _points(robot: Robot, q: Array) -> Array:
    return np.asarray(forward(robot, q)[:, :3, 3])


_Look = tuple[NDArray[np.bool_], Callable[[slice], str]]
"""Which samples lie outside what was recorded, and why those of a stretch do."""


class Outside(NamedTuple):
    """A stretch of a motion outside what was recorded: first and last sample, and why."""

    first: int
    last: int
    why: str


@dataclass(frozen=True, eq=False)
class Domain:
    """What the recordings have shown."""

    joints: tuple[str, ...]
    ranges: tuple[tuple[tuple[float, float], ...], ...]
    """For every joint the intervals measured, in order [rad or m]; angles by their median's turn."""
    margins: tuple[float, ...]
    """How far beyond an interval a joint still counts as recorded there [rad or m]."""
    turns: tuple[bool, ...]
    """Joints whose angle means the same after a full turn."""
    speeds: tuple[float, ...] | None = None
    """Fastest measured motion of every joint [rad/s or m/s]; None for stations at rest."""
    load: tuple[float, float] | None = None
    """Largest force [N] and torque [N m] on the tool; None where no wrench was recorded."""
    temperature: tuple[float, float] | None = None
    """Lowest and highest [degC]; None where it was not recorded."""
    spots: Spots | None = None
    """The places that were touched; None where an instrument measured."""

    @classmethod
    def of(cls, recordings: Sequence[Recording], robot: Robot) -> Domain:
        """Return what measurements of some recordings have shown."""
        pairs = [_measured(r) for r in recordings]
        turns = ~np.asarray(robot.prismatic)
        q = _near_the_middle(np.concatenate([pair[0] for pair in pairs]), turns)
        moving = [
            pair[1] for r, pair in zip(recordings, pairs, strict=True) if not r.joints.static
        ]
        gaps = _gaps(q)
        speeds = None
        if moving:
            speeds = tuple(float(v) for v in np.abs(np.concatenate(moving)).max(axis=0))
        return cls(
            robot.joint_names,
            tuple(_intervals(q[:, i], gap) for i, gap in enumerate(gaps)),
            tuple(float(m) for m in np.minimum(gaps, _MOST_MARGIN)),
            tuple(bool(turn) for turn in turns),
            speeds,
            _load(recordings),
            _temperature(recordings),
            Spots.of(recordings, robot),
        )

    def beyond(self, q: Array) -> Array:
        """Return how far joints (M, n) are from where they were measured, angles modulo a full turn."""
        out = np.empty(q.shape)
        for i, intervals in enumerate(self.ranges):
            low, high = np.array(intervals).T
            shifts = (-2.0 * np.pi, 0.0, 2.0 * np.pi) if self.turns[i] else (0.0,)
            away = [
                np.maximum(np.maximum(low - v, v - high), 0.0).min(axis=1)
                for v in (q[:, i, None] + shift for shift in shifts)
            ]
            out[:, i] = np.min(away, axis=0)
        return out

    def trust(self, q: Array, correction: Array, covariance: Array) -> Array:
        """
        Return the share of a correction to apply to each pose, shape (M,).

        All of it where it was recorded. Beyond, as much as makes the expected squared error least:
        the square of the correction over that square and the variance of what it is based on, so
        that a correction smaller than its own uncertainty is mostly left away.

        q: shape (M, n).
        correction: by how much the model would move the tool, shape (M, 3) [m].
        covariance: of the position that the model gives, shape (M, 3, 3) [m^2].
        """
        size = (correction**2).sum(axis=1)
        doubt = np.trace(covariance, axis1=1, axis2=2)
        best = size / np.maximum(size + doubt, 1e-300)
        beyond = (self.beyond(q) / np.array(self.margins)).max(axis=1)
        apart = np.clip((beyond - 1.0) / _FADES, 0.0, 1.0)
        smooth = apart**2 * (3.0 - 2.0 * apart)
        return np.asarray(1.0 - smooth * (1.0 - best))

    def outside(
        self,
        q: Array,
        qd: Array | None = None,
        wrench: Array | None = None,
        temperature: Array | None = None,
    ) -> list[Outside]:
        """
        Return the stretches of a motion that lie outside what was recorded, by reason.

        q, qd: ``qd`` is left out for stations at rest, shape (M, n).
        wrench: shape (M, 6) [N, N m].
        temperature: shape (M,) [degC].
        """
        looks = [*self._postures(q), *self._others(q, qd, wrench, temperature)]
        return sorted(
            Outside(first, last, why(slice(first, last + 1)))
            for beyond, why in looks
            for first, last in _runs(beyond)
        )

    def unlike(self, recording: Recording, at: Array) -> NDArray[np.bool_]:
        """
        Return where a motion is outside for another reason than where its joints are, shape (M,).

        It is faster, carries more, is warmer or colder, or is far from all places that were touched. Of
        motions stations tell nothing, neither that they are as ever nor that they are not.

        at: shape (M,) [s].
        """
        q, qd, *more = as_seen(recording, at)
        looks = self._others(q, None if self.speeds is None else qd, *more)
        out = np.zeros(at.size, dtype=bool)
        for beyond, _ in looks:
            out |= beyond
        return out

    def _others(
        self, q: Array, qd: Array | None, wrench: Array | None, temperature: Array | None
    ) -> Iterator[_Look]:
        if self.spots is not None:
            yield self._places(self.spots, q)
        if qd is not None:
            yield self._speeds(np.abs(qd))
        if wrench is not None:
            yield from self._loads(wrench)
        if temperature is not None and self.temperature is not None:
            yield self._warmth(temperature, *self.temperature)

    def _postures(self, q: Array) -> Iterator[_Look]:
        away = self.beyond(q)
        for i, name in enumerate(self.joints):

            def why(part: slice, i: int = i, name: str = name) -> str:
                far = f'{away[part, i].max():.2g} {self._unit(i)}'
                return f'{name} is {far} beyond what was recorded'

            yield away[:, i] > self.margins[i], why

    @staticmethod
    def _places(spots: Spots, q: Array) -> _Look:
        far = spots.away(q)
        return (
            far > spots.reach,
            lambda part: (
                f'the tool is {far[part].max():.2g} m from the nearest place that was touched, '
                f'and the model was tested to {spots.reach:.2g} m'
            ),
        )

    def _unit(self, i: int) -> str:
        return 'rad' if self.turns[i] else 'm'

    def _speeds(self, speed: Array) -> _Look:
        known = np.zeros(len(self.joints)) if self.speeds is None else np.array(self.speeds)
        limit = _SPEED_MARGIN[0] * known + _SPEED_MARGIN[1]

        def why(part: slice) -> str:
            i = int((speed[part] / limit).max(axis=0).argmax())
            unit = f'{self._unit(i)}/s'
            recorded = f'at most {known[i]:.2g} {unit} was recorded'
            if self.speeds is None:
                recorded = 'only stations at rest were recorded'
            return f'{self.joints[i]} moves at up to {speed[part, i].max():.2g} {unit}, {recorded}'

        return np.asarray((speed > limit).any(axis=1)), why

    def _loads(self, wrench: Array) -> Iterator[_Look]:
        sizes = np.linalg.norm(wrench.reshape(-1, 2, 3), axis=2).T
        for size, known, name, unit in zip(
            sizes, self.load or (0.0, 0.0), ('force', 'torque'), ('N', 'N m'), strict=True
        ):

            def why(
                part: slice,
                size: Array = size,
                known: float = known,
                name: str = name,
                unit: str = unit,
            ) -> str:
                most = f'{size[part].max():.3g} {unit}, at most {known:.3g} {unit} was recorded'
                return f'the {name} on the tool is up to {most}'

            yield size > _LOAD_MARGIN[0] * known + _LOAD_MARGIN[1], why

    def _warmth(self, temperature: Array, low: float, high: float) -> _Look:
        off = np.maximum(low - temperature, temperature - high)
        return (
            off > _WARM_MARGIN,
            lambda part: (
                f'it is {off[part].max():.2g} K beyond the {low:.1f} to {high:.1f} degC that were '
                'recorded'
            ),
        )

    def sentences(self) -> list[str]:
        """Return the joint ranges as people read them, one sentence for each joint."""
        out = []
        for name, intervals, turns in zip(self.joints, self.ranges, self.turns, strict=True):
            factor, unit = (180.0 / np.pi, 'deg') if turns else (1e3, 'mm')
            spans = ' and '.join(
                f'{low * factor:.1f} to {high * factor:.1f}' for low, high in intervals
            )
            out.append(f'{name}: {spans} {unit}')
        return out

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers and lists."""
        return {
            'joints': [
                {
                    'name': name,
                    'measured': [list(pair) for pair in intervals],
                    'margin': margin,
                    'turns': turns,
                }
                for name, intervals, margin, turns in zip(
                    self.joints, self.ranges, self.margins, self.turns, strict=True
                )
            ],
            'speeds': None if self.speeds is None else list(self.speeds),
            'load': None if self.load is None else list(self.load),
            'temperature': None if self.temperature is None else list(self.temperature),
            **({} if self.spots is None else {'spots': self.spots.as_dict()}),
        }


def as_seen(
    recording: Recording, at: Array
) -> tuple[Array, Array | None, Array | None, Array | None]:
    """Return what `Domain.outside` asks of a recording at stamps, shape (M,) [s]."""
    q, qd = recording.joints.at(at)
    wrench, warm = recording.wrench, recording.temperature
    return (
        q,
        None if recording.joints.static else qd,
        None if wrench is None else wrench.at(at),
        None if warm is None else warm.at(at),
    )


def _runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """Return first and last index of every run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]


def _measured(recording: Recording) -> tuple[Array, Array]:
    """Return position and velocity of the joints where the tool was measured."""
    measured = recording.measured
    return recording.joints.at(recording.joints.t if measured is None else measured.t)


def _gaps(q: Array) -> Array:
    """Return how far joints may be and still count as recorded (n,), by leaving out each in turn."""
    span = np.maximum(np.ptp(q, axis=0), 1e-9)
    order = np.argsort(q, axis=0)
    steps = np.diff(np.take_along_axis(q, order, axis=0), axis=0)
    edge = np.full((1, q.shape[1]), np.inf)
    nearest = np.minimum(np.concatenate([edge, steps]), np.concatenate([steps, edge]))
    apart = np.empty_like(nearest)
    np.put_along_axis(apart, order, nearest, axis=0)
    worst = np.sort((np.where(np.isfinite(apart), apart, 0.0) / span).max(axis=1))
    at = min(int(np.ceil(_LEFT_OUT * (worst.size + 1))), worst.size) - 1
    share = max(_WIDER * worst[at], _SPACINGS / max(worst.size - 1, 1))
    if np.ceil(_LEFT_OUT * (worst.size + 1)) > worst.size:
        share = max(share, _AS_FAR_AGAIN)
    return np.asarray(np.maximum(_LEAST_MARGIN, share * span))


def _near_the_middle(q: Array, turns: NDArray[np.bool_]) -> Array:
    """Return angles within half a turn of their median; what slides stays."""
    off = q - np.median(q, axis=0)
    return np.asarray(q - np.where(turns, 2.0 * np.pi * np.round(off / (2.0 * np.pi)), 0.0))


def _intervals(values: Array, gap: float) -> tuple[tuple[float, float], ...]:
    """Return where a joint was, holes of less than two gaps closed."""
    ordered = np.sort(values)
    cuts = np.flatnonzero(np.diff(ordered) > 2.0 * gap)
    lows = ordered[np.concatenate([[0], cuts + 1])]
    highs = ordered[np.concatenate([cuts, [ordered.size - 1]])]
    return tuple((float(a), float(b)) for a, b in zip(lows, highs, strict=True))


def _load(recordings: Sequence[Recording]) -> tuple[float, float] | None:
    values = [r.wrench.value for r in recordings if r.wrench is not None]
    if not values:
        return None
    parts = np.linalg.norm(np.concatenate(values).reshape(-1, 2, 3), axis=2).max(axis=0)
    return float(parts[0]), float(parts[1])


def _temperature(recordings: Sequence[Recording]) -> tuple[float, float] | None:
    values = [r.temperature.value for r in recordings if r.temperature is not None]
    if not values:
        return None
    return float(min(v.min() for v in values)), float(max(v.max() for v in values))
