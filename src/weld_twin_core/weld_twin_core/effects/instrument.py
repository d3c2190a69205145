# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The instrument: its unit of length, its noise, its clock, what its frame stands on, and the air.

A wrong unit reads (1 + scale) times the position in the instrument's own frame. White noise is the
floor, and never a cause. The clock of the measurements is late against that of the joints, or runs
fast or slow. A drift creeps at a constant rate from the recording's first stamp on.

Light bends towards colder, denser air, with a curvature of the gradient of the refractive index
over the index. Over a distance L across the gradient the target seems half of curvature * L^2 off,
towards the warmth; along it, the light runs slower or faster than at the instrument. With r from
the instrument to the target and gradient G, both together are
``p -> p + _BEND (r.r G / 2 - (G.r) r)``. The place of the instrument is the origin of the measuring
frame unless it is given. Another place only adds a turn, a shift and a scale, as multiplying out
shows, which a base pose and a scale of the instrument take up; what bends is the same. A frame whose
origin is nearer than any instrument could stand is not the instrument's own, and with the place
unknown nothing is considered.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from numbers import Real

import numpy as np

from ..errors import ModelError
from .effect import Effect, LinearEffect, Traits, register
from .view import Array, Parameter, Robot, Shift, Stage, Value, View, single
from .wording import number, numbers, size


@register
class MeasurementScale(LinearEffect):
    """A wrong unit of length of the measuring system, about the origin of its frame."""

    scale: Value = 0.0

    traits = Traits(
        title='scale error of the instrument',
        meaning="the instrument's millimetre is too long or too short",
        formula="p → (1 + scale) p, about the world's origin",
        apart={'link_length': 'measure a bar of known length'},
        entered='the scale of the instrument',
        depends_on='place',
        place='instrument',
        common=False,
        everywhere=True,
    )
    of = 'robot'
    stage = Stage.POSE
    parameters = (
        Parameter('scale', '-', typical=5e-5).plausible(
            (1e-4, 2e-3),
            'trackers are within 6 um/m across the beam (user manual of an AT9xx, section 2.8.2); '
            'range derived: 2 mm/m is a wrong length, not an instrument',
        ),
    )

    def per_unit(self, view: View) -> list[Shift]:
        position = view.frames.position
        return [{('pose', k): position[..., k] for k in range(3)}]

    def remedy(self, robot: Robot) -> str:
        return (
            'Have the instrument calibrated, or correct for air temperature: lengths read '
            f'{number(self._plain("scale") * 1e3)} mm per m too long.'
        )


@register
class MeasurementNoise(Effect):
    """Independent errors of ``sigma`` on each coordinate; drawn by the injector only."""

    sigma: Value = 0.0

    traits = Traits(
        depends_on='constant',
        place='instrument',
        cause=False,
        formula='white noise on every coordinate of the measured position; the floor, never a '
        'cause',
    )
    of = 'robot'
    stage = Stage.NOISE
    parameters = (Parameter('sigma', 'm', typical=2e-5, lower=0.0, differentiable=False),)

    def displace(self, view: View) -> Shift:
        """Return nothing: the expected error is zero."""
        return {}

    def draw(self, samples: int, rng: np.random.Generator) -> Array:
        """Return errors of measured positions, shape (samples, 3) [m]."""
        return rng.normal(scale=float(self.sigma), size=(samples, 3))

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Yield nothing: noise is no cause."""
        return ()


@register
class TimeDelay(Effect):
    """A measurement stamped t shows the robot as it was at t - delay; stations do not move."""

    delay: Value = 0.0

    traits = Traits(
        title='clock delay',
        meaning='the measurements are stamped too late, or too early, by a constant time',
        formula='a measurement stamped t shows the robot at t − delay',
        apart={
            'servo_lag': 'record commanded and measured joints side by side, or trigger both recordings '
            'with one signal'
        },
        entered='its clocks',
        depends_on='speed',
        place='clock',
        everywhere=True,
    )
    of = 'robot'
    stage = Stage.CLOCK
    parameters = (
        Parameter('delay', 's', typical=5e-3).plausible(
            (2e-2, 0.5),
            'derived: buses and filters take milliseconds; half a second is another clock',
        ),
    )
    needs = frozenset({'velocity', 'time'})

    def displace(self, view: View) -> Shift:
        """Return the delay on the 'clock' channel; the twin samples that much earlier."""
        late = 0.0 * self.number('delay') if view.static else self.number('delay')
        return single(('clock', 0), late, view)

    def gradient(self, view: View) -> list[Shift | None]:
        return [{('q', i): -view.qd[..., i] for i in range(view.robot.n)}]

    def remedy(self, robot: Robot) -> str:
        delay = self._plain('delay')
        order = 'late' if delay > 0.0 else 'early'
        # A lag is a delay but for its square times half the acceleration, which hardly ever shows.
        alike = ' If joints are commands: drives that all trail by as much look the same.'
        return (
            f'Fix the clock: the measurements are stamped {size(delay * 1e3)} ms {order} against the '
            f'joint states; synchronise both computers or subtract the delay.{alike * (delay > 0.0)}'
        )


@register
class ClockRate(Effect):
    """
    A measurement stamped t shows the robot at t - rate (t - t_first); stations do not move.

    The two clocks agree at the first joint stamp; what they are apart then is `time_delay`.
    """

    rate: Value = 0.0

    traits = Traits(
        title='clock that runs fast or slow',
        meaning='the two clocks drift apart',
        formula='a measurement stamped t shows the robot at t − rate (t − t_first): its clock '
        'runs fast against that of the joints',
        entered='its clocks',
        depends_on='time',
        endless=True,
        place='clock',
        common=False,
    )
    of = 'robot'
    stage = Stage.CLOCK
    parameters = (
        Parameter('rate', 's/s', typical=1e-5, lower=-0.5, upper=0.5, idealised=0.03).plausible(
            (2e-5, 1e-4),
            'oscillators are rated to 10 to 20 ppm (doi.org/10.1186/s40462-024-00512-7, table 1), a '
            'computer gained 14 ppm (ntp.org, NTP-s-sw-clocks-quality); range derived: what '
            'the checks of the data let pass as a clock',
        ),
    )
    needs = frozenset({'velocity', 'time'})

    def displace(self, view: View) -> Shift:
        """Return the delay so far on the 'clock' channel; the twin samples that much earlier."""
        gained = 0.0 * view.elapsed if view.static else view.elapsed
        return {('clock', 0): self.number('rate') * gained}

    def gradient(self, view: View) -> list[Shift | None]:
        """Return minus the joint velocity times the time that the measurement's clock shows."""
        shown = view.elapsed / (1.0 - self.number('rate'))
        return [{('q', i): -view.qd[..., i] * shown for i in range(view.robot.n)}]

    def remedy(self, robot: Robot) -> str:
        ppm = self._plain('rate') * 1e6
        way = 'fast' if ppm > 0.0 else 'slow'
        return (
            f'Synchronise the clocks of both computers all the time: that of the measurements runs '
            f'{size(abs(ppm))} ppm {way}, {size(abs(ppm) * 3.6e-3)} s in an hour.'
        )


@register
class Drift(LinearEffect):
    """A creeping fixture, instrument or pedestal."""

    xyz_rate: Value = (0.0, 0.0, 0.0)

    traits = Traits(
        title='drift of the frame',
        meaning='everything measured creeps with time',
        formula='p → p + xyz_rate (t − t_first)',
        apart={'thermal_growth': 'measure a fixed point beside the arm while it works'},
        entered='what the frame stands on, or of the temperature',
        depends_on='time',
        endless=True,
        place='base',
        common=False,
    )
    of = 'robot'
    stage = Stage.POSE
    parameters = (
        Parameter('xyz_rate', 'm/s', size=3, typical=1e-6).plausible(
            (5e-6, 1e-4),
            'derived: 6 mm in a minute is a fixture that falls; trackers drift by tenths of a '
            'millimetre in two hours (akjournals.com, 606/15/3 p. 60)',
        ),
    )
    needs = frozenset({'time'})

    def per_unit(self, view: View) -> list[Shift]:
        return [{('pose', k): view.elapsed} for k in range(3)]

    def remedy(self, robot: Robot) -> str:
        each = numbers(np.asarray(self.xyz_rate) * 3.6e6)
        return (
            f'Find what creeps (fixture, tripod, pedestal): ({each}) mm per hour along x, y, z of the '
            'measuring frame; measure a fixed point now and then.'
        )


_BEND = 7.86e-4 * 101.325 / 293.15**2
"""By how much the refractive index of air falls [1/K], 9.27e-7 at 20 degC and 101.325 kPa:
n = 1 + 7.86e-4 p / T with p in kPa, less what humidity does (emtoolbox.nist.gov, refractive index
of air calculator, appendix B)."""
_NEAREST = 1.5
"""Distance [m] that the tool keeps from an instrument: nearer, most arms could reach into it, and
the origin is not the instrument's. The bundled arms reach 0.5 to 3 m from their base."""


@register
class Refraction(LinearEffect):
    """
    Air that warms by ``warming`` [K/m] along each axis of the measuring frame bends the sight.

    ``instrument`` is where the line of sight starts, three numbers [m] in the measuring frame;
    left out, its origin.
    """

    warming: Value = (0.0, 0.0, 0.0)
    instrument: Sequence[float] | None = None

    traits = Traits(
        title='bent line of sight',
        meaning='warm air bends the beam of the instrument',
        formula='p → p + κ (r·r warming / 2 − (warming·r) r), r from the instrument (the '
        "world's origin) to p, κ = 9.27e-7 1/K for air",
        apart={'base_pose': 'measure from a second place of the instrument'},
        entered='warm air bent the line of sight',
        depends_on='place',
        place='instrument',
        common=False,
        everywhere=True,
    )
    of = 'robot'
    stage = Stage.POSE
    parameters = (
        Parameter('warming', 'K/m', size=3, typical=1.0).plausible(
            (3.0, 30.0),
            'in still air a line of sight bends by 0.2 mm over 12 m (0.008 in over 40 ft; '
            'Hamar Laser, Stealth series, appendix D, manualshive.com), 3 K/m; range '
            'derived: ten times that is air beside a furnace',
        ),
    )
    options = ('instrument',)

    def check(self, robot: Robot) -> None:
        super().check(robot)
        place = self.instrument
        if place is not None and (
            isinstance(place, str)
            or len(place) != 3
            or not all(isinstance(x, Real) for x in place)
        ):
            raise ModelError(f'refraction: instrument must be three numbers in m, got {place!r}')

    def per_unit(self, view: View) -> list[Shift]:
        """Return how far off the target seems for one kelvin a metre along each axis."""
        sight = view.frames.position - (0.0 if self.instrument is None else self.instrument)
        across = 0.5 * (sight**2).sum(axis=-1)
        seen = (
            _BEND * (across[..., None] * axis - sight[..., k, None] * sight)
            for k, axis in enumerate(np.eye(3))
        )
        return [{('pose', j): each[..., j] for j in range(3)} for each in seen]

    @classmethod
    def applicable(cls, view: View, joint: str | None) -> str | None:
        """Return why the data cannot show it: it has to be known where the instrument stands."""
        nearest = np.linalg.norm(view.frames.position, axis=-1).min(initial=np.inf)
        if nearest < _NEAREST:
            return (
                "the tool comes within 1.5 m of the measuring frame's origin, so that this is not "
                'where an instrument stands'
            )
        return super().applicable(view, joint)

    def remedy(self, robot: Robot) -> str:
        return (
            'Stir the air along the line of sight, shield it from heat or stand the instrument '
            f'nearer: the air warms by ({numbers(self.warming)}) K/m along x, y, z of '
            'the measuring frame and bends it.'
        )
