# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Loaded play: lost motion on the loaded flank, theta -> theta + width / 2 * tau / sqrt(tau^2 + T^2).

A gear with play and a load on it lies on the flank that the load pulls it to, whichever way it
moves; it changes over where the load changes sign, within the torque T that friction holds.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..arm.channels import Shift
from ..arm.robot import Robot
from ..arrays import Array
from ..errors import ModelError
from .backlash import RV
from .curves import load
from .effect import Effect, LinearEffect
from .hooks import Hooked, SearchHooks, Traits
from .registry import register
from .view import Parameter, Plausible, Stage, Value, View

_SHARES = (0.03, 0.15)
"""Torques at which the flank is certain that a search starts from, in the largest load seen."""

_CHANGED = 0.3
"""Share of half the play by which the joint must come off its flank: less looks like an offset."""


class _Search(SearchHooks):
    kind: type[LoadedPlay]

    def constants(self, view: View, joint: str | None) -> Iterable[Effect]:
        """Yield play of a gear that slides easily, where the load keeps it on one flank."""
        torque = load(view, view.robot.index(str(joint)))
        held = _SHARES[0] * float(np.abs(torque).max(initial=0.0))
        if held > 0.0 and not _changes(torque, held):
            yield self.kind(str(joint), 0.0, held)


@register
class LoadedPlay(LinearEffect):
    """Play of full ``width`` whose side the load decides; ``torque`` [N m] is what friction holds."""

    joint: str
    width: Value = 0.0
    torque: float = 1.0

    name = 'loaded_play'
    traits = Traits(
        title='play under load',
        meaning='play whose side the load decides',
        entered="the joint's gear",
        depends_on='load',
        common=False,
        by_motion=True,
    )
    of = 'joint'
    stage = Stage.LINK
    parameters = (
        Parameter(
            'width',
            'rad',
            typical=5e-4,
            lower=0.0,
            range=Plausible(5e-4, 0.0, 2e-2, f'{RV}; see backlash'),
            sliding=Plausible(
                5e-5, 0.0, 5e-3, 'derived: nuts have hundredths of a millimetre of play'
            ),
        ),
    )
    options = ('torque',)
    needs = frozenset({'load'})
    search = Hooked(_Search)

    def check(self, robot: Robot) -> None:
        """Refuse a gear that friction does not hold at all: its flank would jump."""
        super().check(robot)
        if not float(self.torque) > 0.0:
            raise ModelError(f'loaded_play: torque must be above zero, got {self.torque!r}')

    def per_unit(self, view: View) -> list[Shift]:
        i = view.robot.index(self.joint)
        pull = load(view, i)
        return [{('q', i): 0.5 * pull / np.hypot(pull, self.torque)}]

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Yield play of a gear that slides easily, and of one that sticks."""
        torque = load(view, view.robot.index(str(joint)))
        most = float(np.abs(torque).max(initial=0.0))
        for share in _SHARES:
            # Where the load stays on one side, so does the flank, and that is an offset.
            if most > 0.0 and _changes(torque, share * most):
                yield cls(str(joint), 0.0, share * most)

    def remedy(self, robot: Robot) -> str:
        return (
            f'Service or preload the gear of {self.site}: its load lays it on one flank or the other '
            f'of {self._travelled(robot, self._plain("width"))} of play.'
        )


def _changes(torque: Array, held: float) -> bool:
    """Return whether a load, shape (N,), moves a gear from its flank that friction holds so far."""
    return bool(np.ptp(torque / np.hypot(torque, held)) > _CHANGED)
