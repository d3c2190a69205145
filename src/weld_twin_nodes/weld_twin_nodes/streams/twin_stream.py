# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joint states in, stamped poses out: what the injector and the twin both do with a message."""

from collections import deque
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.effects import Effect
from weld_twin_core.effects.effect import Stage
from weld_twin_core.effects.instrument import MeasurementNoise
from weld_twin_core.twin.poses import Poses
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.assembly import Intake, Role, Taken
from weld_twin_msgs_py.messages.from_messages import NANOSECONDS


class Noise:
    """Draws for each `measurement_noise` of a list of effects from a stream of its own."""

    def __init__(self, effects: Iterable[Effect], seed: int) -> None:
        self._seed = seed
        self._generators: list[np.random.Generator] = []
        self.change(effects)

    def change(self, effects: Iterable[Effect]) -> None:
        """Take other effects; streams that are running go on."""
        self._effects = [e for e in effects if isinstance(e, MeasurementNoise)]
        for k in range(len(self._generators), len(self._effects)):
            self._generators.append(np.random.default_rng([self._seed, k]))

    def draw(self, samples: int) -> Array:
        """Return errors of measured positions, shape (samples, 3) [m]."""
        total = np.zeros((samples, 3))
        for effect, generator in zip(self._effects, self._generators, strict=False):
            total += effect.draw(samples, generator)
        return total


MOST = 10_000
"""Samples kept that are ahead of the joint states: 100 s of a sensor at 100 Hz."""


class HeldSignal:
    """Gives the last sample not after a stamp, as `Signal.at`; stamps must not go back."""

    def __init__(self) -> None:
        self._samples: deque[tuple[int, Array]] = deque(maxlen=MOST)

    def add(self, stamp: int, value: Array, *, restarted: bool = False) -> None:
        """Take a sample [ns]; stamps increase, unless time has started anew."""
        if restarted:
            self._samples.clear()
        self._samples.append((stamp, value))

    def hold(self) -> None:
        """Keep the last value as one from before all time: the clock begins anew."""
        if self._samples:
            value = self._samples[-1][1]
            self._samples.clear()
            self._samples.append((0, value))

    def at(self, stamp: int) -> Array | None:
        """Return the value in force at a stamp [ns]; None before the first."""
        while len(self._samples) > 1 and self._samples[1][0] <= stamp:
            self._samples.popleft()
        if not self._samples or self._samples[0][0] > stamp:
            return None
        return self._samples[0][1]


class Sample(NamedTuple):
    """The arm at one joint stamp."""

    stamp: int  # of the joint state [ns]
    pose_stamp: int
    """Of a measurement that shows this pose [ns]; later by the delay of the measurement clock."""
    q: Array  # shape (n,) [rad or m]
    poses: Poses  # one position (3,) and rotation (3, 3)
    wrench: Array | None = None
    """In force at the joint state, in ``wrench_frame``, shape (6,) [N, N m]."""
    wrench_frame: str = 'tool'  # 'tool' or 'base'
    temperature: float | None = None  # [degC]
    effort: Array | None = None
    """As measured, where effects of the twin take it, shape (n,) [N m, or N of a slide]."""


class JointStream:
    """
    A live twin fed with messages.

    Wrench and temperature are in force from their own stamp to the next one's. The poses are
    those that the twin gives over the recording of the same messages.
    """

    def __init__(self, twin: Twin, joint_names: tuple[str, ...] | None = None) -> None:
        self._twin = twin
        self._live = twin.live()
        self.intake = Intake(twin.robot, joint_names=joint_names, mend=True)
        self._take_twin()
        self._epoch: int | None = None
        self._wrench = HeldSignal()
        self._temperature = HeldSignal()

    @property
    def twin(self) -> Twin:
        """Return the robot with its effects."""
        return self._twin

    def change(self, twin: Twin) -> None:
        """Go on with other effects; those that stay keep their memory."""
        self._twin = self._live.twin = twin
        self._take_twin()

    def _take_twin(self) -> None:
        """Ask the joint states for efforts where effects take them; see whether clocks differ."""
        self.intake.joints.efforts = any(effect.twin.by_effort for effect in self._twin.effects)
        self._clocks_differ = bool(self._twin.of_stage(Stage.CLOCK))

    def reset(self) -> None:
        """Begin anew, as after a jump of the clock; wrench and temperature hold."""
        self.intake.reset()
        self._forget()

    def _forget(self) -> None:
        self._live.reset()
        self._wrench.hold()
        self._temperature.hold()
        self._epoch = None

    def take_wrench(self, message: Any) -> None:
        """Take the load on the tool."""
        _keep(self._wrench, self.intake.take(Role.WRENCH, message))

    def take_temperature(self, message: Any) -> None:
        _keep(self._temperature, self.intake.take(Role.TEMPERATURE, message))

    def step(self, message: Any) -> Sample | None:
        """Return the arm at a joint state, None while joints of other publishers are awaited."""
        taken = self.intake.joint_sample(message)
        if taken is None:
            return None
        (stamp, q, qd, effort), restarted = taken
        if restarted:
            self._forget()
        if self._epoch is None:
            self._epoch = stamp
        wrench, frame = self._wrench.at(stamp), self.intake.wrench_frame.meaning
        warm = self._temperature.at(stamp)
        temperature = None if warm is None else float(warm[0])
        elapsed = (stamp - self._epoch) * 1e-9
        joints, poses = self._live.step(
            elapsed,
            q,
            qd,
            wrench,
            temperature,
            frame,
            effort,
        )
        late = 0
        if self._clocks_differ:
            late = round(float(self._twin.late(elapsed)) * NANOSECONDS)
        return Sample(stamp, stamp + late, joints, poses, wrench, frame, temperature, effort)


def _keep(signal: HeldSignal, taken: Taken | None) -> None:
    if taken is not None:
        signal.add(taken.stamp, taken.row, restarted=taken.restarted)
