# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which rotation three angles mean.

The angle between the orientations at two stations does not depend on the frames of the instrument
or the probe, so the table can be compared with the arm's kinematics before any frame is fitted.
The true convention agrees to the arm's accuracy, the others by tens of degrees.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from .words import EULER_ORDERS, ROTATION_VECTOR

COUNTING = 'how the controller counts (--joint-signs, --joint-offsets, --coupled)'
"""What to look at where orientations disagree with the arm, beside the columns."""
AGREES = np.radians(3.0)
"""RMS disagreement of relative angles an arm with unknown errors may show."""
CLEARLY = 5.0
"""The runner-up must be worse by this factor."""
ROUNDING = 1e-4
"""Disagreement [rad] that digits left out of the table may cause."""


def rotations(angles: Array, convention: str) -> Array:
    """Return rotations (M, 3, 3) of angles (M, 3) [rad]: 'XYZ' means Rx Ry Rz; or 'rotvec'."""
    if convention == ROTATION_VECTOR:
        return np.asarray(Rotation.from_rotvec(angles).as_matrix())
    columns = angles[:, ['XYZ'.index(axis) for axis in convention]]
    return np.asarray(Rotation.from_euler(convention, columns).as_matrix())


def disagreement(rotation: Array, robot: Robot, q: Array) -> float:
    """Return the RMS difference [rad] of relative angles between table and arm."""
    off = _relative(rotation) - _relative(forward(robot, q)[:, :3, :3])
    return float(np.sqrt((off**2).mean()))


def _relative(rotation: Array) -> Array:
    """Return the angles between each orientation and two others, shape (2 M,)."""
    out = []
    for step in (1, max(1, len(rotation) // 2)):
        turn = np.swapaxes(rotation, -1, -2) @ np.roll(rotation, -step, axis=0)
        out.append(Rotation.from_matrix(turn).magnitude())
    return np.concatenate(out)


def find_convention(angles: Array, robot: Robot, q: Array) -> tuple[str, str]:
    """Return the convention of the angles and the sentence that says how it was found."""
    result = {
        name: disagreement(rotations(angles, name), robot, q)
        for name in (*EULER_ORDERS, ROTATION_VECTOR)
    }
    ranked = sorted(result, key=lambda name: result[name])
    best, second = ranked[0], ranked[1]
    if result[best] > AGREES:
        raise DataError(
            f'no reading of the three angles agrees with the arm (the best, {best}, is '
            f'{np.degrees(result[best]):.3g} deg off); check the joint columns and '
            f'{COUNTING}, or --positions-only leaves orientation out'
        )
    if result[second] < CLEARLY * result[best] + ROUNDING:
        raise DataError(
            f'the angles could be {best} or {second}, the poses do not tell which; '
            '--rotation decides'
        )
    meaning = 'a rotation vector' if best == ROTATION_VECTOR else f'Euler {best} (intrinsic)'
    return best, (
        f'measured angles are {meaning}: relative rotations agree with the arm to '
        f'{np.degrees(result[best]):.2g} deg, the next reading is {np.degrees(result[second]):.2g} '
        'deg off'
    )
