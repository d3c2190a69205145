# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a new program is to do, whatever language it is written in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from weld_twin_core.arrays import Array

from ..context import Context
from ..controllers import ExternalAxis


class ExportMove(NamedTuple):
    """One move."""

    kind: Literal['joint', 'linear']
    """'joint' or 'linear'."""
    q: Array
    """Joint positions of the model at its end, shape (n,)."""
    pose: Array
    """The tool there, in the controller's robot frame, shape (4, 4) [m]."""
    speed: float
    """Of the tool [m/s]; of a joint move what its share of joint speed makes of it."""
    share: float
    """Of the joints' speeds."""
    stop: bool = True
    dwell: float = 0.0
    """[s]"""
    duration: float = 1.0
    """How long it takes [s]."""
    comment: str = ''


@dataclass(frozen=True, eq=False)
class Exported:
    """A program to write."""

    name: str
    """Letters, digits and underscores, as all controllers take it."""
    moves: tuple[ExportMove, ...]
    context: Context
    tool: Array
    """On the controller's flange, shape (4, 4) [m]."""
    trigger: int
    """Number of the digital output that tells the instrument when to measure."""
    stations: bool
    """The output is on while the arm stands; else from the first to the last move."""
    comments: tuple[str, ...] = ()

    def joints(self, move: ExportMove) -> list[float]:
        """Return the joints of a move as the controller shows them, degrees or mm."""
        return self.context.degrees().numbers(move.q, [0.0] * self.context.robot.n)

    @property
    def external(self) -> tuple[ExternalAxis, ...]:
        """Return the external axes that the controller has."""
        return self.context.controller.external

    def labelled(self, move: ExportMove, own: str) -> dict[str, float]:
        """
        Return the joints of a move as shown, by what the controller calls them.

        own: a form with a number, of the arm's joints; external axes follow in the order of their
        names.
        """
        names = [own.format(k + 1) for k in range(self.context.axes)]
        labels = [*names, *(axis.label for axis in self.external)]
        shown = list(zip(labels, self.joints(move), strict=True))
        return dict(shown[: len(names)] + sorted(shown[len(names) :]))

    @property
    def joint_sizes(self) -> Array:
        """Return the speed limits of the joints, shape (n,) [rad/s or m/s]."""
        return np.asarray(self.context.robot.max_velocity)


def move_count(program: Exported) -> int:
    """Return how many moves a program has."""
    return len(program.moves)


def comma(values: list[float], digits: int) -> str:
    """Return numbers with commas between, no minus before a zero."""
    return ', '.join(f'{0.0 if abs(v) < 0.5 * 10.0**-digits else v:.{digits}f}' for v in values)
