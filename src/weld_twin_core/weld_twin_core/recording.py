# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What was commanded and what was measured: several streams, each on its own clock."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np

from .arrays import Array, increasing, readonly, spread_over
from .cameras import Sightings
from .contacts import Contacts
from .cubics import hermite
from .errors import DataError
from .pose_noise import Common, PoseNoise, inverse_error

FIRST_DATE_NS = 10**18
"""Stamps [ns] before 2001 count from something else than 1970."""
_WRENCH_FRAMES = ('tool', 'base')


def backward_rates(t: Array, values: Array) -> Array:
    """Return how fast values (..., N, n) change since the sample before [1/s], zero at first."""
    rates = np.zeros_like(values)
    rates[..., 1:, :] = np.diff(values, axis=-2) / np.diff(t)[:, None]
    return rates


@dataclass(frozen=True, eq=False)
class JointMotion:
    """
    The joint stream.

    Raises
    ------
    DataError
        No samples, shapes that do not fit, values that are not finite, or stamps out of order.

    Examples
    --------
    >>> import numpy as np
    >>> import weld_twin_core as wt
    >>> t = np.linspace(0.0, 1.0, 11)
    >>> motion = wt.JointMotion(t, np.stack([np.sin(t), 0.0 * t], axis=1))
    >>> q, qd = motion.at(np.array([0.55]))
    >>> print(q.round(4), 'rad,', qd.round(3), 'rad/s')
    [[0.5227 0.    ]] rad, [[0.853 0.   ]] rad/s

    """

    t: Array
    """Stamps on the joint clock, strictly increasing, from the recording's epoch on, shape (N,) [s]."""
    q: Array
    """Joint positions, as commanded or as the controller read them, shape (N, n) [rad or m]."""
    qd: Array | None = None
    """Velocity where the controller gives it, shape (N, n) [rad/s or m/s]."""
    static: bool = False
    """Each row is a station at rest, visited in order; nothing is known of the motion between."""

    def __post_init__(self) -> None:
        t = increasing(self.t, 'joint stamps')
        if t.size == 0:
            raise DataError('the joint stream is empty')
        q = readonly(self.q, (t.size, None), 'joint positions')
        vars(self).update(t=t, q=q)
        if self.qd is not None:
            vars(self).update(qd=readonly(self.qd, q.shape, 'joint velocities'))

    @cached_property
    def velocity(self) -> Array:
        """Return joint velocity, shape (N, n): as measured, else by second-order differences."""
        if self.qd is not None and not self.static:
            return self.qd
        if self.static or self.t.size < 2:
            return readonly(np.zeros_like(self.q), self.q.shape, 'joint velocities')
        edge: Literal[1, 2] = 2 if self.t.size > 2 else 1
        rates = np.gradient(self.q, self.t, axis=0, edge_order=edge)
        return readonly(rates, self.q.shape, 'joint velocities')

    @cached_property
    def causal_velocity(self) -> Array:
        """
        Return joint velocity as far as it is known at each stamp, shape (N, n).

        As measured, else the step since the sample before: a running twin knows no more, and
        over a recording the twin must say the same.
        """
        if self.qd is not None or self.static:
            return self.velocity
        return readonly(backward_rates(self.t, self.q), self.q.shape, 'joint velocities')

    def nearest(self, t: Array) -> np.ndarray:
        """Return the index of the sample nearest in time, of any shape [s], as integers t.shape."""
        after = np.clip(np.searchsorted(self.t, t), 0, self.t.size - 1)
        before = np.maximum(after - 1, 0)
        return np.where(np.abs(t - self.t[before]) <= np.abs(self.t[after] - t), before, after)

    def at(self, t: Array) -> tuple[Array, Array]:
        """
        Return joint position and velocity at times of any shape [s], shape t.shape + (n,).

        Cubic Hermite between samples: a planned motion is smooth, and at 125 Hz a straight line
        between samples would be wrong by more than a laser tracker's noise. Times outside the
        stream take its first or last position at rest.
        """
        if self.static or self.t.size < 2:
            index = self.nearest(np.asarray(t))
            return self.q[index], np.zeros(np.shape(t) + self.q.shape[1:])
        inside = np.clip(t, self.t[0], self.t[-1])
        moving = (inside == t)[..., None]
        q, qd = hermite(self.t, self.q, self.velocity, inside)
        return q, np.where(moving, qd, 0.0)


@dataclass(frozen=True, eq=False)
class Measurements:
    """
    Measured tool poses or points, in the world (measuring) frame.

    Raises
    ------
    DataError
        Shapes that do not fit, values that are not finite, stamps out of order, or a negative
        sigma.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> measured = wt.Measurements([0.0, 0.1], [[0.8, 0.0, 0.4], [0.8, 0.1, 0.4]])
    >>> measured.position.shape, measured.rotation is None
    ((2, 3), True)

    """

    t: Array
    """Stamps on the measurement clock, same epoch as the joint stream, shape (M,) [s]."""
    position: Array
    """Shape (M, 3) [m]."""
    rotation: Array | None = None
    """``R_world_tool``, shape (M, 3, 3); left out, points were measured."""
    sigma: Array | None = None
    """Standard deviation of each position, where the instrument gives it, shape (M,) [m]."""
    noise: PoseNoise | None = None
    """How sure each is in every direction, where the instrument tells it."""
    common: Common | None = None
    """Errors that all samples share; they are fitted along."""

    def __post_init__(self) -> None:
        t = increasing(self.t, 'measurement stamps')
        vars(self).update(t=t, position=readonly(self.position, (t.size, 3), 'measured positions'))
        if self.rotation is not None:
            rotation = readonly(self.rotation, (t.size, 3, 3), 'measured rotations')
            vars(self).update(rotation=rotation)
        if self.sigma is not None:
            sigma = readonly(self.sigma, (t.size,), 'sigma of the measurements')
            if sigma.size and sigma.min() < 0.0:
                raise DataError(
                    f'sigma of the measurements is negative at sample {int(sigma.argmin())}'
                )
            vars(self).update(sigma=sigma)
        rows = 3 if self.rotation is None else 6
        if self.noise is not None and self.noise.root.shape != (t.size, rows, rows):
            raise DataError(
                f'noise of the measurements must have {rows} rows for each of {t.size}'
            )
        if self.common is not None and self.common.change.shape[:2] != (t.size, rows):
            raise DataError(f'common errors must have {rows} rows for each of {t.size} samples')

    def inverted(self) -> Measurements:
        """
        Return the pose of the measuring frame in what was measured; DataError for points.

        A camera on the arm that looks at a fixed board measures the board; inverted it is a camera
        on the arm that the board measures.
        """
        if self.rotation is None:
            raise DataError('only measured poses can be inverted; these are points')
        turn = np.swapaxes(self.rotation, -1, -2)
        position = -(turn @ self.position[..., None])[..., 0]
        change = inverse_error(self.position, self.rotation)
        back = np.asarray(np.linalg.inv(change), dtype=float)
        noise = None if self.noise is None else self.noise.moved(back)
        common = None if self.common is None else self.common.moved(change)
        sigma = self.sigma if noise is None else noise.sigma
        return Measurements(self.t, position, turn, sigma, noise, common)

    def take(self, index: np.ndarray) -> Measurements:
        """Return some of the measurements, by an index of int or of bool (M,)."""
        return Measurements(
            self.t[index],
            self.position[index],
            None if self.rotation is None else self.rotation[index],
            None if self.sigma is None else self.sigma[index],
            None if self.noise is None else self.noise.take(index),
            None if self.common is None else self.common.take(index),
        )


@dataclass(frozen=True, eq=False)
class Signal:
    """
    A sampled side signal, such as a temperature or the wrench on the tool.

    Raises
    ------
    DataError
        No samples, shapes that do not fit, values that are not finite, or stamps out of order.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> warming = wt.Signal([0.0, 600.0], [20.0, 26.0])
    >>> print(warming.at(300.0), 'degC')
    23.0 degC

    """

    t: Array
    """Stamps on the joint clock, strictly increasing, shape (K,) [s]."""
    value: Array
    """Temperatures [degC], or force and torque [N, N m], shape (K,) or (K, 6)."""
    held: bool = False
    """A sample is in force until the next, as in a running twin; else it is straight between them."""

    _columns: ClassVar[int | None] = 6

    def __post_init__(self) -> None:
        t = increasing(self.t, 'signal stamps')
        if t.size == 0:
            raise DataError('a signal is empty; leave it out of the recording')
        shape = (t.size,) if np.ndim(self.value) == 1 else (t.size, self._columns)
        vars(self).update(t=t, value=readonly(self.value, shape, 'signal values'))

    def at(self, t: Array) -> Array:
        """Return the signal at times of any shape [s]; beyond its ends the first or last sample."""
        if self.held:
            in_force = np.maximum(np.searchsorted(self.t, t, side='right') - 1, 0)
            return np.asarray(self.value[in_force])
        if self.value.ndim == 1:
            return np.interp(t, self.t, self.value)
        columns = [np.interp(t, self.t, column) for column in self.value.T]
        return np.stack(columns, axis=-1)


@dataclass(frozen=True, eq=False)
class JointSignal(Signal):
    """A sampled signal with a value for every joint, shape (K, n), such as efforts [N m, or N]."""

    _columns: ClassVar[int | None] = None


COLDEST, HOTTEST = -273.15, 200.0
"""Temperatures that can be meant [degC]; above, it must be kelvin."""


def checked_temperature(celsius: float) -> float:
    """Return a temperature [degC]; DataError for none, or for one that must be in kelvin."""
    if not np.isfinite(celsius) or celsius < COLDEST:
        raise DataError(f'the temperature is {celsius} degC, which is no temperature')
    if celsius > HOTTEST:
        raise DataError(
            f'the temperature is {celsius:.6g} degC, which looks like kelvin; give degC'
        )
    return celsius


class Counted(NamedTuple):
    """How joint positions were made of what the controller shows: ``matrix @ shown + offset``."""

    matrix: Array
    """Shape (n, n)."""
    offset: Array
    """Shape (n,) [rad or m]."""

    def as_mapping(self) -> dict[str, list[Any]]:
        """Return it as plain values, as files have it."""
        return {name: value.tolist() for name, value in self._asdict().items()}

    @classmethod
    def from_mapping(cls, entry: Mapping[str, Any], n: int) -> Counted:
        """
        Return that of plain values; n: joints of the robot.

        Raises DataError: they are of another number of joints, or no numbers.
        """
        shapes = {'matrix': (n, n), 'offset': (n,)}
        if not (isinstance(entry, Mapping) and entry.keys() >= shapes.keys()):
            raise DataError(
                "how joints are counted is told by 'matrix' and 'offset'; both are needed"
            )
        return cls(*(readonly(entry[key], shape, key) for key, shape in shapes.items()))


@dataclass(frozen=True, eq=False)
class Recording:
    """
    One recording of the cell.

    Raises
    ------
    DataError
        A signal of the wrong shape, or an unknown wrench frame.

    Examples
    --------
    >>> import numpy as np
    >>> import weld_twin_core as wt
    >>> t = np.linspace(0.0, 1.0, 11)
    >>> commanded = wt.Recording('day 1', wt.JointMotion(t, np.zeros((11, 6))))
    >>> tracker = wt.Measurements(t, np.zeros((11, 3)))
    >>> commanded.with_measured(tracker).measured.t.size
    11

    """

    name: str
    joints: JointMotion
    measured: Measurements | None = None
    wrench: Signal | None = None
    """Force and torque on the tool, in ``wrench_frame``, shape (K, 6) [N, N m]."""
    wrench_frame: str = 'tool'
    """'tool', or 'base' for a wrench given in the base frame."""
    temperature: Signal | None = None
    """Shape (K,) [degC]."""
    epoch_ns: int = 0
    """What the stamps count from, [ns] since 1970."""
    notes: tuple[str, ...] = ()
    """What a reader should know of it, in sentences."""
    incomplete: tuple[str, ...] = ()
    """What of it is missing, in sentences: messages its recorder knows were sent, and streams that
    begin late or end early against the others."""
    contacts: Contacts | None = None
    """What the tool point touched in every posture, in place of measured positions."""
    simulated: bool = False
    """Whether it says of itself that a simulator made it, with or without noise."""
    effort: JointSignal | None = None
    """Effort of each joint as the controller measured it, shape (K, n) [N m, or N of a slide];
    there where springs are to take it."""
    effort_holds: bool = True
    """The effort is what holds the load, as ROS means it; else it is the load itself."""
    images: Sightings | None = None
    """What cameras saw, of which the measurements were made; see `bundle`."""
    counted: Counted | None = None
    """How the controller counts the joints, where it is known to count otherwise than the robot."""
    later: float = 0.0
    """How much later its stamps are on the clock by which effects are dated [s]; see `on_one_clock`."""

    def __post_init__(self) -> None:
        if self.contacts is not None and self.contacts.size != self.joints.t.size:
            raise DataError(
                f'{self.name} has {self.contacts.size} contacts and {self.joints.t.size} '
                'postures; every posture touches one thing'
            )
        if self.wrench_frame not in _WRENCH_FRAMES:
            raise DataError(
                f'wrench_frame must be one of {", ".join(_WRENCH_FRAMES)}, '
                f'got {self.wrench_frame!r}'
            )
        n = self.joints.q.shape[1]
        sides: tuple[tuple[str, Signal | None, tuple[int, ...]], ...] = (
            ('wrench', self.wrench, (6,)),
            ('temperature', self.temperature, ()),
            ('effort', self.effort, (n,)),
        )
        for name, signal, wanted in sides:
            if signal is not None and signal.value.shape[1:] != wanted:
                shape = ', '.join(['K', *map(str, wanted)]) if wanted else 'K,'
                raise DataError(
                    f'{name} of recording {self.name!r} must have shape ({shape}), '
                    f'got {signal.value.shape}'
                )

    @property
    def load_of_effort(self) -> float:
        """Return the load torque for each N m of effort; 0 where no effort was measured."""
        return 0.0 if self.effort is None else -1.0 if self.effort_holds else 1.0

    @property
    def sides(self) -> tuple[Signal | None, Signal | None, JointSignal | None]:
        """Return wrench, temperature and effort."""
        return self.wrench, self.temperature, self.effort

    def at(self, t: Array) -> tuple[Array, Array, Array | None, Array | None, Array | None]:
        """
        Return joint position and velocity, wrench, temperature and effort at times of any shape [s].

        What belongs to the stamps of the recording's own measurements is worked out once: a fit
        asks for it again and again.
        """
        if self.measured is not None and t is self.measured.t:
            return self._at_measured
        return self._looked_up(t)

    @cached_property
    def _at_measured(self) -> tuple[Array, Array, Array | None, Array | None, Array | None]:
        assert self.measured is not None
        result = self._looked_up(self.measured.t)
        _kept(result)
        return result

    @cached_property
    def sides_at_joints(self) -> list[Array | None]:
        """Return wrench, temperature and effort at the joint stamps, worked out once."""
        result = [None if side is None else side.at(self.joints.t) for side in self.sides]
        _kept(result)
        return result

    def _looked_up(
        self, t: Array
    ) -> tuple[Array, Array, Array | None, Array | None, Array | None]:
        wrench, warm, effort = (None if side is None else side.at(t) for side in self.sides)
        return (*self.joints.at(t), wrench, warm, effort)

    @property
    def dated(self) -> bool:
        """Return whether its stamps count from a date: those of a simulation, say, do not."""
        return self.epoch_ns >= FIRST_DATE_NS

    @property
    def clock_ns(self) -> int:
        """Return what instants of effects count from, [ns] since 1970."""
        return self.epoch_ns - round(self.later * 1e9)

    @property
    def span_ns(self) -> tuple[int, int]:
        """Return first and last joint stamp [ns]."""
        ends = (round(float(self.joints.t[k]) * 1e9) for k in (0, -1))
        first, last = (self.epoch_ns + end for end in ends)
        return first, last

    @property
    def seen(self) -> Measurements:
        """Return what was measured; `DataError` where nothing was."""
        if self.measured is None:
            raise DataError(f'{self.name} holds no measured poses or points')
        return self.measured

    @property
    def touched(self) -> Contacts:
        """Return the contacts; `DataError` where there are none."""
        if self.contacts is None:
            raise DataError(f'{self.name} holds no contacts')
        return self.contacts

    def with_measured(self, measured: Measurements | None) -> Recording:
        """Return the recording with other measurements, or none, beside the same motion."""
        return replace(self, measured=measured)

    def at_temperature(self, celsius: float) -> Recording:
        """Return the recording with one temperature [degC] all along; DataError for none."""
        warm = np.array([checked_temperature(celsius)])
        return replace(self, temperature=Signal(self.joints.t[:1], warm))

    def looking_back(self) -> Recording:
        """
        Return the recording with its side signals straight between samples.

        A running twin has to hold what it heard last; an analysis of the past knows the sample
        after as well.
        """
        pairs = zip(('wrench', 'temperature', 'effort'), self.sides, strict=True)
        straight: Any = {k: replace(s, held=False) for k, s in pairs if s is not None}
        return replace(self, **straight)

    def thinned(self, measurements: int, joints: int) -> Recording:
        """
        Return the recording with about so many measurements and joint states at most.

        Both are taken evenly over the whole recording, each with a note: play, warm-up and drift
        depend on all that went before, so no stretch is left out. Joint velocity is that of the
        full stream. Stations stay whole.
        """
        if self.joints.static:
            return self
        out = self
        if self.measured is not None and self.measured.t.size > measurements:
            count = self.measured.t.size
            index = spread_over(count, measurements)
            note = f'{index.size} of {count} measurements are used, evenly over the recording'
            thinned = self.measured.take(index)
            out = replace(out, measured=thinned, notes=(*out.notes, note))
        step = -(-self.joints.t.size // joints)
        if step > 1:
            motion = self.joints
            index = np.append(np.arange(0, motion.t.size - 1, step), motion.t.size - 1)
            kept = JointMotion(motion.t[index], motion.q[index], motion.velocity[index])
            rate = 0.5 * (index.size - 1) / float(motion.t[-1] - motion.t[0])
            note = (
                f'{index.size} of {motion.t.size} joint states are used, evenly over the '
                f'recording; motion above {rate:.0f} Hz is not seen'
            )
            out = replace(out, joints=kept, notes=(*out.notes, note))
        return out


def _kept(values: Iterable[Array | None]) -> None:
    """Make arrays that are handed out again and again read-only."""
    for value in values:
        if value is not None:
            value.setflags(write=False)


def on_one_clock(recordings: Iterable[Recording]) -> tuple[Recording, ...]:
    """
    Return recordings with their dates on one clock, that of the first.

    Stamps without a date tell of themselves alone: where such a recording begins before the one given
    before it has ended, it is taken to follow it a second later.
    """
    out: list[Recording] = []
    for recording in recordings:
        if out and recording.dated and out[0].dated:
            later = (recording.epoch_ns - out[0].epoch_ns) * 1e-9
        else:
            free = out[-1].joints.t[-1] + out[-1].later + 1.0 if out else -np.inf
            later = max(float(free - recording.joints.t[0]), 0.0)
        out.append(replace(recording, later=later) if later != recording.later else recording)
    return tuple(out)
