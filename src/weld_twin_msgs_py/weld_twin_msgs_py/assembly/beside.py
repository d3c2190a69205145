# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joints that come along with a robot's own: a gripper, a positioner, or a track that carries it."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from math import isfinite

MOVED = 2e-3
"""Way [rad or m] of a joint that has moved: more than an encoder's noise, less than a weld shows."""


class Beside:
    """
    Keeps the joints of messages that are none of the robot's, and which of them move.

    robot: its name.
    own: its joints. Where all of them come behind another prefix, too, these are another robot's;
    one alone is not: controllers call the track of a robot `rail_joint_1`, or `group_2/joint_1`.
    """

    def __init__(self, robot: str, own: Sequence[str]) -> None:
        self._robot, self._own = robot, tuple(own)
        self._first: dict[str, float] = {}
        self._others: set[str] = set()
        self.moving: list[str] = []

    def take(self, names: Sequence[str], positions: Sequence[float]) -> None:
        """Take joints and where they are [rad or m]."""
        for name, at in zip(names, positions, strict=False):
            first = self._first.get(name)
            if first is None:
                if name in self._others or not isfinite(at):
                    continue
                self._others |= self._of_another(names)
                if name not in self._others:
                    self._first[name] = at
            elif abs(at - first) > MOVED and name not in self.moving:
                self.moving.append(name)

    def _of_another(self, names: Sequence[str]) -> set[str]:
        """Return the names that are all of the robot's joints behind a prefix."""
        last = self._own[-1]
        prefixes = {name.removesuffix(last) for name in names if name.endswith(last)}
        sets = ({prefix + own for own in self._own} for prefix in prefixes)
        return {name for each in sets if each <= set(names) for name in each}

    @property
    def remark(self) -> str:
        """Return which there are, in a sentence; empty where there are none."""
        if not self._first:
            return ''
        return f'joints that are none of robot {self._robot!r} are left out: ' + ', '.join(
            sorted(self._first)
        )

    def warning(self, known: Collection[str] = ()) -> str:
        """
        Return which of them move, in a sentence; empty where none does.

        known: those that do not carry the arm.
        """
        moving = sorted(set(self.moving).difference(known))
        if not moving:
            return ''
        return (
            f'{" and ".join(moving)} moved and {"is" if len(moving) == 1 else "are"} none of the '
            f'joints of robot {self._robot!r}: where one carries the arm, its travel is missing in '
            'every pose; give a robot that has it, or name it in joints_beside if it carries nothing'
        )
