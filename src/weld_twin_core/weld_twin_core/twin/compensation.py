# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Commands that put the real tool where the nominal model wanted it, and models that know better.

Newton on the joint commands, all samples at once, with the nominal Jacobian: effects are small,
so every round takes away all but some thousandths of what is left. Effects with memory couple
the samples; for them the rounds are a fixed-point iteration on the whole motion, and a round that
does not help (a resonance answers too much) is taken back and tried with half the step.

Controllers that load numbers only get the constant effects written into the robot model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arm.chain import base_frame, chain_jacobian, frames, root_frame, tool_frame
from ..arm.robot import Robot
from ..arm.rotation import missing, moved, transform
from ..arrays import Array
from ..effects.effect import Effect, MemoryEffect, Stage
from ..effects.geometry import ChannelError, FrameError
from ..effects.loads import Payload
from ..motion.inverse.newton import least_step
from ..recording import JointMotion, Recording
from .twin import Twin

_CLOSED = 1e-12
"""Error [m, rad] that is rounding; nothing is left to correct."""
_LEAST_SHARE = 1e-3
"""Share of a step below which no shorter one is tried: the sample stays as it is."""
TORCH = 0.1
"""Distance [m] at which a turn of the tool is compared with a shift: a marker's, a torch's."""
_METRES = np.repeat([1.0, TORCH], 3)
"""What is missing to a pose, (6,) [m, rad], counts in metres by this [1, m/rad]."""
_SINGULAR = 1e-6
"""Damping of a step [m^2]: joints hardly turn where a radian of them moves the tool by less than a
millimetre. Undamped, those of a singular wrist turn by 0.7 rad after a milliradian that is out of reach,
and leave the tool farther off than it was."""


@dataclass(frozen=True, eq=False)
class Compensation:
    """
    Compensated commands and what they gain by the model.

    Examples
    --------
    `compensate` makes it.

    >>> import weld_twin_core as wt
    >>> sorted(wt.Compensation.__dataclass_fields__)
    ['after', 'before', 'left_out', 'motion']

    """

    motion: JointMotion
    """Same stamps as the nominal commands."""
    before: Array
    after: Array
    """Tool minus wanted, linear part first, with the nominal and the compensated commands, shape
    (N, 6) [m, rad]."""
    left_out: tuple[Effect, ...]
    """Effects of the model that no joint command can mend."""

    @property
    def rms(self) -> tuple[float, float]:
        """Return the RMS distance of the tool from where it is wanted, before and after [m]."""
        return rms_of(self.before), rms_of(self.after)


def compensate(
    robot: Robot,
    effects: Sequence[Effect],
    recording: Recording,
    rounds: int = 40,
    trust: Array | None = None,
) -> Compensation:
    """
    Return the commands under which an arm with effects goes where the arm without goes.

    Parameters
    ----------
    robot : Robot
        With the base and tool frames that hold for both.
    effects : sequence of Effect
        What acts on the real arm.
    recording : Recording
        Its joints are the nominal commands; wrench and temperature are used where effects do.
    rounds : int
        Most Newton rounds.
    trust : array, shape (N,), optional
        Share of the way that each sample is moved, between 0 and 1, such as less where the model
        was never measured; left out, all of it.

    Returns
    -------
    Compensation

    Raises
    ------
    ModelError
        An effect that this robot cannot have.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> robot = wt.load('ur5')
    >>> plan = wt.plan(robot, wt.default_seam(robot), rate_hz=20.0)
    >>> bent = [wt.effects.LinkTwist('elbow_joint', dalpha=5e-4)]
    >>> found = wt.compensate(robot, bent, wt.Recording('seam', plan.motion))
    >>> found.rms[0] > 1e-5, found.rms[1] < 1e-9
    (True, True)

    """
    acting = tuple(e for e in effects if commandable(e))
    real = Twin(robot, acting)
    wanted, first = Twin(robot).poses(recording).matrices, real.poses(recording).matrices
    before = missing(wanted, first)
    goal = wanted if trust is None else moved(first, before * trust[:, None])
    q = _solved(real, recording, goal, rounds)
    motion = _commands(recording.joints, q)
    after = missing(wanted, real.poses(replace(recording, joints=motion)).matrices)
    left_out = tuple(e for e in effects if not commandable(e))
    return Compensation(motion, -before, -after, left_out)


def beyond_limits(robot: Robot, shift: Array, dt: Array) -> dict[int, str]:
    """
    Return the steps at which a correction in itself asks a joint for more than its limits, and how.

    shift: what is added to joint positions, (N, n) [rad, m]; a step of play, most of all.
    dt: from each to the next, (N - 1,) [s].
    """
    out: dict[int, str] = {}
    rate = np.diff(shift, axis=0) / dt[:, None]
    gain = np.diff(rate, axis=0) / (0.5 * (dt[1:] + dt[:-1]))[:, None]
    for values, power, limit in (
        (np.abs(rate), '', robot.max_velocity),
        (np.abs(gain), '^2', robot.max_acceleration),
    ):
        for k, joint in np.argwhere(values > limit):
            unit = f'{"m" if robot.prismatic[joint] else "rad"}/s{power}'
            out.setdefault(
                int(k),
                f'the correction alone would ask {robot.joint_names[joint]} for {values[k, joint]:.3g} '
                f'{unit} between these points, and the robot file allows {limit[joint]:.3g}',
            )
    return out


def _solved(real: Twin, recording: Recording, goal: Array, rounds: int) -> Array:
    """Return the joint positions, shape (N, n), that put the real tool where it is to be."""
    motion = recording.joints
    coupled = any(isinstance(effect, MemoryEffect) for effect in real.effects)
    q, share = motion.q, np.ones((motion.t.size, 1))
    error = missing(goal, real.poses(recording).matrices)
    for _ in range(rounds):
        live = (np.abs(error).max(axis=1, keepdims=True) > _CLOSED) & (share > _LEAST_SHARE)
        if not live.any():
            break
        step = least_command(chain_jacobian(real.robot, frames(real.robot, q)), error)
        trial = replace(recording, joints=_commands(motion, q + share * step))
        remaining = missing(goal, real.poses(trial).matrices)
        sizes = (np.linalg.norm(each * _METRES, axis=1) for each in (remaining, error))
        helps = np.less(*sizes)
        if coupled:
            helps[:] = rms_of(remaining) < rms_of(error)
        q = np.where(helps[:, None], trial.joints.q, q)
        error = np.where(helps[:, None], remaining, error)
        share = np.where(helps[:, None], share, 0.5 * share)
    return np.asarray(q)


def least_command(slope: Array, error: Array) -> Array:
    """Return steps of joints (..., n) towards poses missed by (..., 6), small beside a singularity."""
    return least_step(slope * _METRES[:, None], error * _METRES, _SINGULAR)


def _commands(nominal: JointMotion, q: Array) -> JointMotion:
    """Return the motion through q, its velocity changed by as much as its position says."""
    if nominal.static or nominal.qd is None or nominal.t.size < 2:
        return JointMotion(nominal.t, q, None, nominal.static)
    return JointMotion(nominal.t, q, nominal.qd + np.gradient(q - nominal.q, nominal.t, axis=0))


def rms_of(error: Array) -> float:
    """Return the RMS length of what is missing to positions, (N, 3) or (N, 6) [m]."""
    return float(np.sqrt((error[:, :3] ** 2).sum(axis=1).mean()))


_BEYOND_COMMANDS = frozenset(
    (
        'measurement_scale',
        'refraction',
        'drift',
        'setup_step',
        'setup_settling',
        'instrument_knock',
    )
)
"""Effects of the measurement, or new in every run: they do nothing to a motion to come."""
_ROUNDING = 'quantization'
"""A rounding of what is commanded, which is as near as it gets: no joint command mends it."""


def commandable(effect: Effect) -> bool:
    """Tell whether joint commands can mend an effect."""
    return acts(effect) and effect.name != _ROUNDING


def acts(effect: Effect | type[Effect]) -> bool:
    """Tell whether an effect moves the tool on a motion to come, which nobody measures."""
    return effect.name not in _BEYOND_COMMANDS and effect.stage not in (Stage.CLOCK, Stage.NOISE)


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
            k = robot.index(str(effect.site))
            key = effect.channel
            if key == 'q':
                key = 'd' if robot.prismatic[k] else 'theta'
            values = np.array(getattr(robot, key))
            values[k] += _value(effect)
            change: dict[str, Any] = {key: values}
            robot = replace(robot, **change)
        elif isinstance(effect, FrameError):
            robot = _with_frame(robot, effect)
        elif isinstance(effect, Payload) and robot.payload_mass + float(effect.mass) > 0.0:
            mass = robot.payload_mass + float(effect.mass)
            moment = robot.payload_mass * robot.payload_com + effect.mass * np.asarray(effect.com)
            robot = replace(robot, payload_mass=mass, payload_com=moment / mass)
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


def _with_frame(robot: Robot, effect: FrameError) -> Robot:
    vector = effect.vector()
    shift = {(effect.channel, k): vector[k] for k in range(6)}
    if effect.channel == 'base':
        return robot.with_frames(base=transform(*base_frame(robot, shift)))
    if effect.channel == 'root':
        return replace(robot, T_root_base=transform(*root_frame(robot, shift)))
    return robot.with_frames(tool=transform(*tool_frame(robot, shift)))
