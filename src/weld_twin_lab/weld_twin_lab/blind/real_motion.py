# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Semi-real cases: known causes added to what a real cell really did.

The joint stream and the measurements are those of a real bag. The plant moves along that joint
stream with a cause and without it, and the difference is added to the measured poses, so that
noise, outliers, clocks and everything else unmodelled stay real. One case of every bag is left
as it is, to tell what the bag has of its own.
"""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.algebra.noise_floor import noise_floor
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, usable
from weld_twin_core.diagnosis.frames.alignment import initial_frames
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_msgs_py.bags import read_recording, write_recording
from weld_twin_msgs_py.robots import load_robot, write_robot_yaml
from weld_twin_nodes.offline.output_directory import new_directory
from weld_twin_nodes.offline.task_pool import Runner, Task

from ..plant.plant_recording import Command, PlantRecording
from ..plant.tracker import Tracker
from . import layout, seal
from .blind_cell import BlindCell, Take, at_stamps, record
from .cause_sizes import FAMILIES, MOVING, Cause, draw, scaled, site
from .deck import STRATA, Deck
from .displacement import rms
from .judging import AS_IT_IS, SEMI_REAL

RATE = 125.0
"""Rate [Hz] at which a recorded motion is given to the plant, that of most controllers."""
TRAINING = 0.7
"""Share of a bag, from its beginning, that is diagnosed; the rest is the sealed test."""
ROUNDS = 4
"""Times a cause is scaled until it shows as large as wanted."""
NEAR = 1.25
"""Ratio to the wanted size that is near enough; the size itself is drawn over a range of ten."""


@dataclass(frozen=True)
class Wish:
    """A bag, a cause (empty: none) and how large, as a number of `STRATA`."""

    bag: str
    family: str
    stratum: int


def make_semi_real(
    cases: Path,
    truths: Path,
    bags: Sequence[str],
    robot: str,
    align: Sequence[str],
    seed: int,
    count: int,
    runner: Runner,
) -> str:
    """
    Make cases and truths from real bags, and return the seal.

    Parameters
    ----------
    cases, truths : Path
    bags : sequence of str
        Real recordings.
    robot : str
        Bundled name or file of the robot they are of.
    align : sequence of str
        Frames that are not known and fitted along.
    seed, count : int
    runner : Runner

    Raises
    ------
    DataError
        A bag cannot be used.

    """
    if (truths / layout.TRUTHS).exists() or (cases / layout.CASES).exists():
        raise DataError(f"'{cases}' or '{truths}' holds cases already; choose another place")
    layout.write(truths / layout.TRUTHS, {'seed': seed, 'count': count})
    families, strata = Deck(FAMILIES, seed, 0), Deck(range(len(STRATA)), seed, 1)
    wishes = [Wish(bag, '', 0) for bag in bags]
    wishes += [Wish(bags[k % len(bags)], families.next(), strata.next()) for k in range(count)]
    tasks = [
        Task(make_one, (seed, k, wish, robot, tuple(align), str(cases), str(truths)), wish.bag)
        for k, wish in enumerate(wishes)
    ]
    entries = runner.run(tasks)
    sealed = seal.seal_of(entries)
    layout.write(cases / layout.CASES, {'seal': sealed, 'cases': entries})
    seal.make_private(truths)
    return sealed


def make_one(
    seed: int,
    number: int,
    wish: Wish,
    robot: str,
    align: tuple[str, ...],
    cases: str,
    truths: str,
) -> dict[str, str]:
    """Write one case and its truth; return its name and the hashes of both."""
    rng = np.random.default_rng([seed, 2000 + number])
    arm = load_robot(robot)
    real = usable(read_recording(wish.bag, arm))
    cause, ratio, mixed = _mixed(wish, arm, real, align, rng)
    train, test = _split(mixed)
    name = f'case_{number + 1:04d}'
    with new_directory(Path(cases) / name, mark=layout.CASE) as place:
        write_robot_yaml(place / layout.ROBOT, arm)
        write_recording(place / layout.TRAIN, train, arm)
        case = {'name': name, 'align': list(align), 'exclude': [], 'known': False}
        layout.write(place / layout.CASE, case)
    truth = {'name': name, 'robot': arm.name, 'ratio': ratio, 'align': list(align)}
    with new_directory(Path(truths) / name, mark=layout.TRUTH) as place:
        write_recording(place / layout.TEST, test, arm)
        layout.write(place / layout.TRUTH, truth | _truth(wish, cause, ratio))
    return {
        'name': name,
        'case': seal.digest(Path(cases) / name),
        'truth': seal.digest(Path(truths) / name),
    }


def _truth(wish: Wish, cause: Cause | None, ratio: float) -> dict[str, Any]:
    """Return what is true of a case with one cause or none on a real motion."""
    return {
        'salt': secrets.token_hex(16),
        'kind': SEMI_REAL if cause else AS_IT_IS,
        'motion': Path(wish.bag).name,
        'construction': None,
        'causes': [cause] if cause else [],
        'sites': [site(cause)] if cause else [],
        'alike': [],
        'ratios': [ratio] if cause else [],
        'excluded': [],
        'test': 'same motion',
        'floor_m': None,
        'outliers': [],
    }


def _mixed(
    wish: Wish, robot: Robot, real: Recording, align: tuple[str, ...], rng: np.random.Generator
) -> tuple[Cause | None, float, Recording]:
    """Return the cause, its RMS over the noise of the bag, and the recording with it."""
    if not wish.family:
        return None, 0.0, real
    problem = Problem((real,), frozenset(align))
    aligned = initial_frames(problem, Model(robot, (robot.T_world_base,)))
    arm = aligned.robot.with_frames(base=aligned.bases[0])
    noise = noise_floor(problem, problem.residuals(aligned)).rms_m
    cell = BlindCell(arm, Tracker(), richness=float(rng.uniform(0.0, 1.0)))
    taken = Take(recorded_command(real), int(rng.integers(2**31)))
    wanted = float(np.exp(rng.uniform(*np.log(STRATA[wish.stratum]))))
    possible = [name for name in _possible(real, align) if name != wish.family]
    for family in (wish.family, *rng.permutation(possible)):
        if family not in _possible(real, align):
            continue
        cause = draw(str(family), arm, float(taken.command.t[-1]), rng)
        for _ in range(ROUNDS):
            mixed, ratio = with_cause(cell, cause, taken, real)
            ratio /= noise
            if 1.0 / NEAR < ratio / wanted < NEAR:
                return cause, ratio, mixed
            cause = scaled(cause, wanted / max(ratio, 1e-6))
    raise DataError(f'no cause shows in {real.name!r} as large as wanted; leave the bag out')


def _possible(real: Recording, align: Sequence[str]) -> list[str]:
    """Return the families that this bag can show."""
    out = set(FAMILIES) - {'payload', 'hose_pull', 'refraction'}
    out -= {f'{frame}_pose' for frame in align}
    if real.joints.static:
        out -= MOVING
    if real.wrench is None or real.wrench_frame != 'tool':
        out -= {'cartesian_compliance'}
    if real.temperature is None:
        out -= {'thermal_growth'}
    return [name for name in FAMILIES if name in out]


def recorded_command(real: Recording) -> Command:
    """Return the motion of a bag as the plant takes it, evenly spaced unless at rest."""
    joints = real.joints
    if joints.static:
        t, q = joints.t, joints.q
    else:
        t = np.arange(joints.t[0], joints.t[-1], 1.0 / RATE)
        q = joints.at(t)[0]
    in_tool = real.wrench is not None and real.wrench_frame == 'tool'
    return Command(
        t,
        q,
        joints.static,
        real.wrench.at(t) if real.wrench is not None and in_tool else None,
        None if real.temperature is None else real.temperature.at(t),
    )


def with_cause(
    cell: BlindCell, cause: Cause, taken: Take, real: Recording
) -> tuple[Recording, float]:
    """Return the recording with a cause added, and the RMS of what was added [m]."""
    measured = real.measured
    if measured is None:
        raise DataError(f'{real.name!r} holds no measurements')
    moved, ideal = record(cell, [cause], taken), record(cell, [], taken)
    t = measured.t
    if real.joints.static:
        t = real.joints.t[np.abs(t[:, None] - real.joints.t).argmin(axis=1)]
    off = _positions(moved, t) - _positions(ideal, t)
    rotation = measured.rotation
    if rotation is not None:
        turn = _rotations(moved, t) * _rotations(ideal, t).inv()
        rotation = turn.as_matrix() @ rotation
    mixed = Measurements(measured.t, measured.position + off, rotation, measured.sigma)
    return real.with_measured(mixed), rms(off)


def _positions(made: PlantRecording, t: Array) -> Array:
    if made.static:
        return np.asarray(made.position[np.searchsorted(made.t_measured, t)])
    return at_stamps(made, np.clip(t, made.t_measured[0], made.t_measured[-1]))


def _rotations(made: PlantRecording, t: Array) -> Rotation:
    turns = Rotation.from_quat(made.quaternion)
    if made.static:
        return turns[np.searchsorted(made.t_measured, t)]
    return Slerp(made.t_measured, turns)(np.clip(t, made.t_measured[0], made.t_measured[-1]))


def _split(whole: Recording) -> tuple[Recording, Recording]:
    """Return the recording up to a time, and after it."""
    t = whole.joints.t
    parts = []
    for use, chosen in (
        (layout.TRAIN, slice(None, int(TRAINING * t.size))),
        (layout.TEST, slice(int(TRAINING * t.size), None)),
    ):
        joints = whole.joints
        velocity = None if joints.qd is None else joints.qd[chosen]
        motion = JointMotion(t[chosen], joints.q[chosen], velocity, joints.static)
        measured = _inside(whole, motion)
        parts.append(usable(replace(whole, name=use, joints=motion, measured=measured)))
    return parts[0], parts[1]


def _inside(whole: Recording, motion: JointMotion) -> Measurements | None:
    """Return the measurements that belong to a stretch of the motion."""
    if whole.measured is None:
        return None
    t = whole.measured.t
    return whole.measured.take((t >= motion.t[0]) & (t <= motion.t[-1]))
