# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Sound recordings, of arms with causes of plausible size, and every kind of mistake made in one."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Measurements, Recording

from ..blind.blind_cell import BlindCell, as_recording, draw_cell, poorer, record, take
from ..blind.cause_sizes import FAMILIES, MOVING, OUTSIDE, Cause
from ..blind.making import ROBOTS, STRATA, NotVisible, draw_causes
from ..blind.scoring import measured_of, rms

STEPS = ('station_step', 'tool_slip')
"""Causes that are mistakes of the set-up as well; they are drawn there."""
MOTIONS = ('seams', 'free', 'stations')
ALIGNS = ((), ('base',), ('tool',), ('base', 'tool'))
TRIES = 40
"""Draws of a motion before it is given up: not every arm reaches every seam."""


@dataclass(frozen=True, eq=False)
class Sound:
    robot: Robot
    """The nominal arm with its tool as it is told to the diagnosis."""
    recording: Recording
    align: tuple[str, ...]
    real: Robot
    """The same arm with its tool as it is; the base as it was told."""
    about: dict[str, Any]
    """Robot, motion, frames that are fitted, causes, how the motion was made poor."""


def draw(rng: np.random.Generator, *, rich: bool = False) -> Sound:
    """Return a sound recording drawn at random; a rich one shows every joint."""
    for _ in range(TRIES):
        with suppress(NotVisible, FloatingPointError, DataError):
            return _drawn(rng, rich)
    raise DataError('no sound recording came about')


def _drawn(rng: np.random.Generator, rich: bool) -> Sound:
    name, kind = str(rng.choice(ROBOTS)), str(rng.choice(MOTIONS))
    several = [f for f in (*FAMILIES, *OUTSIDE) if f not in STEPS]
    if kind == 'stations':
        several = [f for f in several if f not in MOVING]
    count = int(rng.choice([0, 1, 1, 1, 2, 3]))
    families = tuple(str(f) for f in rng.choice(several, count, replace=False))
    cell = draw_cell(name, kind, families, rng)
    taken = take(cell, kind, float(rng.uniform(12.0, 40.0)), rng)
    poor = '' if rich else str(rng.choice(['', '', 'small', 'still', 'few', 'one']))
    taken = poorer(taken, poor, rng)
    strata = [int(k) for k in rng.integers(1, len(STRATA), count)]
    causes: list[Cause] = []
    if families:
        causes, _ = draw_causes(cell, families, strata, taken, rng)
    align = ALIGNS[int(rng.integers(len(ALIGNS)))]
    robot, recording = _as_told(cell, as_recording('run', record(cell, causes, taken)), align, rng)
    about = {'robot': name, 'motion': kind, 'poor': poor, 'align': [*align], 'causes': causes}
    return Sound(robot, recording, align, cell.robot, about)


def _as_told(
    cell: BlindCell, recording: Recording, align: tuple[str, ...], rng: np.random.Generator
) -> tuple[Robot, Recording]:
    """Return the robot as told, and the recording seen from anywhere if frames are fitted."""
    robot = cell.robot
    if 'tool' in align:
        robot = robot.with_frames(tool=np.eye(4))
    if 'base' in align:
        recording = seen_from(recording, _anywhere(rng))
    return robot, recording


def seen_from(recording: Recording, T: Array) -> Recording:
    """Return the recording with its measurements in another frame, T shape (4, 4)."""
    seen = measured_of(recording)
    turned = None if seen.rotation is None else T[:3, :3] @ seen.rotation
    position = seen.position @ T[:3, :3].T + T[:3, 3]
    return recording.with_measured(replace(seen, position=position, rotation=turned))


def _anywhere(rng: np.random.Generator) -> Array:
    T = np.eye(4)
    T[:3, :3] = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    T[:3, 3] = rng.uniform(-3.0, 3.0, 3)
    return T


Made = tuple[Robot, Recording, str]
"""The robot as told, the recording with the mistake, and what was done."""
VISIBLE = 0.05
"""Range [rad, m] from which a joint's reading is worth swapping or turning round."""
LARGEST_SLIP = 0.03
"""Slip [rad, m] of a joint beyond which it is a crash and not a slip."""
UNLIKE_SIBLINGS = 0.05
"""Difference of a length [m] beyond which an arm is no sibling: those differ by 5 to 30 mm."""
ZERO_OFF, NUDGE = 0.01, 1e-6
"""What a mastering leaves of a zero, and the step of its derivative [rad, m]."""
SEEN_AT_ALL = 1e-3
"""Distance [m] below which nobody tells a wrong link from a wrong zero."""
ONE_PLACE = np.radians(20.0)
"""Mean turn [rad] of the tool below which a knock and a jump of the reflector move it alike: to a
tenth of their squares."""
CALIBRATED = 1e-3
"""What the constants of a controller's own model differ by from the nominal ones [rad, m]."""
POSTURES = 60
"""Measurements from which computed poses cannot be a chance: a rigid arm has some forty numbers."""
BUFFER = (6, 20)
"""Samples that an instrument keeps before it sends them: a driver's loop beside its own."""
SENT = 1e-4
"""Time from sample to sample [s] where a buffer is sent."""
BRISK = 0.01
"""Way [m] between bursts from which even stamps are better than those of bursts, whatever else is."""
MOVING_ONLY = frozenset({'zero_velocities', 'clock', 'stamps_in_bursts'})
"""Kinds that stations in a table cannot have."""


class Hidden(Exception):
    """The mistake would not show in this recording."""


def _measured(sound: Sound, said: str, **changes: Any) -> Made:
    """Return the recording with something else measured."""
    made = replace(measured_of(sound.recording), **changes)
    return sound.robot, sound.recording.with_measured(made), said


def _with_q(recording: Recording, q: Array, qd: Array | None = None) -> Recording:
    return replace(recording, joints=replace(recording.joints, q=q, qd=qd))


def _matrix(sound: Sound, matrix: Array) -> Recording:
    joints = sound.recording.joints
    qd = None if joints.qd is None else joints.qd @ matrix.T
    return _with_q(sound.recording, joints.q @ matrix.T, qd)


def _range(sound: Sound) -> Array:
    return np.asarray(np.ptp(sound.recording.joints.q, axis=0))


def _inner(sound: Sound, rng: np.random.Generator) -> int:
    """Return a joint that moves and that no fitted frame can stand in for."""
    n = sound.robot.n
    low = 1 if 'base' in sound.align else 0
    high = n - 1 if 'tool' in sound.align or measured_of(sound.recording).rotation is None else n
    inner = [i for i in range(low, high) if _range(sound)[i] > VISIBLE]
    if not inner:
        raise Hidden('no joint moves')
    return int(rng.choice(inner))


def units(sound: Sound, rng: np.random.Generator) -> Made:
    """
    Make degrees of radians, or millimetres of metres, of all numbers or of one column.

    The unit of a whole table is read from the table itself, and is no mistake there.
    """
    whole = [] if sound.recording.joints.static else ['degrees', 'millimetres']
    what = str(rng.choice([*whole, 'one joint', 'one axis']))
    n = sound.robot.n
    if what == 'degrees':
        return sound.robot, _matrix(sound, np.degrees(1.0) * np.eye(n)), what
    if what == 'one joint':
        i = _inner(sound, rng)
        matrix = np.eye(n)
        matrix[i, i] = np.degrees(1.0)
        return sound.robot, _matrix(sound, matrix), f'{what}: {sound.robot.joint_names[i]}'
    factor = np.full(3, 1e3)
    if what == 'one axis':
        factor = np.ones(3)
        factor[int(rng.integers(3))] = 1e3
    return _measured(sound, what, position=measured_of(sound.recording).position * factor)


def joints_swapped(sound: Sound, rng: np.random.Generator) -> Made:
    moving = np.flatnonzero(_range(sound) > VISIBLE)
    if moving.size < 2:
        raise Hidden('fewer than two joints move')
    i, j = (int(k) for k in rng.choice(moving, 2, replace=False))
    order = list(range(sound.robot.n))
    order[i], order[j] = j, i
    names = sound.robot.joint_names
    return sound.robot, _matrix(sound, np.eye(len(order))[order]), f'{names[i]}, {names[j]}'


def sign(sound: Sound, rng: np.random.Generator) -> Made:
    """Turn the sign of a joint, or of an axis of the positions."""
    if rng.random() < 0.25:
        factor = np.ones(3)
        factor[int(rng.integers(3))] = -1.0
        mirrored = measured_of(sound.recording).position * factor
        return _measured(sound, 'mirror', position=mirrored, rotation=None)
    i = _inner(sound, rng)
    matrix = np.eye(sound.robot.n)
    matrix[i, i] = -1.0
    return sound.robot, _matrix(sound, matrix), sound.robot.joint_names[i]


def constant_angle(sound: Sound, rng: np.random.Generator) -> Made:
    """Count a joint from another zero, by a quarter or half turn."""
    i = _inner(sound, rng)
    turn = np.zeros(sound.robot.n)
    turn[i] = np.radians(float(rng.choice([90.0, -90.0, 180.0])))
    if i == sound.robot.n - 3 and turn[i] > 2.0 and 'tool' in sound.align:
        raise Hidden('half a turn before the wrist is its middle joint turned round')
    if i == 0 and turn[i] > 2.0:
        raise Hidden('half a turn of joint 1 is half a turn of the base')
    joints = sound.recording.joints
    made = _with_q(sound.recording, joints.q + turn, joints.qd)
    return sound.robot, made, f'{sound.robot.joint_names[i]} {np.degrees(turn[i]):+.0f}'


def coupled_axes(sound: Sound, rng: np.random.Generator) -> Made:
    """Count joint 3 against the ground."""
    if _range(sound)[1] < VISIBLE:
        raise Hidden('joint 2 does not move')
    matrix = np.eye(sound.robot.n)
    matrix[2, 1] = float(rng.choice([1.0, -1.0]))
    return sound.robot, _matrix(sound, matrix), f'{matrix[2, 1]:+.0f}'


def base_turned(sound: Sound, rng: np.random.Generator) -> Made:
    """Measure in a base frame turned by a half turn."""
    if 'base' in sound.align:
        raise Hidden('the base is fitted')
    T = np.eye(4)
    T[0, 0] = T[1, 1] = -1.0
    base = sound.robot.T_world_base
    return sound.robot, seen_from(sound.recording, base @ T @ np.linalg.inv(base)), 'half a turn'


def other_robot(sound: Sound, rng: np.random.Generator) -> Made:
    """Tell of a sibling whose links differ, so that the tool is off by 5 to 30 mm."""
    robot, wanted = sound.robot, float(rng.uniform(5e-3, 30e-3))
    q = sound.recording.joints.q[:: max(len(sound.recording.joints.q) // 60, 1)]
    off = rng.standard_normal((2, robot.n)) * (np.stack([robot.a, robot.d]) != 0.0)
    for _ in range(20):
        sibling = replace(robot, a=robot.a + off[0], d=robot.d + off[1], name='sibling')
        size = _untaken(sound.robot, q, forward(sibling, q))
        if abs(size - wanted) < 0.02 * wanted:
            return sibling, sound.recording, f'{size * 1e3:.1f} mm'
        off = off * wanted / max(size, 1e-9)
        if np.abs(off).max() > UNLIKE_SIBLINGS:
            raise Hidden('frames and zeros take up every difference')
    raise Hidden('no sibling differs by as much')


def _untaken(robot: Robot, q: Array, poses: Array) -> float:
    """
    Return the RMS distance of poses (M, 4, 4) from those of a robot that nothing else takes up.

    Frames that were given wrong, and zeros within what a mastering leaves, are causes of their own.
    """
    real = forward(robot, q)
    remaining = poses[:, :3, 3] - real[:, :3, 3]
    columns = [*(np.eye(3)[:, None] * np.ones((len(remaining), 1)))]
    columns += [np.cross(axis, real[:, :3, 3]) for axis in np.eye(3)]
    columns += [real[:, :3, k] for k in range(3)]
    for turn in NUDGE * np.eye(robot.n):
        columns.append(ZERO_OFF / NUDGE * (forward(robot, q + turn) - real)[:, :3, 3])
    design = np.stack([column.ravel() for column in columns], axis=1)
    # Zeros by a prior in units of what is seen at all; frames are free.
    prior = np.diag(np.r_[np.zeros(9), np.full(robot.n, SEEN_AT_ALL)])
    system, wanted = np.vstack([design, prior]), np.r_[remaining.ravel(), np.zeros(len(prior))]
    taken = design @ np.linalg.lstsq(system, wanted, rcond=None)[0]
    return rms(remaining - taken.reshape(-1, 3))


def _middle(sound: Sound, rng: np.random.Generator) -> Array:
    """Return which measurements come after an instant drawn from the middle, bool (M,)."""
    count = measured_of(sound.recording).t.size
    return np.asarray(np.arange(count) >= int(count * rng.uniform(0.3, 0.7)))


def _moved(frame: Array, after: Array, way: Array, turn: Array) -> Array:
    out = np.array(frame)
    out[after, :3, 3] += way
    out[after, :3, :3] = Rotation.from_rotvec(turn).as_matrix() @ out[after, :3, :3]
    return out


def reflector_jumped(sound: Sound, rng: np.random.Generator) -> Made:
    """Have the reflector sit elsewhere in its nest from some instant on."""
    after, size = _middle(sound, rng), float(rng.uniform(5e-4, 5e-3))
    way = _direction(rng) * size
    seen = measured_of(sound.recording)
    q = sound.recording.joints.at(seen.t)[0]
    turns = _frame_of(sound, seen, q) @ forward(sound.real, q)[:, :3, :3]
    position = seen.position + np.where(after[:, None], turns @ way, 0.0)
    return _measured(sound, f'{size * 1e3:.2f} mm', position=position)


def _frame_of(sound: Sound, seen: Measurements, q: Array) -> Array:
    """Return how the measuring frame is turned against the base, (3, 3)."""
    there = _tip(sound.real, q)
    u, _, vt = np.linalg.svd(
        (seen.position - seen.position.mean(axis=0)).T @ (there - there.mean(axis=0))
    )
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt)


def joint_slipped(sound: Sound, rng: np.random.Generator) -> Made:
    """Have a joint slip, so that the tool is off by 0.5 to 5 mm from some instant on."""
    i, after = _inner(sound, rng), _middle(sound, rng)
    seen, robot = measured_of(sound.recording), sound.real
    q = sound.recording.joints.at(seen.t)[0]
    slip = np.zeros(robot.n)
    slip[i] = 1e-3
    lever = (
        float(np.median(np.linalg.norm((_tip(robot, q + slip) - _tip(robot, q)), axis=1))) / 1e-3
    )
    if lever < 0.02:
        raise Hidden('the joint does not move the tool')
    slip[i] = float(rng.uniform(5e-4, 5e-3)) / lever * float(rng.choice([-1.0, 1.0]))
    if abs(slip[i]) > LARGEST_SLIP:
        raise Hidden('the joint would have to slip by more than any does')
    turn = _frame_of(sound, seen, q)
    moved = np.where(after[:, None], (_tip(robot, q + slip) - _tip(robot, q)) @ turn.T, 0.0)
    rotation = seen.rotation
    if rotation is not None:
        before, then = (forward(robot, p)[:, :3, :3] for p in (q, q + slip))
        rotated = turn @ then @ np.swapaxes(before, 1, 2) @ turn.T @ rotation
        rotation = np.where(after[:, None, None], rotated, rotation)
    said = f'{robot.joint_names[i]} {slip[i] * 1e3:+.2f} mrad'
    return _measured(sound, said, position=seen.position + moved, rotation=rotation)


def _tip(robot: Robot, q: Array) -> Array:
    return np.asarray(forward(robot, q)[:, :3, 3])


def instrument_knocked(sound: Sound, rng: np.random.Generator) -> Made:
    """Knock the instrument by 0.5 to 5 mm, and turn it a little, at some instant."""
    after, size = _middle(sound, rng), float(rng.uniform(5e-4, 5e-3))
    way, turn = _direction(rng) * size, _direction(rng) * float(rng.uniform(0.0, 1e-3))
    seen = measured_of(sound.recording)
    if seen.rotation is None and _turning(sound) < ONE_PLACE:
        raise Hidden('while the tool hardly turns a knock is a jump of the reflector')
    R = Rotation.from_rotvec(turn).as_matrix()
    centre = seen.position.mean(axis=0)
    moved = (seen.position - centre) @ R.T + centre + way
    position = np.where(after[:, None], moved, seen.position)
    rotation = seen.rotation
    if rotation is not None:
        rotation = np.where(after[:, None, None], R @ rotation, rotation)
    return _measured(sound, f'{size * 1e3:.2f} mm', position=position, rotation=rotation)


def _turning(sound: Sound) -> float:
    """Return the mean angle of the tool from its middle [rad]."""
    turns = Rotation.from_matrix(forward(sound.real, sound.recording.joints.q)[:, :3, :3])
    return float((turns.mean().inv() * turns).magnitude().mean())


def joints_stuck(sound: Sound, rng: np.random.Generator) -> Made:
    """Have the reading of one joint, or of all, stand still for a stretch while the arm moves."""
    joints, n = sound.recording.joints, sound.robot.n
    count = len(joints.q)
    start = int(count * rng.uniform(0.2, 0.5))
    end = start + int(count * rng.uniform(0.15, 0.4))
    stuck = [_inner(sound, rng)] if rng.random() < 0.6 else list(range(n))
    q = joints.q.copy()
    q[start:end, stuck] = q[start, stuck]
    if np.abs(q - joints.q).max() < VISIBLE:
        raise Hidden('nothing moves while it is stuck')
    qd = None if joints.qd is None else joints.qd.copy()
    if qd is not None:
        qd[start:end, stuck] = 0.0
    said = 'all' if len(stuck) == n else sound.robot.joint_names[stuck[0]]
    return sound.robot, _with_q(sound.recording, q, qd), said


def zero_velocities(sound: Sound, rng: np.random.Generator) -> Made:
    """Publish velocity zero beside moving positions."""
    joints = sound.recording.joints
    if _range(sound).max() < VISIBLE:
        raise Hidden('nothing moves')
    return sound.robot, _with_q(sound.recording, joints.q, np.zeros_like(joints.q)), 'all'


def clock(sound: Sound, rng: np.random.Generator) -> Made:
    """Stamp the measurements by another clock: late, early, faster, or of another epoch."""
    seen, what = measured_of(sound.recording), str(rng.choice(['off', 'off', 'rate', 'epoch']))
    if what == 'off':
        late = float(rng.uniform(0.2, 3.0) * rng.choice([-1.0, 1.0]))
        t, said = seen.t + late, f'{late:+.2f} s'
    elif what == 'rate':
        rate = float(rng.uniform(2e-3, 2e-2))
        t, said = seen.t[0] + (seen.t - seen.t[0]) * (1.0 + rate), f'{rate:.2%}'
    else:
        t, said = seen.t + float(rng.uniform(1e3, 1e6)), 'another epoch'
    return _measured(sound, said, t=t)


def other(sound: Sound, rng: np.random.Generator) -> Made:
    """Pair measurements with the wrong rows or motion, miss or double one, or invert orientations."""
    seen = measured_of(sound.recording)
    if sound.recording.joints.static and rng.random() < 0.5:
        return _one_off(sound, rng)
    if seen.rotation is not None and rng.random() < 0.5:
        return _measured(sound, 'orientations inverted', rotation=seen.rotation.swapaxes(1, 2))
    if sound.recording.joints.static:
        shift = int(seen.t.size * rng.uniform(0.2, 0.8))
        position, said = np.roll(seen.position, shift, axis=0), f'rows shifted by {shift}'
    else:  # shifted in time it would be another clock
        position, said = seen.position[::-1], 'measured on the way back'
    return _measured(sound, said, position=position, rotation=None)


def _one_off(sound: Sound, rng: np.random.Generator) -> Made:
    """Miss a reading, or take it twice, so that all that follow are a row off."""
    seen = measured_of(sound.recording)
    each, row = np.arange(seen.t.size), int(seen.t.size * rng.uniform(0.1, 0.8))
    missed = bool(rng.random() < 0.5)
    reading = np.delete(each, row) if missed else np.insert(each, row, row)[:-1]
    rotation = None if seen.rotation is None else seen.rotation[reading]
    taken = replace(
        seen.take(each[: reading.size]), position=seen.position[reading], rotation=rotation
    )
    said = f'reading {row + 1} {"missed" if missed else "doubled"}'
    return sound.robot, sound.recording.with_measured(taken), said


def computed(sound: Sound, rng: np.random.Generator) -> Made:
    """Publish the controller's own forward kinematics, nominal or calibrated, as if measured."""
    seen, robot = measured_of(sound.recording), sound.robot
    if seen.t.size < POSTURES:
        raise Hidden('some rigid arm agrees with so few postures')
    q = sound.recording.joints.at(seen.t)[0]
    own, said = robot, 'nominal'
    if rng.random() < 0.5:
        off = rng.normal(scale=CALIBRATED, size=(4, robot.n))
        names = ('theta', 'd', 'a', 'alpha')
        calibrated = {name: getattr(robot, name) + o for name, o in zip(names, off, strict=True)}
        own, said = replace(robot, **calibrated), 'calibrated'
    poses = forward(own, q)
    rotation = None if seen.rotation is None else poses[:, :3, :3]
    return _measured(sound, said, position=poses[:, :3, 3], rotation=rotation, sigma=None)


def stamps_in_bursts(sound: Sound, rng: np.random.Generator) -> Made:
    """Keep measurements in a buffer, and stamp them when it is sent."""
    seen, size = measured_of(sound.recording), int(rng.integers(*BUFFER))
    index = np.arange(seen.t.size)
    last = np.minimum((index // size + 1) * size - 1, index[-1])
    way = np.linalg.norm(seen.position[last] - seen.position, axis=1)
    if np.quantile(way, 0.75) < BRISK:
        raise Hidden('the arm hardly moves while the buffer fills')
    t = seen.t[last] + SENT * (index - last + size)
    return _measured(sound, f'{size} at a time', t=t)


def camera_inverted(sound: Sound, rng: np.random.Generator) -> Made:
    """Give the pose of a fixed board in a camera on the arm, as the camera has it."""
    seen = measured_of(sound.recording)
    if seen.rotation is None:
        raise Hidden('a point cannot be inverted')
    return sound.robot, sound.recording.with_measured(seen.inverted()), 'inverted'


def _direction(rng: np.random.Generator) -> Array:
    way = rng.standard_normal(3)
    return np.asarray(way / np.linalg.norm(way))


KINDS: dict[str, Callable[[Sound, np.random.Generator], Made]] = {
    kind.__name__: kind
    for kind in (
        units,
        joints_swapped,
        sign,
        constant_angle,
        coupled_axes,
        base_turned,
        other_robot,
        reflector_jumped,
        joint_slipped,
        instrument_knocked,
        joints_stuck,
        zero_velocities,
        clock,
        other,
        computed,
        stamps_in_bursts,
        camera_inverted,
    )
}
"""How each kind is made; raises `Hidden` where the recording would not show it."""
