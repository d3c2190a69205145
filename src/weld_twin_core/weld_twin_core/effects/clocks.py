# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The clock of the measurements against that of the joints: late, or running fast or slow."""

from .effect import Effect, Traits, register
from .view import Parameter, Robot, Shift, Stage, Value, View, single
from .wording import size


@register
class TimeDelay(Effect):
    """A measurement stamped t shows the robot as it was at t - delay; stations do not move."""

    delay: Value = 0.0

    name = 'time_delay'
    traits = Traits(
        title='clock delay',
        meaning='the measurements are stamped too late, or too early, by a constant time',
        formula='a measurement stamped t shows the robot at t − delay',
        apart={
            'servo_lag': 'record commanded and measured joints side by side, or trigger both recordings '
            'with one signal',
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

    name = 'clock_rate'
    traits = Traits(
        title='clock that runs fast or slow',
        meaning='the two clocks drift apart',
        formula='a measurement stamped t shows the robot at t − rate (t − t_first): its clock '
        'runs fast against that of the joints',
        entered='its clocks',
        depends_on='time',
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
