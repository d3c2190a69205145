# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a person changed in the cell for one recording, for the diagnosis of several."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Measurements, Recording, Signal
from weld_twin_core.twin.twin import Twin

KINDS = {'load': (1, 4), 'tool': (0,), 'instrument': (0,)}
"""Words for what may be changed, and how many numbers may follow each."""
HEAVIEST = 1000.0
"""Load [kg] beyond which a number is taken for grams: no bundled arm carries so much."""
FRAMES = {'tool': 'tool_pose', 'instrument': 'base_pose'}
"""What then differs between the recordings."""


@dataclass(frozen=True)
class SetUpChange:
    """What was changed for one recording."""

    kind: str  # 'load', 'tool' or 'instrument'
    numbers: tuple[float, ...] = ()
    """Of a load its mass [kg], below 0 where it was taken off, and, where given, its centre of
    mass in the tool frame [m]."""

    def __str__(self) -> str:
        return '='.join(filter(None, (self.kind, ','.join(f'{n:g}' for n in self.numbers))))


def set_up_change(text: str) -> SetUpChange:
    """Return a change from words: 'load=5', 'load=5,0,0,0.1', 'tool' or 'instrument'."""
    kind, _, rest = text.partition('=')
    try:
        numbers = tuple(float(part) for part in rest.split(',')) if rest else ()
    except ValueError:
        numbers = (np.nan,)
    if len(numbers) not in KINDS.get(kind, ()) or not np.isfinite(numbers).all():
        raise DataError(
            f"what was changed is 'load=KG', 'load=KG,X,Y,Z', 'tool' or 'instrument', got '{text}'"
        )
    if kind == 'load' and not 0.0 < abs(numbers[0]) < HEAVIEST:
        raise DataError(
            f'a load is given in kg, not 0 and below {HEAVIEST:g}, or below 0 where one was taken '
            f'off; got {text!r}'
        )
    return SetUpChange(kind, numbers)


def with_changes(
    recordings: Sequence[Recording], changes: Mapping[int, SetUpChange], robot: Robot
) -> tuple[list[Recording], tuple[str, ...]]:
    """
    Return recordings that say what was changed, and which errors may differ between them.

    The first recording is what the others are compared with, and changes are by recording.
    """
    differs = {change.kind for change in changes.values()} & set(FRAMES)
    if 0 in changes and changes[0].kind in FRAMES:
        raise DataError('the first recording is what the others are compared with; give it last')
    out = list(recordings)
    for k, change in changes.items():
        if change.kind == 'load':
            out[k] = _loaded(out[k], change.numbers, robot)
        elif change.kind == 'instrument':
            out[k] = _seen_from_before(out[k], robot)
    return out, tuple(FRAMES[kind] for kind in sorted(differs))


def _loaded(recording: Recording, numbers: Sequence[float], robot: Robot) -> Recording:
    """Return the recording with the weight of a load on the tool, unless forces were measured."""
    if recording.wrench is not None:
        return recording
    robot.refuse_positioner('a load that was changed')
    t, poses = recording.joints.t, forward(robot, recording.joints.q)
    pull = numbers[0] * (robot.T_base_origin[:3, :3].T @ robot.gravity)
    force = np.tile(pull, (t.size, 1))
    tools = robot.T_world_origin[:3, :3].T @ poses[:, :3, :3]
    torque = np.cross(tools @ np.array(numbers[1:] or (0.0, 0.0, 0.0)), force)
    wrench = Signal(t, np.concatenate([force, torque], axis=1))
    return replace(recording, wrench=wrench, wrench_frame='base')


def _seen_from_before(recording: Recording, robot: Robot) -> Recording:
    """Return the recording as if measured from where it was, as near as the robot file tells."""
    measured = recording.measured
    if measured is None:
        return recording
    nominal = Twin(robot).poses(recording, measured.t).position
    middle, goal = measured.position.mean(axis=0), nominal.mean(axis=0)
    from scipy.spatial.transform import Rotation  # 30 ms that most commands do not need

    turn = Rotation.align_vectors(nominal - goal, measured.position - middle)[0].as_matrix()
    moved = (measured.position - middle) @ turn.T + goal
    rotation = None if measured.rotation is None else turn @ measured.rotation
    return recording.with_measured(Measurements(measured.t, moved, rotation))
