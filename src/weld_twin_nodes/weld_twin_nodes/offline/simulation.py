# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole cell offline: what the live nodes publish for a motion, in bulk, and as a bag."""

import heapq
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core import __version__
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.poses import Poses
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.assembly.frames import BASE, WORLD
from weld_twin_msgs_py.bags import BagWriter
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.from_messages import NANOSECONDS
from weld_twin_msgs_py.messages.to_messages import Messages, bag_messages
from weld_twin_msgs_py.messages.topics import (
    ACTUAL_JOINT_STATES,
    DEVIATION,
    DEVIATION_METRICS,
    JOINT_STATES,
    MEASURED_POSE,
    TWIN_POSE,
)

from ..streams.deviation_stream import METRICS, Deviation, Deviations
from ..streams.twin_stream import Noise

METRICS_EVERY = 50
"""Samples between two messages of metrics."""


class Entry(NamedTuple):
    """One message of a run with its stamp [ns] and topic."""

    stamp: int
    topic: str
    message: Any


@dataclass(frozen=True, eq=False)
class Simulation:
    """A run of the cell."""

    real: Twin  # the robot as it is, with the injected effects
    twin: Twin  # the robot as it is believed to be
    motion: JointMotion
    stamps: np.ndarray  # shape (N,) [ns], of the joint states
    seed: int = 0  # of the measurement noise
    path_length: float = 0.0  # [m], for D_norm; 0 takes the way of the twin

    @cached_property
    def recording(self) -> Recording:
        """Return the joint stream as the live nodes see it, on whole nanoseconds."""
        t = (self.stamps - self.stamps[0]) * 1e-9
        motion = JointMotion(t, self.motion.q, self.motion.velocity)
        return Recording('simulation', motion, epoch_ns=int(self.stamps[0]))

    @cached_property
    def measured(self) -> Poses:
        """Return the measured tool poses, one for each joint state."""
        position, rotation = self.real.poses(self.recording)
        noise = Noise(self.real.effects, self.seed).draw(len(position))
        return Poses(position + noise, rotation)

    @cached_property
    def expected(self) -> Poses:
        """Return the twin's tool poses, one for each joint state."""
        return self.twin.poses(self.recording)

    def deviations(self) -> Iterator[tuple[Deviation, dict[str, float | int]]]:
        analyzer = Deviations(self.twin.robot, self.path_length)
        measured = zip(_late(self.stamps, self.real), self.measured.position, strict=True)
        expected = zip(_late(self.stamps, self.twin), self.expected.position, strict=True)
        takers = (analyzer.add_measured, analyzer.add_twin)
        tagged = [
            [(s, take, p) for s, p in rows]
            for take, rows in zip(takers, (measured, expected), strict=True)
        ]
        for stamp, take, position in heapq.merge(*tagged, key=lambda row: row[0]):
            for deviation in take(stamp, position):
                yield deviation, analyzer.metrics()

    def entries(self, make: Messages) -> Iterator[Entry]:
        """Yield every message of the run in the order of stamps."""
        names, motion = self.twin.robot.joint_names, self.motion
        stamps = self.stamps.tolist()
        planned = (
            Entry(s, JOINT_STATES.name, make.joint_state(s, names, q, qd))
            for s, q, qd in zip(stamps, motion.q, motion.velocity, strict=True)
        )
        actual = (
            Entry(s, ACTUAL_JOINT_STATES.name, make.joint_state(s, names, q))
            for s, q in zip(stamps, self.real.joints(self.recording), strict=True)
        )
        measured = _poses(make, MEASURED_POSE.name, _late(self.stamps, self.real), self.measured)
        expected = _poses(make, TWIN_POSE.name, _late(self.stamps, self.twin), self.expected)
        yield from heapq.merge(
            planned, actual, measured, expected, self._analysis(make), key=lambda e: e.stamp
        )

    def _analysis(self, make: Messages) -> Iterator[Entry]:
        """Yield deviations, and metrics now and then and after the last one."""
        count, last, stamp = 0, 0, 0
        metrics: dict[str, float | int] = {}
        for count, ((stamp, vector), metrics) in enumerate(self.deviations(), start=1):
            yield Entry(stamp, DEVIATION.name, make.vector3(stamp, vector, BASE))
            if count % METRICS_EVERY == 0:
                last = count
                yield _metrics(make, stamp, metrics)
        if count != last:
            yield _metrics(make, stamp, metrics)


def _late(stamps: np.ndarray, twin: Twin) -> list[int]:
    """Return the stamps of measurements, late by the delay of the measurement clock."""
    late = twin.late((stamps - stamps[0]) * 1e-9)
    return [int(ns) for ns in stamps + np.rint(late * NANOSECONDS).astype(np.int64)]


def _poses(make: Messages, topic: str, stamps: list[int], poses: Poses) -> Iterator[Entry]:
    for stamp, position, rotation in zip(stamps, *poses, strict=True):
        yield Entry(stamp, topic, make.pose(stamp, position, rotation, WORLD))


def _metrics(make: Messages, stamp: int, values: dict[str, float | int]) -> Entry:
    return Entry(stamp, DEVIATION_METRICS.name, make.diagnostics(stamp, METRICS, values))


def write_simulation(
    path: Path | str,
    simulation: Simulation,
    *,
    storage: str = 'mcap',
    provenance: Mapping[str, Any] | None = None,
) -> Mapping[str, float]:
    """Write a bag with what the live nodes would publish; return the last metrics."""
    made = {
        'version': __version__,
        'robot': simulation.real.robot.to_mapping(),
        'effects': [effect.to_mapping() for effect in simulation.real.effects],
        'twin_effects': [effect.to_mapping() for effect in simulation.twin.effects],
        'seed': simulation.seed,
        **(provenance or {}),
    }
    metrics: Mapping[str, float] = {}
    with BagWriter(path, storage=storage, provenance=made) as bag:
        for stamp, topic, message in simulation.entries(bag_messages()):
            bag.write(topic, message, stamp)
            if topic == DEVIATION_METRICS.name:
                metrics = from_messages.metrics(message)
        if 'RMS' not in metrics:
            raise DataError(
                'no measurement meets a pose of the twin: the effects delay measurements beyond '
                'the end of the motion; take a shorter delay or a slower motion'
            )
    return metrics
