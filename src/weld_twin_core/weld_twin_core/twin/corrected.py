# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Constant effects written into the robot model, for controllers that load numbers only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..arm.chain import base_frame, root_frame, tool_frame
from ..arm.robot import Robot
from ..arm.rotation import transform
from ..effects.effect import Effect
from ..effects.geometry import ChannelError, FrameError
from ..effects.loads import Payload


def corrected(robot: Robot, effects: Sequence[Effect]) -> tuple[Robot, tuple[Effect, ...]]:
    """
    Return the robot with the constant effects in its own numbers, and the effects left over.

    Joint offsets go into ``theta`` (``d`` of a prismatic joint), link errors into their rows,
    base and tool errors into the frames, a payload to the one declared. Everything else that
    depends on the motion, load or temperature stays an effect.

    Parameters
    ----------
    robot : Robot
    effects : sequence of Effect

    Raises
    ------
    ModelError
        The robot has no joint that an effect names.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> longer = wt.effects.LinkLength('elbow_joint', da=0.001)
    >>> play = wt.effects.Backlash('elbow_joint', width=5e-4)
    >>> robot, left = wt.corrected(wt.load('ur5'), [longer, play])
    >>> print(round(robot.a[2] - wt.load('ur5').a[2], 6), 'm;', left[0].name, 'is left')
    0.001 m; backlash is left

    """
    remaining = []
    for effect in effects:
        if isinstance(effect, ChannelError):
            robot = _with_row(robot, effect)
        elif isinstance(effect, FrameError):
            robot = _with_frame(robot, effect)
        elif isinstance(effect, Payload) and robot.payload_mass + float(effect.mass) > 0.0:
            robot = _with_payload(robot, effect)
        else:
            remaining.append(effect)
    return robot, tuple(remaining)


def joint_offsets(robot: Robot, effects: Sequence[Effect]) -> np.ndarray:
    """Return how much further than its reading each joint stands, (n,), as controllers add it."""
    out = np.zeros(robot.n)
    for effect in effects:
        if isinstance(effect, ChannelError) and effect.channel == 'q':
            out[robot.index(str(effect.site))] += _value(effect)
    return out


def _value(effect: Effect) -> float:
    return float(getattr(effect, effect.parameters[0].name))


def _with_row(robot: Robot, effect: ChannelError) -> Robot:
    k = robot.index(str(effect.site))
    key = effect.channel
    if key == 'q':
        key = 'd' if robot.prismatic[k] else 'theta'
    values = np.array(getattr(robot, key))
    values[k] += _value(effect)
    change: dict[str, Any] = {key: values}
    return replace(robot, **change)


def _with_frame(robot: Robot, effect: FrameError) -> Robot:
    vector = effect.vector()
    shift = {(effect.channel, k): vector[k] for k in range(6)}
    if effect.channel == 'base':
        return robot.with_frames(base=transform(*base_frame(robot, shift)))
    if effect.channel == 'root':
        return replace(robot, T_root_base=transform(*root_frame(robot, shift)))
    return robot.with_frames(tool=transform(*tool_frame(robot, shift)))


def _with_payload(robot: Robot, effect: Payload) -> Robot:
    mass = robot.payload_mass + float(effect.mass)
    moment = robot.payload_mass * robot.payload_com + effect.mass * np.asarray(effect.com)
    return replace(robot, payload_mass=mass, payload_com=moment / mass)
