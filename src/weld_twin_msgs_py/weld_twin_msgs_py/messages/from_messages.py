# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages of rclpy or rosbags to arrays: m, rad, quaternions x y z w, stamps int64 ns."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from math import isfinite
from typing import Any

import numpy as np

from weld_twin_core.arm.single_pose import quaternion_matrix
from weld_twin_core.arrays import Array, readonly
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, checked_temperature

NANOSECONDS = 1_000_000_000
"""In a second."""
VARIANCES = (0, 7, 14)
"""Where the covariance of a pose has the variances of its position."""


def time_ns(time: Any) -> int:
    """Return a Time in nanoseconds."""
    return int(time.sec) * NANOSECONDS + int(time.nanosec)


class Unstamped(DataError):
    """The header stamp of a message was never set."""


def stamp_ns(message: Any) -> int:
    """
    Return the header stamp [ns].

    Raises Unstamped: the stamp was never set, or is not a time.
    """
    ns = time_ns(message.header.stamp)
    if ns <= 0:
        raise Unstamped(
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
    twice = [name for name in wanted if present.count(name) > 1]
    if twice:
        raise DataError(
            f'the joint state names joint {twice[0]!r} twice, and which position counts is not told; '
            'have the driver name each joint once'
        )
    return tuple(present.index(name) for name in wanted)


@lru_cache(maxsize=64)
def _present(present: tuple[str, ...], wanted: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(name for name in wanted if name in present)


def joints_present(message: Any, joint_names: Sequence[str]) -> tuple[str, ...]:
    """Return which of the joints a joint state tells of, in the order they were asked for."""
    return _present(tuple(message.name), tuple(joint_names))


def joint_positions(message: Any, joint_names: Sequence[str]) -> Array:
    """Return joint positions, shape (n,) [rad or m], matched by name."""
    index = _indices(tuple(message.name), tuple(joint_names))
    values = message.position
    if len(values) != len(message.name):
        raise DataError(
            f'the joint state has {len(message.name)} names but {len(values)} positions; '
            'it must give one position per name'
        )
    return _finite([values[k] for k in index], joint_names, 'position')


def joint_velocities(message: Any, joint_names: Sequence[str]) -> Array | None:
    """
    Return joint velocities, shape (n,) [rad/s or m/s], or None where they are not known.

    joint_state_broadcaster writes NaN for a joint without a velocity interface, so NaN means
    unknown here; an infinite velocity is refused.
    """
    values = message.velocity
    if len(values) != len(message.name):
        return None
    index = _indices(tuple(message.name), tuple(joint_names))
    chosen = [values[k] for k in index]
    if any(value != value for value in chosen):
        return None
    return _finite(chosen, joint_names, 'velocity')


def joint_efforts(message: Any, joint_names: Sequence[str]) -> Array:
    """Return the measured efforts of the joints, shape (n,) [N m, or N of a slide]."""
    values = getattr(message, 'effort', ())
    if not len(values):
        raise DataError(
            'the joint state tells no effort; have the driver publish it, or leave --use-effort out'
        )
    if len(values) != len(message.name):
        raise DataError(
            f'the joint state has {len(message.name)} names but {len(values)} efforts; it must '
            'give one effort per name, or --use-effort be left out'
        )
    index = _indices(tuple(message.name), tuple(joint_names))
    return _finite([values[k] for k in index], joint_names, 'effort')


def _finite(values: Sequence[float], joint_names: Sequence[str], what: str) -> Array:
    """Return values, refused in plain numbers: for one sample numpy costs more than the arithmetic."""
    if not all(map(isfinite, values)):
        k = [isfinite(value) for value in values].index(False)
        raise DataError(
            f'joint {joint_names[k]!r} has the {what} {values[k]}; it must be a finite number'
        )
    return np.array(values, dtype=np.float64)


def _xyz(vector: Any, name: str) -> Array:
    out = np.array([vector.x, vector.y, vector.z], dtype=np.float64)
    if not np.isfinite(out).all():
        raise DataError(f'{name} is {out.tolist()}; it must be finite numbers')
    return out


def pose(message: Any) -> tuple[Array, Array]:
    """Return position (3,) [m] and rotation (3, 3) of a PoseStamped or PoseWithCovarianceStamped."""
    inner = message.pose
    inner = getattr(inner, 'pose', inner)
    q = inner.orientation
    rotation = quaternion_matrix(q.x, q.y, q.z, q.w, 'orientation of the pose')
    return _xyz(inner.position, 'position of the pose'), rotation


def point(message: Any) -> Array:
    """Return the point of a PointStamped, shape (3,) [m]."""
    return _xyz(message.point, 'the point')


def position(message: Any) -> Array:
    """Return the position of a pose or a point as `pose` and `point` do, shape (3,) [m]."""
    return point(message) if hasattr(message, 'point') else pose(message)[0]


def vector3(message: Any) -> Array:
    """Return the vector of a Vector3Stamped, shape (3,)."""
    return _xyz(message.vector, 'the vector')


def wrench(message: Any) -> Array:
    """Return force and torque of a WrenchStamped, shape (6,) [N, N m]."""
    inner = message.wrench
    return np.concatenate([_xyz(inner.force, 'the force'), _xyz(inner.torque, 'the torque')])


def temperature(message: Any) -> float:
    """Return the temperature of a Temperature message [degC]."""
    return checked_temperature(float(message.temperature))


def position_sigma(message: Any) -> float | None:
    """Return one standard deviation of a pose's position [m]; None where it is left at zero."""
    diagonal = readonly(np.asarray(message.pose.covariance)[list(VARIANCES)], (3,), 'covariance')
    if (diagonal < 0.0).any():
        raise DataError('the covariance of the pose has a negative variance')
    return float(np.sqrt(diagonal.mean())) if diagonal.any() else None


def joint_trajectory(message: Any, joint_names: Sequence[str]) -> JointMotion:
    """Return the motion of a JointTrajectory; velocities where every point has them."""
    index = list(_indices(tuple(message.joint_names), tuple(joint_names)))
    count, points = len(message.joint_names), message.points
    if len(points) < 2:
        raise DataError(f'the joint trajectory has {len(points)} points; a motion needs two')
    if any(len(p.positions) != count for p in points):
        raise DataError(f'every point of the joint trajectory must have {count} positions')
    q = np.array([p.positions for p in points], dtype=np.float64)[:, index]
    known = all(len(p.velocities) == count for p in points)
    qd = np.array([p.velocities for p in points], dtype=np.float64)[:, index] if known else None
    since = [p.time_from_start for p in points]
    t = np.array([s.sec + s.nanosec / NANOSECONDS for s in since])
    if (np.diff(t) <= 0.0).any():
        raise DataError('time_from_start must increase from point to point')
    return JointMotion(t - t[0], q, qd)


def path_points(message: Any) -> Array:
    """Return the positions of a Path, shape (N, 3) [m]."""
    if len(message.poses) < 2:
        raise DataError(f'the path has {len(message.poses)} poses; a seam needs two')
    return np.stack([_xyz(item.pose.position, 'a pose of the path') for item in message.poses])


def diagnostics(message: Any) -> dict[str, dict[str, str]]:
    """Return the key-value pairs of each status of a DiagnosticArray, by status name."""
    return {
        status.name: {pair.key: pair.value for pair in status.values} for status in message.status
    }


def metrics(message: Any) -> Mapping[str, float]:
    """Return the numbers of the first status of a DiagnosticArray."""
    for status in message.status:
        try:
            return {pair.key: float(pair.value) for pair in status.values}
        except ValueError as error:
            raise DataError(f'metrics {status.name!r}: {error}') from None
    raise DataError('the diagnostic array has no status')
