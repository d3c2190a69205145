# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a robot program says of motion, whatever language it is written in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from ...arrays import Array

Kind = Literal['joint', 'linear', 'circular', 'unknown']


class Use(NamedTuple):
    """
    One use of a point by a move.

    A point that is a pose is used as ``before @ point @ after``: the base frame stands before
    it, a shift in the tool's own frame after it. Joint positions are used as they are.
    """

    point: int
    """Which of the program's points."""
    before: Array
    after: Array
    """Shape (4, 4) [m]."""
    leads: bool = True
    """False for a place derived from the point, such as an approach above it: it goes along when
    the point is moved and has no say in where to."""


class Move(NamedTuple):
    """One move."""

    kind: Kind
    """'joint', 'linear', 'circular'; or 'unknown', after which nobody knows where the arm is."""
    end: Use | None
    """
    None where nobody knows the point. Joint positions of a linear move stand for the pose they make, and
    say how an arm of more than six joints stands there.
    """
    tool: Array
    """``T_flange_tool``, the flange that of the robot's model, shape (4, 4) [m]."""
    via: Use | None = None
    """A place on the arc of a circular move."""
    speed: float = 0.1
    """Of the tool [m/s]; of a joint move the share of the joints' speeds."""
    stop: bool = True
    """The arm comes to rest at the end; else it goes on with the next move."""
    dwell: float = 0.0
    """How long it stays there [s]."""
    duration: float = 0.0
    """How long it takes, where the program says so [s]; else 0."""
    suits: Callable[[Array], Array] | None = None
    """Takes joint positions (K, n), says which of them are the posture the program asks for."""
    astray: Callable[[Array, Array], tuple[int, ...]] | None = None
    """Takes joint positions (n,) before and after a correction, returns the numbers of the axes, counted
    from 1, that the second has where the flags written with the point do not have them."""
    where: str = ''
    """File and line, for messages."""
    seam: int = 0
    """Moves of one number are corrected together or not at all."""
    why: str = ''
    """Of an unknown move, why it is not understood."""
    along: bool = True
    """The frame that a linear or circular move is given in goes along with a positioner. Where it
    stands still, the positioner must, too."""

    @property
    def uses(self) -> list[Use]:
        """Return the uses of points, the place on the way first."""
        return [use for use in (self.via, self.end) if use is not None]


@dataclass(frozen=True, eq=False)
class MoveProgram:
    """Points, and moves between them."""

    points: tuple[Array, ...]
    """A pose, shape (4, 4) [m], or joint positions, shape (n,) [rad or m]."""
    pieces: tuple[tuple[Move, ...], ...]
    """Moves that follow each other; where a piece begins, nobody knows where the arm is."""
    axes: tuple[Array, ...] = ()
    """Of every point the positions of the external axes, shape (m,) [rad or m]: the first joints
    of the robot, those of a positioner among them. Left out, there are none."""

    def with_points(self, points: Sequence[Array]) -> MoveProgram:
        """Return the same moves between other points."""
        return replace(self, points=tuple(points))

    @property
    def external(self) -> int:
        """Return how many of the robot's first joints are external axes."""
        return self.axes[0].size if self.axes else 0

    def external_at(self, use: Use) -> Array:
        """Return where the external axes are to be at a use, shape (m,) [rad or m]."""
        return self.axes[use.point] if self.axes else np.zeros(0)

    def place(self, use: Use) -> Array:
        """Return where a use leads: ``T_base_tool``, shape (4, 4), or joints, shape (n,)."""
        point = self.points[use.point]
        if point.ndim == 1:
            return point
        return np.asarray(use.before @ point @ use.after)
