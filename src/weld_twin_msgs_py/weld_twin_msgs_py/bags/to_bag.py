# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A `Recording` to a bag with the standard topics."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from heapq import merge
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core import __version__
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import quaternion_from_matrix
from weld_twin_core.arrays import Array
from weld_twin_core.cameras import Sightings
from weld_twin_core.contacts import Contacts
from weld_twin_core.recording import Measurements, Recording

from ..assembly.frames import WORLD
from ..messages import topics
from ..messages.cdr import layout_of
from ..messages.from_messages import NANOSECONDS
from ..messages.to_messages import Messages, bag_messages
from ..messages.typestore import TYPES
from .images import rows_of
from .writers import BagWriter

_Entry = tuple[int, str, str, bytes]
ROWS = 1_000
"""Messages of a topic that are made at once: some 200 kB."""


def write_recording(
    path: Path | str,
    recording: Recording,
    robot: Robot,
    *,
    actual: Array | None = None,
    twin: tuple[Array, Array] | None = None,
    expected: tuple[tuple[Array, Array], Array] | None = None,
    deviation: Array | None = None,
    storage: str = 'mcap',
    provenance: Mapping[str, Any] | None = None,
    beside: Mapping[str, str] | None = None,
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
    expected : tuple, optional
        Poses in the middle of the models allowed, shapes (N, 3) and (N, 3, 3), and their covariance,
        shape (N, 6, 6), for ``/twin/tool_pose_with_covariance`` [m^2, rad^2].
    deviation : array, shape (M, 3), optional
        Measured minus twin at the measurement stamps, for ``/deviation``.
    storage : str
        'mcap' or 'sqlite3'.
    provenance : mapping, optional
        More about the recording's making: effects, seed.
    beside : mapping, optional
        Texts that lie in the bag's directory, by name of the file.

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
    if recording.images is not None:
        made['seen'] = recording.images.as_mapping()
    if recording.counted is not None:
        made['counted'] = recording.counted.as_mapping()
    entries = _Entries(recording)
    parts = [*entries.inputs(robot)]
    if actual is not None:
        parts.append(entries.joints(topics.ACTUAL_JOINT_STATES.name, robot, actual, None))
    if twin is not None:
        parts.append(entries.poses(topics.TWIN_POSE.name, recording.joints.t, *twin))
    if expected is not None:
        (position, rotation), covariance = expected
        where = topics.TWIN_COVARIANCE.name, recording.joints.t
        parts.append(entries.sure_poses(*where, position, rotation, covariance))
    if deviation is not None and recording.measured is not None and len(deviation):
        parts.append(entries.vectors(topics.DEVIATION.name, recording.measured.t, deviation))
    with BagWriter(path, storage=storage, provenance=made, beside=beside) as bag:
        bag.write_all(merge(*parts, key=itemgetter(0)))


class _Entries:
    """Makes the messages of each topic, so that only some exist at once."""

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
        effort = self.recording.effort
        efforts = None if effort is None else effort.at(motion.t)
        yield self.joints(topics.JOINT_STATES.name, robot, motion.q, motion.qd, efforts)
        if self.recording.images is not None:
            yield self.images(self.recording.images)
        elif measured is not None:
            yield from self.measured(measured)
        if self.recording.contacts is not None:
            yield self.contacts(self.recording.contacts)
        if wrench is not None:
            frame, rows = self.recording.wrench_frame, wrench.value
            first = partial(self.make.wrench, wrench=rows[0], frame_id=frame)
            yield self._alike(topics.TOOL_WRENCH.name, wrench.t, first, rows)
        if temperature is not None:
            degrees = temperature.value
            rows = np.column_stack([degrees, np.zeros(degrees.size)])
            first = partial(self.make.temperature, celsius=degrees[0])
            yield self._alike(topics.TEMPERATURE.name, temperature.t, first, rows)

    def joints(
        self, topic: str, robot: Robot, q: Array, qd: Array | None, effort: Array | None = None
    ) -> Iterator[_Entry]:
        """Return the joint states, q, qd and effort shape (N, n)."""
        t, none = self.recording.joints.t, np.zeros((q.shape[0], 0))
        first = partial(
            self.make.joint_state,
            names=robot.joint_names,
            q=q[0],
            qd=None if qd is None else qd[0],
            effort=None if effort is None else effort[0],
        )
        runs = (none if run is None else run for run in (q, qd, effort))
        return self._alike(topic, t, first, *runs)

    def measured(self, measured: Measurements) -> Iterator[Iterator[_Entry]]:
        """Yield poses or points, and their standard deviations where they are known."""
        position, rotation, sigma = measured.position, measured.rotation, measured.sigma
        if not measured.t.size:
            return
        if rotation is not None and measured.noise is not None:
            known = measured.noise.covariance
            yield self.sure_poses(topics.MEASURED_POSE.name, measured.t, position, rotation, known)
            return
        if rotation is not None:
            yield self.poses(topics.MEASURED_POSE.name, measured.t, position, rotation)
        else:
            first = partial(self.make.point, position=position[0], frame_id=WORLD)
            yield self._alike(topics.MEASURED_POINT.name, measured.t, first, position)
        if sigma is not None:
            yield self.vectors(
                topics.MEASURED_SIGMA.name, measured.t, np.repeat(sigma[:, None], 3, axis=1)
            )

    def contacts(self, contacts: Contacts) -> Iterator[_Entry]:
        """Return what each posture touched; labels differ in length, so each is made by itself."""
        none = np.zeros(contacts.size)
        value = none if contacts.value is None else contacts.value
        sigma = none if contacts.sigma is None else contacts.sigma
        for k, ns in enumerate(self._stamps(self.recording.joints.t).tolist()):
            message = self.make.contact(ns, contacts.labels[k], value[k], sigma[k])
            yield ns, topics.CONTACT.name, message.__msgtype__, _serialised(message)

    def images(self, seen: Sightings) -> Iterator[_Entry]:
        """Return what cameras saw, of which the poses are made again when it is read."""
        for stamp, camera, rows in rows_of(seen):
            ns = int(self._stamps(np.array([stamp]))[0])
            message = self.make.image_points(ns, camera, rows)
            yield ns, topics.IMAGE_POINTS.name, message.__msgtype__, _serialised(message)

    def poses(self, topic: str, t: Array, position: Array, rotation: Array) -> Iterator[_Entry]:
        """Return poses, shapes (K, 3) and (K, 3, 3)."""
        first = partial(self.make.pose, position=position[0], rotation=rotation[0], frame_id=WORLD)
        return self._alike(topic, t, first, _pose_rows(position, rotation))

    def sure_poses(
        self, topic: str, t: Array, position: Array, rotation: Array, covariance: Array
    ) -> Iterator[_Entry]:
        """Return poses with covariance, shapes (K, 3), (K, 3, 3) and (K, 6, 6)."""
        first = partial(
            self.make.pose_with_covariance,
            position=position[0],
            rotation=rotation[0],
            covariance=covariance[0],
        )
        rows = np.hstack([_pose_rows(position, rotation), covariance.reshape(-1, 36)])
        return self._alike(topic, t, first, rows)

    def vectors(self, topic: str, t: Array, vectors: Array) -> Iterator[_Entry]:
        """Return vectors, shape (K, 3)."""
        return self._alike(topic, t, partial(self.make.vector3, vector=vectors[0]), vectors)

    def _stamps(self, t: Array) -> np.ndarray:
        return self.epoch + np.round(t * 1e9).astype(np.int64)

    def _alike(
        self, topic: str, t: Array, first: Callable[[int], Any], *runs: Array
    ) -> Iterator[_Entry]:
        """Yield messages that differ from the first one in stamp and numbers, shapes (N, count)."""
        stamps = self._stamps(t)
        message = first(int(stamps[0]))
        kind, data = message.__msgtype__, _serialised(message)
        layout = layout_of(kind, data)
        assert layout is not None, f'a {kind} has no layout'
        for start in range(0, stamps.size, ROWS):
            rows = slice(start, start + ROWS)
            ns = stamps[rows]
            whole = layout.filled(data, ns, [run[rows] for run in runs]).tobytes()
            for k, each in enumerate(ns.tolist()):
                yield each, topic, kind, whole[k * layout.size : (k + 1) * layout.size]


def _serialised(message: Any) -> bytes:
    return bytes(TYPES.serialize_cdr(message, message.__msgtype__))


def _pose_rows(position: Array, rotation: Array) -> Array:
    """Return position and quaternion x y z w, w >= 0, shape (K, 7)."""
    return np.hstack([position, quaternion_from_matrix(rotation)])
