# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Wear: the tool gets shorter along its own axis while it works, by rate * log(1 + slowing t) / slowing.

A tip that is sharp wears fast, and slower the blunter it is: the rate falls off as 1 / (1 + slowing
t). With no slowing it draws back evenly.
"""

from collections.abc import Iterable

import numpy as np

from .effect import Effect, Traits, register
from .view import Array, Parameter, Robot, Shift, Stage, Value, View
from .wording import number

_SLOWED = (0.0, 0.5)
"""Slowing over the recording's length that a search starts from: none, and a rate down by a third."""
_SMALL = 1e-4
"""Below it log(1 + x) / x is its series; there the two differ by 1e-13."""


@register
class Wear(Effect):
    """The tool centre point draws back along the tool's z axis, from each recording's start on."""

    rate: Value = 0.0
    slowing: Value = 0.0

    traits = Traits(
        title='tool wear',
        meaning='the tip of the tool wears away',
        formula='tool centre point → tool centre point − rate log(1 + slowing (t − t_first)) / '
        "slowing along the tool's z, − rate (t − t_first) where slowing is 0",
        entered='tool',
        depends_on='time',
        endless=True,
        place='tool',
        common=False,
    )
    of = 'robot'
    stage = Stage.LINK
    parameters = (
        Parameter('rate', 'm/s', typical=1e-6).plausible(
            (2e-6, 1e-4),
            'derived: a tip that loses a millimetre in ten minutes; 6 mm in a minute is cut',
        ),
        Parameter('slowing', '1/s', typical=0.01, lower=0.0, linear=False).plausible(
            (0.02, 0.0, 0.2),
            'derived: a sharp tip is blunt, and wears half as fast, after a minute or so; '
            'within some seconds it is chipped, not worn',
        ),
    )
    needs = frozenset({'time'})

    def displace(self, view: View) -> Shift:
        """Return minus what is worn off along the tool's z, in the flange's axes."""
        share, _ = _slowed(self.number('slowing') * view.elapsed)
        return _shorter(view, self.number('rate') * view.elapsed * share)

    def gradient(self, view: View) -> list[Shift | None]:
        """Return what is worn off for a rate of one, and by how much less it is with slowing."""
        t = view.elapsed
        share, falls = _slowed(self.number('slowing') * t)
        return [_shorter(view, t * share), _shorter(view, self.number('rate') * t**2 * falls)]

    def atoms(self, view: View) -> list[Shift]:
        return [_shorter(view, view.elapsed * _slowed(self.number('slowing') * view.elapsed)[0])]

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Yield a tip that wears evenly, and one that has slowed down by the end."""
        span = max(float(np.max(view.elapsed, initial=0.0)), 1.0)
        for slowed in _SLOWED:
            yield cls(0.0, slowed / span)

    def remedy(self, robot: Robot) -> str:
        hour = self._plain('rate') * 3.6e6
        return (
            f'Renew or measure the tip of the tool: along its axis it draws back by {number(hour)} mm '
            'per hour.'
        )


def _slowed(x: Array) -> tuple[Array, Array]:
    """Return log(1 + x) / x and its derivative, for x of any shape, not negative."""
    safe = np.maximum(x, _SMALL)
    share = np.log1p(safe) / safe
    falls = (1.0 / (1.0 + safe) - share) / safe
    few = x < _SMALL
    return np.where(few, 1.0 - 0.5 * x, share), np.where(few, -0.5 + 2.0 / 3.0 * x, falls)


def _shorter(view: View, worn: Array) -> Shift:
    along = view.robot.T_flange_tool[:3, 2]
    return {('tool', k): -float(along[k]) * worn for k in range(3)}
