# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Thermal growth: a, d -> (1 + coefficient dT) a, d, with dT measured or a warm-up curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real

import numpy as np

from ..arm.channels import Channel, Shift
from ..arm.robot import Robot
from ..arrays import Array
from ..errors import DataError, ModelError
from .effect import LinearEffect
from .hooks import Traits
from .registry import register
from .view import Parameter, Plausible, Stage, Value, View
from .wording import number


@register
@dataclass(frozen=True, eq=False)
class ThermalGrowth(LinearEffect):
    """
    Links grow with temperature against ``reference`` [degC].

    ``links`` names the joints whose rows grow (all when left out). Without a recorded
    temperature, ``warmup: [rise, time_constant]`` [K, s] stands in for it.
    """

    coefficient: Value = 0.0
    reference: float = 20.0
    links: Sequence[str] | None = None
    warmup: Sequence[float] | None = None

    name = 'thermal_growth'
    traits = Traits(
        title='thermal growth',
        meaning='the links grow with temperature',
        entered='warming up, or of the temperature in the cell',
        depends_on='temperature',
        demand=1,
    )
    of = 'links'
    stage = Stage.LINK
    parameters = (
        Parameter(
            'coefficient',
            '1/K',
            typical=1.2e-5,
            range=Plausible(
                2.4e-5,
                -2.4e-5,
                7.2e-5,
                'aluminium alloys grow by 21.5e-6 to 23.8e-6 per K, cast iron by 11e-6 (amesweb.info); '
                'range derived: an arm may warm up three times as much as the place of the sensor',
            ),
        ),
    )
    options = ('reference', 'links', 'warmup')
    needs = frozenset({'temperature'})

    def check(self, robot: Robot) -> None:
        """Refuse unknown links, a reference that is no number and an unusable warm-up curve."""
        super().check(robot)
        if isinstance(self.links, str):
            raise ModelError(f'thermal_growth: links must be a list, got {self.links!r}')
        for name in self.links or ():
            robot.index(name)
        if not isinstance(self.reference, Real):
            raise ModelError(f'thermal_growth: reference must be a number, got {self.reference!r}')
        if self.warmup is not None and not _is_curve(self.warmup):
            raise ModelError(
                'thermal_growth: warmup must be [rise in K, time constant in s above zero], '
                f'got {self.warmup!r}'
            )

    @property
    def at(self) -> str:
        """Return the one link that grows, or the base where several do."""
        return self.links[0] if self.links is not None and len(self.links) == 1 else 'base'

    @property
    def on(self) -> str:
        """Return temperature, or time where a warm-up curve stands in for it."""
        return 'temperature' if self.warmup is None else 'time'

    def rise(self, view: View) -> Array:
        """
        Return the temperature above the reference, shape (N,) [K].

        Raises
        ------
        DataError
            There is neither a recorded temperature nor a warm-up curve.

        """
        if self.warmup is not None:
            return self.warmup[0] * -np.expm1(-view.elapsed / self.warmup[1])
        if view.temperature is None:
            raise DataError(
                'thermal_growth needs a temperature: record /temperature, say it with '
                '--temperature, or give the effect a warmup'
            )
        return view.temperature - self.reference

    def _lengths(self, view: View) -> list[tuple[Channel, float]]:
        robot = view.robot
        rows = range(robot.n) if self.links is None else [robot.index(k) for k in self.links]
        lengths = [((key, i), float(getattr(robot, key)[i])) for i in rows for key in ('a', 'd')]
        return [(channel, length) for channel, length in lengths if length != 0.0]

    def per_unit(self, view: View) -> list[Shift]:
        """Return length times temperature rise; travel of a joint that slides does not grow."""
        rise = self.rise(view)
        return [{channel: length * rise for channel, length in self._lengths(view)}]

    def remedy(self, robot: Robot) -> str:
        links = self.links or ('all links',)
        return (
            'Warm the arm up before welding, or compensate '
            f'{number(self._plain("coefficient") * 1e3)} mm per m and K for {", ".join(links)}.'
        )


def _is_curve(warmup: Sequence[float]) -> bool:
    numbers = [value for value in warmup if isinstance(value, Real)]
    return len(warmup) == len(numbers) == 2 and warmup[1] > 0.0
