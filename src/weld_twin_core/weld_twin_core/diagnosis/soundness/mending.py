# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Corrections of what was given: each takes recordings, robot and frames, and returns them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...arm.robot import Robot
from ...arrays import Array
from ...bursts import evenly
from ...errors import DataError
from ...recording import Measurements, Recording


@dataclass(frozen=True, eq=False)
class Given:
    """
    What a diagnosis is given.

    Attributes
    ----------
    recordings : tuple of Recording
    robot : Robot
    align : frozenset of str
        Frames to be fitted: 'base', 'tool'.
    may_change : tuple of str
        Families that may differ between the recordings.

    """

    recordings: tuple[Recording, ...]
    robot: Robot
    align: frozenset[str] = frozenset()
    may_change: tuple[str, ...] = ()


Mend = Callable[[Given], Given]


def joints_as(given: Given, matrix: Array, offset: Array) -> Given:
    """
    Return what was given with joint positions q matrix' + offset.

    Parameters
    ----------
    given : Given
        Recordings, robot and frames as they were given.
    matrix : array, shape (n, n)
    offset : array, shape (n,) [rad or m]

    """
    out = []
    for r in given.recordings:
        qd = None if r.joints.qd is None else r.joints.qd @ matrix.T
        joints = replace(r.joints, q=r.joints.q @ matrix.T + offset, qd=qd)
        out.append(replace(r, joints=joints))
    return replace(given, recordings=tuple(out))


def positions_as(given: Given, factor: Array) -> Given:
    """
    Return what was given with measured positions times a factor per axis, shape (3,).

    A mirrored frame has no orientations; they are left out.
    """
    out = []
    for r in given.recordings:
        seen = measured(r)
        turn = None if np.prod(factor) < 0.0 else seen.rotation
        out.append(r.with_measured(replace(seen, position=seen.position * factor, rotation=turn)))
    return replace(given, recordings=tuple(out))


def turns_as(given: Given, undo: Callable[[Array], Array]) -> Given:
    """Return what was given with measured rotations, shape (M, 3, 3), changed."""
    out = []
    for r in given.recordings:
        seen = measured(r)
        turn = None if seen.rotation is None else undo(seen.rotation)
        out.append(r.with_measured(replace(seen, rotation=turn)))
    return replace(given, recordings=tuple(out))


def poses_inverted(given: Given) -> Given:
    """Return what was given with measured poses inverted; points stay as they are."""
    out = []
    for r in given.recordings:
        posed = r.measured is not None and r.measured.rotation is not None
        out.append(r.with_measured(measured(r).inverted()) if posed else r)
    return replace(given, recordings=tuple(out))


def robot_as(given: Given, robot: Robot) -> Given:
    """Return what was given with another robot that stands where the first did, same tool."""
    placed = robot.with_frames(base=given.robot.T_world_base, tool=given.robot.T_flange_tool)
    return replace(given, robot=placed)


def differing(given: Given, families: tuple[str, ...]) -> Given:
    """Return what was given with errors of more families that may differ between recordings."""
    return replace(given, may_change=tuple(dict.fromkeys([*given.may_change, *families])))


def frames_fitted(given: Given, frames: frozenset[str]) -> Given:
    """Return what was given with more frames to be fitted."""
    return replace(given, align=given.align | frames)


def base_turned(given: Given, turn: Array) -> Given:
    """Return what was given with the base turned about its own axes, rotation shape (3, 3)."""
    base = np.array(given.robot.T_world_base)
    base[:3, :3] = base[:3, :3] @ turn
    return replace(given, robot=given.robot.with_frames(base=base))


def stamps_as(given: Given, k: int, late: float, rate: float, middle: float) -> Given:
    """
    Return what was given with measurements of recording k earlier by a lag [s] and its rate.

    Parameters
    ----------
    given : Given
        Recordings, robot and frames as they were given.
    k : int
        Which recording, counted from 0.
    late : float [s]
        How late its measurements are in the middle.
    rate : float [s/s]
        How much later they get with every second.
    middle : float [s]
        The instant that ``late`` belongs to.

    """
    recordings = list(given.recordings)
    seen = measured(recordings[k])
    earlier = seen.t - (late + rate * (seen.t - middle))
    recordings[k] = recordings[k].with_measured(replace(seen, t=earlier))
    return replace(given, recordings=tuple(recordings))


def stamped_evenly(
    given: Given,
    k: int,
    first: float,
    step: float,
    lost: Sequence[int] | NDArray[np.int_],
    count: int,
) -> Given:
    """
    Return what was given with measurements of recording k stamped by an even clock.

    Parameters
    ----------
    given : Given
        Recordings, robot and frames as they were given.
    k : int
        Which recording, counted from 0.
    first, step : float [s]
        The first stamp, and the time from one to the next.
    lost : array of int
        Samples before which one is missing.
    count : int
        How many measurements had these stamps; of as many in the same time as there are now, each
        takes its share.

    """
    recordings = list(given.recordings)
    seen = recordings[k].measured
    if seen is None:
        return given
    even = evenly(first, step, np.asarray(lost, dtype=int), seen.t.size, count)
    recordings[k] = recordings[k].with_measured(replace(seen, t=even))
    return replace(given, recordings=tuple(recordings))


def velocities_left_out(given: Given, k: int) -> Given:
    """Return what was given without the joint velocities of recording k."""
    recordings = list(given.recordings)
    recordings[k] = replace(recordings[k], joints=replace(recordings[k].joints, qd=None))
    return replace(given, recordings=tuple(recordings))


def measured(recording: Recording) -> Measurements:
    """
    Return what was measured.

    Raises
    ------
    DataError
        Nothing was.

    """
    if recording.measured is None:
        raise DataError(f'{recording.name} holds no measured poses or points')
    return recording.measured
