# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A `Recording` to a bag with the standard topics."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from heapq import merge
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core import __version__
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.contacts import Contacts
from weld_twin_core.recording import Measurements, Recording

from ..assembly.frame_names import WORLD
from ..messages.from_messages import NANOSECONDS
from ..messages.to_messages import Messages, bag_messages
from ..messages.topics import (
    ACTUAL_JOINT_STATES,
    CONTACT,
    DEVIATION,
    JOINT_STATES,
    MEASURED_POINT,
    MEASURED_POSE,
    MEASURED_SIGMA,
    TEMPERATURE,
    TOOL_WRENCH,
    TWIN_COVARIANCE,
    TWIN_POSE,
)
from .writer import BagWriter

_Entry = tuple[int, str, Any]


def write_recording(
    path: Path | str,
    recording: Recording,
    robot: Robot,
    *,
    actual: Array | None = None,
    twin: tuple[Array, Array] | None = None,
    covariance: Array | None = None,
    deviation: Array | None = None,
    storage: str = 'mcap',
    provenance: Mapping[str, Any] | None = None,
) -> None:
    """
    Write a recording under the standard topics.

    Parameters
    ----------
    path : Path or str
        Must not exist yet.
    recording : Recording
        Without an epoch, stamps start at 1 s, for a stamp of zero means unset.
    robot : Robot
        Gives the joint names; kept in the provenance.
    actual : array, shape (N, n), optional
        Joint positions with the joint-space effects, for ``/actual/joint_states``.
    twin : tuple of arrays, shapes (N, 3) and (N, 3, 3), optional
        Twin poses at the joint stamps, for ``/twin/tool_pose``.
    covariance : array, shape (N, 6, 6), optional
        Of the twin poses, for ``/twin/tool_pose_with_covariance`` [m^2, rad^2].
    deviation : array, shape (M, 3), optional
        Measured minus twin at the measurement stamps, for ``/deviation``.
    storage : str
        'mcap' or 'sqlite3'.
    provenance : mapping, optional
        More about the recording's making: effects, seed.

    Raises
    ------
    DataError
        The path exists or cannot be written.

    """
    made = {
        'version': __version__,
        'robot': robot.to_mapping(),
        'static': recording.joints.static,
        **(provenance or {}),
    }
    if recording.contacts is not None:
        made['artefact'] = recording.contacts.artefact.as_mapping()
    entries = _Entries(recording)
    parts = [*entries.inputs(robot)]
    if actual is not None:
        parts.append(entries.joints(ACTUAL_JOINT_STATES.name, robot, actual, None))
    if twin is not None:
        parts.append(entries.poses(TWIN_POSE.name, recording.joints.t, *twin))
    if twin is not None and covariance is not None:
        parts.append(entries.sure_poses(recording.joints.t, *twin, covariance))
    if deviation is not None and recording.measured is not None:
        parts.append(entries.vectors(DEVIATION.name, recording.measured.t, deviation))
    with BagWriter(path, storage=storage, provenance=made) as bag:
        for ns, topic, message in merge(*parts, key=lambda entry: entry[0]):
            bag.write(topic, message, ns)


class _Entries:
    """Makes the messages of each topic one by one, so that only a few exist at once."""

    def __init__(self, recording: Recording) -> None:
        self.recording = recording
        self.make: Messages = bag_messages()
        first = recording.joints.t[0]
        if recording.measured is not None and recording.measured.t.size:
            first = min(first, recording.measured.t[0])
        self.epoch = recording.epoch_ns or NANOSECONDS - int(np.floor(first * 1e9))

    def inputs(self, robot: Robot) -> Iterator[Iterator[_Entry]]:
        """Yield the streams of the recording itself."""
        motion, measured = self.recording.joints, self.recording.measured
        wrench, temperature = self.recording.wrench, self.recording.temperature
        make = self.make
        yield self.joints(JOINT_STATES.name, robot, motion.q, motion.qd)
        if measured is not None:
            yield from self.measured(measured)
        if self.recording.contacts is not None:
            yield self.contacts(self.recording.contacts)
        if wrench is not None:
            frame = self.recording.wrench_frame
            yield self._each(
                TOOL_WRENCH.name, wrench.t, lambda ns, k: make.wrench(ns, wrench.value[k], frame)
            )
        if temperature is not None:
            yield self._each(
                TEMPERATURE.name,
                temperature.t,
                lambda ns, k: make.temperature(ns, temperature.value[k]),
            )

    def joints(self, topic: str, robot: Robot, q: Array, qd: Array | None) -> Iterator[_Entry]:
        """Return the joint states, q and qd shape (N, n)."""
        return self._each(
            topic,
            self.recording.joints.t,
            lambda ns, k: self.make.joint_state(
                ns, robot.joint_names, q[k], None if qd is None else qd[k]
            ),
        )

    def measured(self, measured: Measurements) -> Iterator[Iterator[_Entry]]:
        """Yield poses or points, and their standard deviations where they are known."""
        position, rotation, sigma = measured.position, measured.rotation, measured.sigma
        if rotation is not None:
            yield self.poses(MEASURED_POSE.name, measured.t, position, rotation)
        else:
            yield self._each(
                MEASURED_POINT.name,
                measured.t,
                lambda ns, k: self.make.point(ns, position[k], WORLD),
            )
        if sigma is not None:
            yield self.vectors(
                MEASURED_SIGMA.name, measured.t, np.repeat(sigma[:, None], 3, axis=1)
            )

    def contacts(self, contacts: Contacts) -> Iterator[_Entry]:
        """Return what each posture touched."""
        none = np.zeros(contacts.size)
        value = none if contacts.value is None else contacts.value
        sigma = none if contacts.sigma is None else contacts.sigma
        return self._each(
            CONTACT.name,
            self.recording.joints.t,
            lambda ns, k: self.make.contact(ns, contacts.labels[k], value[k], sigma[k]),
        )

    def poses(self, topic: str, t: Array, position: Array, rotation: Array) -> Iterator[_Entry]:
        """Return poses, shapes (K, 3) and (K, 3, 3)."""
        return self._each(
            topic, t, lambda ns, k: self.make.pose(ns, position[k], rotation[k], WORLD)
        )

    def sure_poses(
        self, t: Array, position: Array, rotation: Array, covariance: Array
    ) -> Iterator[_Entry]:
        """Return poses with covariance, shapes (K, 3), (K, 3, 3) and (K, 6, 6)."""
        return self._each(
            TWIN_COVARIANCE.name,
            t,
            lambda ns, k: self.make.pose_with_covariance(
                ns, position[k], rotation[k], covariance[k]
            ),
        )

    def vectors(self, topic: str, t: Array, vectors: Array) -> Iterator[_Entry]:
        """Return vectors, shape (K, 3)."""
        return self._each(topic, t, lambda ns, k: self.make.vector3(ns, vectors[k]))

    def _each(self, topic: str, t: Array, maker: Callable[[int, int], Any]) -> Iterator[_Entry]:
        stamps = self.epoch + np.round(t * 1e9).astype(np.int64)
        return ((int(ns), topic, maker(int(ns), k)) for k, ns in enumerate(stamps))
