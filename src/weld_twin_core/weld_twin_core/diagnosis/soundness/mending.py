# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Corrections of what was given: each takes recordings, robot and frames, and returns them.

Kept as a `functools.partial` of a function of this file, one can stand in diagnosis.json (`as_entry`)
and be made again on the same source (`replayed`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...arm import catalog
from ...arm.robot import Robot
from ...arm.rotation import matrix_from_quaternion, quaternion_from_matrix
from ...arrays import Array
from ...bursts import evenly
from ...errors import DataError, ModelError
from ...recording import JointSignal, Measurements, Recording, Signal

Sampled = TypeVar('Sampled', Signal, JointSignal)


@dataclass(frozen=True, eq=False)
class Given:
    recordings: tuple[Recording, ...]
    robot: Robot
    align: frozenset[str] = frozenset()  # frames to be fitted: 'base', 'tool'
    may_change: tuple[str, ...] = ()  # families that may differ between the recordings


Mend = Callable[[Given], Given]


def joints_as(given: Given, matrix: Array, offset: Array) -> Given:
    """
    Return what was given with joint positions q matrix' + offset, (n, n) and (n,) [rad or m].

    Efforts go with the joints that they are of, in the sense that these are counted in; they keep
    their size where only the unit of the positions was wrong.
    """
    matrix = np.asarray(matrix)

    def counted(own: Recording) -> Recording:
        qd = None if own.joints.qd is None else own.joints.qd @ matrix.T
        joints = replace(own.joints, q=own.joints.q @ matrix.T + np.asarray(offset), qd=qd)
        effort = own.effort
        if effort is not None:
            working = np.linalg.inv(matrix).T
            working /= np.abs(working).max(axis=1, keepdims=True)
            effort = replace(effort, value=effort.value @ working.T)
        return replace(own, joints=joints, effort=effort)

    return _with(given, counted)


def _with(
    given: Given, change: Callable[[Recording], Recording], only: int | None = None
) -> Given:
    pairs = enumerate(given.recordings)
    made = (change(own) if only in (None, k) else own for k, own in pairs)
    return replace(given, recordings=tuple(made))


def positions_as(given: Given, factor: Array) -> Given:
    """Return it with measured positions times a factor (3,); a mirrored frame has no orientations."""

    def scaled(seen: Measurements) -> Measurements:
        turn = None if np.prod(factor) < 0.0 else seen.rotation
        # How sure they are was given for what has proved to be something else.
        return Measurements(seen.t, seen.position * np.asarray(factor), turn, seen.sigma)

    return _seen_as(given, scaled)


def _seen_as(
    given: Given, change: Callable[[Measurements], Measurements], only: int | None = None
) -> Given:
    """Return what was given with other measurements, of one recording or of all that have some."""

    def seen(own: Recording) -> Recording:
        return own if own.measured is None else own.with_measured(change(own.measured))

    return _with(given, seen, only)


WAYS: dict[str, tuple[str, Callable[[Array], Array]]] = {
    'inverted': (
        'Measured orientations are those of the instrument seen from the tool (inverted)',
        lambda turn: np.swapaxes(turn, -1, -2),
    ),
    'w_first': (
        'Quaternions were written w first and read x first',
        lambda turn: _rolled(turn, -1),
    ),
    'w_last': (
        'Quaternions were written x first and read w first',
        lambda turn: _rolled(turn, 1),
    ),
}
"""Ways to write orientations that get mixed up: in words, and what undoes it."""


def _rolled(turn: Array, places: int) -> Array:
    return matrix_from_quaternion(np.roll(quaternion_from_matrix(turn), places, axis=-1))


def turns_as(given: Given, way: str) -> Given:
    """Return what was given with measured rotations, shape (M, 3, 3), by one of `WAYS`."""

    def turned(seen: Measurements) -> Measurements:
        turn = None if seen.rotation is None else WAYS[way][1](seen.rotation)
        return Measurements(seen.t, seen.position, turn, seen.sigma)

    return _seen_as(given, turned)


def poses_inverted(given: Given) -> Given:
    return _seen_as(given, lambda seen: seen if seen.rotation is None else seen.inverted())


def robot_as(given: Given, name: str) -> Given:
    """Return what was given with a bundled robot that stands where the first did, same tool."""
    base, tool = given.robot.T_world_base, given.robot.T_flange_tool
    return replace(given, robot=catalog.load(name).with_frames(base=base, tool=tool))


def differing(given: Given, families: tuple[str, ...]) -> Given:
    return replace(given, may_change=tuple(dict.fromkeys([*given.may_change, *families])))


def frames_fitted(given: Given, frames: Iterable[str]) -> Given:
    return replace(given, align=given.align | frozenset(frames))


def base_turned(given: Given, turn: Array) -> Given:
    """Return what was given with the base turned about its own axes, rotation shape (3, 3)."""
    base = np.array(given.robot.T_world_base)
    base[:3, :3] = base[:3, :3] @ np.asarray(turn)
    return replace(given, robot=given.robot.with_frames(base=base))


def stamps_as(given: Given, k: int, late: float, rate: float, middle: float) -> Given:
    """
    Return what was given with the arm's own stamps of recording k on the measurements' clock.

    Measurements, and so all that is reported, keep their own: they are ``late`` [s] at ``middle`` [s],
    and get later by ``rate`` with every second of theirs [s/s].
    """

    def moved(t: Array) -> Array:
        return np.asarray((t + late - rate * middle) / (1.0 - rate))

    def signal(of: Sampled | None) -> Sampled | None:
        return None if of is None else replace(of, t=moved(of.t))

    def stamped(own: Recording) -> Recording:
        qd = None if own.joints.qd is None else own.joints.qd * (1.0 - rate)
        return replace(
            own,
            joints=replace(own.joints, t=moved(own.joints.t), qd=qd),
            wrench=signal(own.wrench),
            temperature=signal(own.temperature),
            effort=signal(own.effort),
        )

    return _with(given, stamped, k)


def stamped_evenly(
    given: Given,
    k: int,
    first: float,
    step: float,
    lost: Sequence[int] | NDArray[np.int_],
    count: int,
) -> Given:
    """
    Return what was given with measurements of recording k stamped by an even clock [s].

    lost: samples before which one is missing.
    count: how many measurements had these stamps; others in the same time take their share.
    """

    def stamped(seen: Measurements) -> Measurements:
        missing = np.asarray(lost, dtype=int)
        return replace(seen, t=evenly(first, step, missing, seen.t.size, count))

    return _seen_as(given, stamped, only=k)


def repaired(
    given: Given,
    k: int,
    reading: Sequence[int] | NDArray[np.int_],
    station: Sequence[int] | NDArray[np.int_],
    count: int,
) -> Given:
    """
    Return what was given with readings of recording k beside the stations where they were taken.

    reading, station: rows, in order, of each reading and of its station; other readings are left out.
    count: how many readings that recording had; one with another number is left as it is.
    """

    def put(seen: Measurements) -> Measurements:
        if seen.t.size != count:
            return seen
        own = np.asarray(reading, dtype=int)
        return replace(seen.take(own), t=seen.t[np.asarray(station, dtype=int)])

    return _seen_as(given, put, only=k)


def velocities_left_out(given: Given, k: int) -> Given:
    return _with(given, lambda own: replace(own, joints=replace(own.joints, qd=None)), k)


MENDS: dict[str, Callable[..., Given]] = {
    'joints': joints_as,
    'positions': positions_as,
    'orientations': turns_as,
    'poses_inverted': poses_inverted,
    'robot': robot_as,
    'frames': frames_fitted,
    'base': base_turned,
    'stamps': stamps_as,
    'even_stamps': stamped_evenly,
    'rows': repaired,
    'may_change': differing,
    'velocities': velocities_left_out,
}
"""What diagnosis.json calls each correction."""
ONE = 'k'
"""What a correction of one recording alone calls its number."""


def as_entry(mend: Mend | None) -> dict[str, Any] | None:
    """Return a correction as plain values, for diagnosis.json; None for none."""
    if not isinstance(mend, partial):
        return None
    values = {key: _plain(value) for key, value in mend.keywords.items()}
    return next(({'do': name, **values} for name, f in MENDS.items() if f is mend.func), None)


def _plain(value: Any) -> Any:
    if isinstance(value, frozenset | set | tuple):
        return sorted(value)
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def replayed(entries: Sequence[Mapping[str, Any]], given: Given, which: int = 0) -> Given:
    """
    Return what is given after the corrections of a diagnosis, in order; ModelError if one misfits.

    given: one recording of the same source, or none for the robot alone.
    which: which recording of that diagnosis it is: some corrections are of one alone.
    """
    for entry in entries:
        own = dict(entry)
        made = MENDS.get(own.pop('do', ''))
        if made is None:
            raise ModelError(f'no correction of data is known that is {entry!r}')
        if ONE in own:
            if own[ONE] != which or not given.recordings:
                continue
            own[ONE] = 0
        try:
            given = made(given, **own)
        except (TypeError, ValueError, KeyError, IndexError, DataError) as error:
            raise ModelError(f'a correction of data cannot be made again: {error}') from None
    return given
