# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Messages to arrays.

The functions read attributes only, so messages of rclpy and of rosbags serve alike. Positions in
m, angles in rad, quaternions x y z w, stamps int64 ns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from math import isfinite
from typing import Any

import numpy as np

from weld_twin_core.arrays import Array, readonly
from weld_twin_core.errors import DataError
from weld_twin_core.rotation import matrix_from_quaternion

NANOSECONDS = 1_000_000_000


def stamp_ns(message: Any) -> int:
    """
    Return the header stamp [ns].

    Raises
    ------
    DataError
        The stamp was never set, or is not a time.

    """
    stamp = message.header.stamp
    ns = int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)
    if ns <= 0:
        raise DataError(
            f'header.stamp is {ns} ns: the publisher left it unset, so the sample has no place in '
            'time; set header.stamp where the sample is taken'
        )
    return ns


@lru_cache(maxsize=64)
def _indices(present: tuple[str, ...], wanted: tuple[str, ...]) -> tuple[int, ...]:
    """Return where the wanted joints are; cached because every message repeats its names."""
    missing = [name for name in wanted if name not in present]
    if missing:
        listed = ', '.join(present) or 'none'
        raise DataError(f'the joint state has no joint {missing[0]!r}; it has {listed}')
    return tuple(present.index(name) for name in wanted)


def joint_positions(message: Any, joint_names: Sequence[str]) -> Array:
    """
    Return joint positions, shape (n,) [rad or m], matched by name.

    Order does not matter and further joints are left out.

    Raises
    ------
    DataError
        A joint is missing (the message names it and those present), there are fewer positions
        than names, or a position is not finite.

    """
    index = _indices(tuple(message.name), tuple(joint_names))
    values = message.position
    if len(values) != len(message.name):
        raise DataError(
            f'the joint state has {len(message.name)} names but {len(values)} positions; '
            'it must give one position per name'
        )
    out = np.array([values[k] for k in index], dtype=np.float64)
    _refuse_unfinite(out, joint_names, 'position')
    return out


def joint_velocities(message: Any, joint_names: Sequence[str]) -> Array | None:
    """
    Return joint velocities, shape (n,) [rad/s or m/s], or None where they are not known.

    joint_state_broadcaster writes NaN for a joint without a velocity interface, so NaN means
    unknown here; an infinite velocity is refused.

    Raises
    ------
    DataError
        A velocity is infinite.

    """
    values = message.velocity
    if len(values) != len(message.name):
        return None
    index = _indices(tuple(message.name), tuple(joint_names))
    out = np.array([values[k] for k in index], dtype=np.float64)
    if np.isnan(out).any():
        return None
    _refuse_unfinite(out, joint_names, 'velocity')
    return out


def _refuse_unfinite(values: Array, joint_names: Sequence[str], what: str) -> None:
    if not np.isfinite(values).all():
        k = int(np.argmin(np.isfinite(values)))
        raise DataError(
            f'joint {joint_names[k]!r} has the {what} {values[k]}; it must be a finite number'
        )


def _xyz(vector: Any, name: str) -> Array:
    out = np.array([vector.x, vector.y, vector.z], dtype=np.float64)
    if not np.isfinite(out).all():
        raise DataError(f'{name} is {out.tolist()}; it must be finite numbers')
    return out


def pose(message: Any) -> tuple[Array, Array]:
    """
    Return position (3,) [m] and rotation (3, 3) of a PoseStamped or PoseWithCovarianceStamped.

    Raises
    ------
    DataError
        A number is not finite, or the quaternion is not of length 1.

    """
    inner = message.pose
    inner = getattr(inner, 'pose', inner)
    q = inner.orientation
    rotation = matrix_from_quaternion([q.x, q.y, q.z, q.w], 'orientation of the pose')
    return _xyz(inner.position, 'position of the pose'), rotation


def point(message: Any) -> Array:
    """
    Return the point of a PointStamped, shape (3,) [m].

    Raises
    ------
    DataError
        A coordinate is not finite.

    """
    return _xyz(message.point, 'the point')


def vector3(message: Any) -> Array:
    """
    Return the vector of a Vector3Stamped, shape (3,).

    Raises
    ------
    DataError
        A component is not finite.

    """
    return _xyz(message.vector, 'the vector')


def wrench(message: Any) -> Array:
    """
    Return force and torque of a WrenchStamped, shape (6,) [N, N m].

    Raises
    ------
    DataError
        A component is not finite.

    """
    inner = message.wrench
    return np.concatenate([_xyz(inner.force, 'the force'), _xyz(inner.torque, 'the torque')])


def temperature(message: Any) -> float:
    """
    Return the temperature of a Temperature message [degC].

    Raises
    ------
    DataError
        It is not finite, or below absolute zero, or so high that it must be in kelvin.

    """
    value = float(message.temperature)
    if not isfinite(value) or value < -273.15:
        raise DataError(f'the temperature is {value} degC, which is no temperature')
    if value > 200.0:
        raise DataError(
            f'the temperature is {value:.6g} degC, which looks like kelvin; publish degC as '
            'sensor_msgs/Temperature defines'
        )
    return value


def position_sigma(message: Any) -> float | None:
    """
    Return one standard deviation of a PoseWithCovarianceStamped's position [m].

    None where the covariance is left at zero. Axes are joined by their root mean square.

    Raises
    ------
    DataError
        A variance is negative or not finite.

    """
    diagonal = readonly(np.asarray(message.pose.covariance)[[0, 7, 14]], (3,), 'covariance')
    if (diagonal < 0.0).any():
        raise DataError('the covariance of the pose has a negative variance')
    return float(np.sqrt(diagonal.mean())) if diagonal.any() else None


def diagnostics(message: Any) -> dict[str, dict[str, str]]:
    """Return the key-value pairs of each status of a DiagnosticArray, by status name."""
    return {
        status.name: {pair.key: pair.value for pair in status.values}
        for status in message.status
    }


def metrics(message: Any) -> Mapping[str, float]:
    """
    Return the numbers of the first status of a DiagnosticArray.

    Raises
    ------
    DataError
        The array is empty, or a value is not a number.

    """
    for status in message.status:
        try:
            return {pair.key: float(pair.value) for pair in status.values}
        except ValueError as error:
            raise DataError(f'metrics {status.name!r}: {error}') from None
    raise DataError('the diagnostic array has no status')
