# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Quantization: the joint is known only to the nearest step of its encoder."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..chain import Shift
from .base import Effect
from .registry import register
from .view import Parameter, Stage, Value, View


@register
@dataclass(frozen=True, eq=False)
class Quantization(Effect):
    """Rounding to a multiple of ``step``; a step of zero rounds nothing."""

    joint: str
    step: Value = 0.0

    name = 'quantization'
    of = 'joint'
    stage = Stage.JOINT
    parameters = (
        Parameter('step', 'rad', typical=2e-4, lower=0.0, differentiable=False, linear=False),
    )

    def displace(self, view: View) -> Shift:
        """Return rounded minus exact position."""
        i = view.robot.index(self.joint)
        step = self.number('step')
        safe = np.where(step > 0.0, step, 1.0)
        error = safe * np.rint(view.joint(i) / safe) - view.joint(i)
        return {('q', i): np.where(step > 0.0, error, 0.0)}

    def gradient(self, view: View) -> list[Shift | None]:
        """Return None: the staircase jumps with its step."""
        return [None]

    @classmethod
    def seeds(cls, view: View, joint: str | None) -> Iterable[Effect]:
        """Yield steps close enough for the next one to be seen, over the joint's travel."""
        q = view.joint(view.robot.index(str(joint)))
        travel = max(float(np.ptp(q)), 1e-3)
        step = 5e-3
        while step > 5e-5:
            yield cls(str(joint), step)
            step /= 1.0 + min(0.1, 0.2 * step / travel)

    def atoms(self, view: View) -> list[Shift]:
        """Return the rounding error itself; its right coefficient is one."""
        return [self.displace(view)]

    def from_atoms(self, coefficients: Array) -> Effect:
        """Return the same staircase: its height and step are one parameter."""
        return self
