# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Time delay: the measurement clock is late against the joint clock."""

from dataclasses import dataclass

from ..arm.channels import Shift
from ..arm.robot import Robot
from .effect import Effect
from .hooks import Traits
from .registry import register
from .view import Parameter, Plausible, Stage, Value, View, single
from .wording import size


@register
@dataclass(frozen=True, eq=False)
class TimeDelay(Effect):
    """A measurement stamped t shows the robot as it was at t - delay; stations do not move."""

    delay: Value = 0.0

    name = 'time_delay'
    traits = Traits(
        title='clock delay',
        meaning='the measurements are stamped too late, or too early, by a constant time',
        entered='its clocks',
        depends_on='speed',
        place='clock',
        everywhere=True,
    )
    of = 'robot'
    stage = Stage.CLOCK
    parameters = (
        Parameter(
            'delay',
            's',
            typical=5e-3,
            range=Plausible.even(
                2e-2,
                0.5,
                'derived: buses and filters take milliseconds; half a second is another clock',
            ),
        ),
    )
    needs = frozenset({'velocity', 'time'})

    def displace(self, view: View) -> Shift:
        """Return the delay on the 'clock' channel; the twin samples that much earlier."""
        late = 0.0 * self.number('delay') if view.static else self.number('delay')
        return single(('clock', 0), late, view)

    def gradient(self, view: View) -> list[Shift | None]:
        """Return minus the joint velocity on every joint."""
        return [{('q', i): -view.qd[..., i] for i in range(view.robot.n)}]

    def remedy(self, robot: Robot) -> str:
        delay = self._plain('delay')
        order = 'late' if delay > 0.0 else 'early'
        return (
            f'Fix the clock: the measurements are stamped {size(delay * 1e3)} ms {order} against the '
            'joint states; synchronise both computers or subtract the delay.'
        )
