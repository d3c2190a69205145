# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Measured efforts of the joints, compared with the model's statics: sign, unit, payload, torque constant.

Poses see a measured torque only as its product with a compliance. So a wrong torque constant, and a
load that nobody declared, show here or nowhere: by what differs between effort and statics.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...arm.chain import Frames, frames
from ...arm.dynamics import chain_gravity_torque, payload_torque
from ...arm.robot import Robot
from ...arrays import Array, spread_over
from ...effects.curves import AT_REST
from ...errors import DataError
from ...recording import Recording
from ...twin.features import with_expected_effort
from ..limits import CLEAR, FEW, SAMPLES
from ..result import EffortCause, Efforts, JointEffort
from .evidence import Case, Finding, note, warning

SHAPED = 1.0 - 2.0 * FEW
"""Correlation from which a joint's effort has the shape of its load, whatever the masses. A sign is
told from 0.5 of all joints: rough masses keep 0.9, chance on twenty postures stays below 0.3."""
AGREES = 0.02
"""Share of the load's RMS below which effort and statics agree, which is what torque sensors are good
for; and of the squared difference, that one cause may leave beside what all causes together leave."""


@dataclass(frozen=True)
class _Loads:
    """Statics and measured load, (n, N); what payload, links and more add, (K, n, N)."""

    robot: Robot
    statics: Array
    measured: Array
    payload: Array
    links: Array
    beside: Array

    def correlation(self) -> float:
        """Return how alike both are, every joint about its mean, all together."""
        a, b = (x - x.mean(axis=1, keepdims=True) for x in (self.statics, self.measured))
        size = float(np.sqrt((a * a).sum() * (b * b).sum()))
        return float((a * b).sum()) / size if size > 0.0 else 0.0


def with_sign(recordings: Sequence[Recording], robot: Robot) -> tuple[Recording, ...]:
    """Return recordings whose efforts hold the load, or are it; DataError for others or some."""
    reported = [recording.effort is not None for recording in recordings]
    if not any(reported):
        return tuple(recordings)
    if not all(reported):
        raise DataError(
            f'{recordings[reported.index(False)].name} has no effort of the joints and other recordings '
            'have; record it in all of them, or leave --use-effort out'
        )
    if not any(np.ptp(r.effort.value, axis=0).any() for r in recordings if r.effort is not None):
        raise DataError(
            f'the efforts of {recordings[0].name} never change, so nothing measured them; leave '
            '--use-effort out'
        )
    loads = _loads(recordings, _weighing(robot))
    if robot.mass is not None:
        _refuse_units(loads)
    if 2.0 * loads.correlation() > -1.0:
        return tuple(recordings)
    return tuple(replace(r, effort_holds=not r.effort_holds) for r in recordings)


def compared(recordings: Sequence[Recording], robot: Robot) -> Efforts | None:
    """Return what efforts say beside the model's statics; None where none were measured."""
    if any(recording.effort is None for recording in recordings):
        return None
    loads = _loads(recordings, _weighing(robot))
    gap = loads.measured - loads.statics
    spread = loads.statics - loads.statics.mean(axis=1, keepdims=True)
    size = np.sqrt((spread**2).mean(axis=1))
    weighed = robot.mass is not None
    factors = _factors(loads, size) if weighed else {}
    whole = float(np.sqrt((spread**2).mean()))
    joints = tuple(
        JointEffort(name, float(size[i]), float(np.sqrt((gap[i] ** 2).mean())), factors.get(i))
        for i, name in enumerate(robot.joint_names)
    )
    difference = float(np.sqrt((gap**2).mean())) / whole if whole > 0.0 else 0.0
    causes = _causes(loads, gap) if weighed and difference > AGREES else ()
    sign = recordings[0].effort_holds, loads.correlation()
    return Efforts(*sign, weighed, joints, difference, causes)


def efforts(case: Case) -> Sequence[Finding]:
    """Return what the efforts are, and what they say of payload and torque constants."""
    result = compared(case.recordings, case.model.robot)
    return [] if result is None else [_sign(result), *_differences(result)]


def _differences(result: Efforts) -> Iterator[Finding]:
    if not result.weighed:
        yield note(
            'The robot model has no link masses, so the unit of the efforts is not checked; a '
            'compliance found with them is for each unit of effort.'
        )
    elif result.causes:
        yield warning(_causes_in_words(result))
    elif result.difference > AGREES:
        factors = [f'{j.joint} {j.factor:.2f}' for j in result.joints if j.factor is not None]
        yield note(
            f'Efforts and statics differ by {result.difference:.0%} of the load, and neither a '
            'payload nor the torque constant of one joint explains it: the masses of the links may '
            f'be rough. Measured for each N m of the model: {", ".join(factors)}.'
        )


def _sign(result: Efforts) -> Finding:
    meaning = 'what holds the load' if result.holds else 'the load itself, not what holds it'
    if 2.0 * abs(result.correlation) < 1.0:
        return warning(
            f'Springs take the measured efforts as {meaning}, and nothing confirms that: with '
            f'gravity on the links they correlate by {result.correlation:.2f}.'
        )
    return note(
        f'Springs take the measured efforts as {meaning}: so taken they correlate by '
        f'{result.correlation:.2f} with gravity on the links.'
    )


def _causes_in_words(result: Efforts) -> str:
    words = {
        'payload': '{value:+.2f} kg of payload (standard error {std:.2f}; left {left:.1%})',
        'torque_constant': 'an effort of {joint} that is {value:.3f} times the torque (standard error '
        '{std:.3f}; left {left:.1%})',
        'link_mass': 'a link behind {joint} of {value:.2f} times its mass (left {left:.1%})',
        'link_masses': 'links of {value:.2f} times their masses (left {left:.1%})',
    }
    each = [words[cause.name].format(**vars(cause)) for cause in result.causes]
    alone = 'explains it' if len(each) == 1 else 'explain it, each by itself'
    return (
        f'Efforts and statics differ by {result.difference:.0%} of the load; {" or ".join(each)} '
        f'{alone}. The springs do not need to know which, a planned motion does: weigh what hangs on '
        'the flange, or hold the efforts against a known weight.'
    )


def _weighing(robot: Robot) -> Robot:
    if robot.mass is not None:
        return robot
    return replace(robot, mass=np.ones(robot.n), com=np.zeros((robot.n, 3)))


def _loads(recordings: Sequence[Recording], robot: Robot) -> _Loads:
    parts = [_of_one(recording, robot) for recording in recordings]
    joined = (np.concatenate(each, axis=-1) for each in zip(*parts, strict=True))
    return _Loads(robot, *joined)


def _of_one(recording: Recording, robot: Robot) -> tuple[Array, ...]:
    """Return statics, measured load, what payload and links add, and what else may, by rows."""
    motion = recording.joints
    expected = with_expected_effort(recording, robot, recording.load_of_effort).effort
    assert expected is not None and recording.effort is not None
    at, sign = spread_over(motion.t.size, 2 * SAMPLES), recording.load_of_effort
    measured = sign * recording.effort.at(motion.t[at]).T
    chain = frames(robot, motion.q[at])
    centred = payload_torque(robot, chain, 1.0, np.zeros(3))
    levers = [payload_torque(robot, chain, 1.0, axis) - centred for axis in np.eye(3)]
    beside = [np.ones_like(measured)]
    if not motion.static:
        speed = motion.velocity[at].T
        beside += [np.tanh(speed / AT_REST), speed]
    payload, statics = np.array([centred, *levers]), sign * expected.value[at].T
    return statics, measured, payload, _of_links(robot, chain), np.array(beside)


def _of_links(robot: Robot, chain: Frames) -> Array:
    """Return what each link weighs on the joints, shape (n, n, N): link, joint, sample."""
    assert robot.mass is not None
    each = np.diag(robot.mass)
    arms = (replace(robot, mass=m, payload_mass=0.0) for m in each)
    return np.array([chain_gravity_torque(arm, chain) for arm in arms])


def _factors(loads: _Loads, size: Array) -> dict[int, float]:
    """Return measured load for each N m of the statics, of joints that the statics load."""
    out = {}
    for i in np.flatnonzero(size > 2.0 * FEW * size.max()):
        slope, _ = np.polyfit(loads.statics[i], loads.measured[i], 1)
        out[int(i)] = float(slope)
    return out


def _refuse_units(loads: _Loads) -> None:
    """Refuse efforts that have the shape of the load and another size."""
    size = loads.statics.std(axis=1)
    for i, factor in _factors(loads, size).items() if size.max() > 0.0 else ():
        alike = np.corrcoef(loads.statics[i], loads.measured[i])[0, 1]
        if not abs(alike) > SHAPED or 1.0 / CLEAR <= abs(factor) <= CLEAR:
            continue
        milli = 1e3 / CLEAR <= abs(factor) <= 1e3 * CLEAR
        unit = 'N mm in the place of N m' if milli else 'per cent, or the currents of motors'
        raise DataError(
            f'the effort of {loads.robot.joint_names[i]} is {abs(factor):.3g} times the torque that '
            f'the links of the model weigh: it may be in {unit}; give efforts in N m, mend the '
            'masses of the robot file if they are wrong, or leave --use-effort out'
        )


def _causes(loads: _Loads, gap: Array) -> tuple[EffortCause, ...]:
    """Return what explains the difference by itself, beside offsets and friction of each joint."""
    names = loads.robot.joint_names
    plain = [np.zeros((0, *gap.shape)), *(_only(i, loads.beside) for i in range(len(names)))]
    nuisance = np.concatenate(plain)
    before = _fitted(nuisance, gap)[2]
    offered: list[tuple[str, str | None, Array]] = [
        ('payload', None, loads.payload),
        *(('torque_constant', n, _only(i, loads.statics[None])) for i, n in enumerate(names)),
        *(('link_mass', n, loads.links[[i]]) for i, n in enumerate(names)),
        ('link_masses', None, loads.links.sum(axis=0)[None]),
    ]
    result, every = [], np.concatenate([*(columns for *_, columns in offered), nuisance])
    noise = _fitted(every, gap)[2]
    for name, joint, columns in offered:
        values, spread, remaining = _fitted(np.concatenate([columns, nuisance]), gap)
        if remaining - noise < AGREES * (before - noise):
            value = float(values[0]) + (name != 'payload')
            result.append(EffortCause(name, joint, value, float(spread[0]), remaining / before))
    return tuple(sorted(result, key=lambda cause: cause.left))


def _only(i: int, columns: Array) -> Array:
    """Return columns, (K, n, N) or (1, n, N), of which one joint has something."""
    out = np.zeros_like(columns)
    out[:, i] = columns[:, i]
    return out


def _fitted(columns: Array, gap: Array) -> tuple[Array, Array, float]:
    """Return coefficients, their standard errors, and the squared difference that is left."""
    matrix = columns.reshape(len(columns), -1).T
    values, *_ = np.linalg.lstsq(matrix, gap.ravel(), rcond=None)
    remaining = float(((gap.ravel() - matrix @ values) ** 2).sum())
    variance = remaining / max(gap.size - len(columns), 1)
    spread = np.sqrt(variance * np.diag(np.linalg.pinv(matrix.T @ matrix)).clip(0.0))
    return values, spread, remaining
