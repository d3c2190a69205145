# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What may be wrong with a cell: every cause with a typical size, and how its size is changed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.effects import REGISTRY
from weld_twin_core.effects.plausible import plausible as plausible_of

from ..plant.textbook_effects import LIBRARY

Cause = dict[str, Any]
"""An entry of an effects file."""

SIZES: dict[str, tuple[str, ...]] = {
    'joint_offset': ('offset',),
    'link_length': ('da',),
    'link_offset': ('dd',),
    'link_twist': ('dalpha',),
    'axis_parallelism': ('dbeta',),
    'base_pose': ('xyz', 'rotvec'),
    'tool_pose': ('xyz', 'rotvec'),
    'gear_ratio': ('scale',),
    'transmission_ripple': ('amplitude',),
    'joint_coupling': ('ratio',),
    'backlash': ('width',),
    'joint_compliance': ('compliance',),
    'cartesian_compliance': ('compliance',),
    'payload': ('mass',),
    'servo_lag': ('time_constant',),
    'time_delay': ('delay',),
    'thermal_growth': ('coefficient',),
    'drift': ('xyz_rate',),
    'vibration': ('gain',),
    'quantization': ('step',),
    'measurement_scale': ('scale',),
    'station_step': ('xyz', 'rotvec'),
    'tool_slip': ('xyz', 'rotvec'),
    'quadratic_scale': ('coefficient',),
    'column_bend': ('rotvec',),
    'stick_slip': ('amplitude',),
    'friction_wander': ('amplitude',),
    'dress_pack': ('amplitude',),
    'friction': ('windup',),
    'hysteresis': ('amplitude',),
    'bearing_tilt': ('tilt',),
    'loaded_play': ('width',),
    'wear': ('rate',),
    'pedestal_tilt': ('compliance',),
    'hose_pull': ('tension',),
    'refraction': ('warming',),
    'gear_ratio_by_direction': ('difference',),
    'clock_rate': ('rate',),
    'link_warm_up': ('strain',),
}
"""The parameters of every cause that grow with it."""
NEW = sorted((LIBRARY & set(REGISTRY)) - set(SIZES) - {'measurement_noise'})
"""Effects that plant and library have, and that nothing is said of here: as they say themselves."""
SIZES |= {name: (REGISTRY[name].parameters[0].name,) for name in NEW}
OUTSIDE = (
    'station_step',
    'tool_slip',
    'quadratic_scale',
    'column_bend',
    'stick_slip',
    'friction_wander',
    'dress_pack',
)
FAMILIES = tuple(name for name in SIZES if name not in OUTSIDE)
MOVING = frozenset(
    {
        'servo_lag',
        'time_delay',
        'clock_rate',
        'link_warm_up',
        'vibration',
        'friction_wander',
        'stick_slip',
        'friction',
        'hysteresis',
    }
)
"""Causes that stations at rest cannot show."""
SPREAD = (0.02, 20.0)
"""How many times its typical size a cause may be and still be plausible."""
MOST = {
    'vibration': 6.0,
    'servo_lag': 10.0,
    'time_delay': 10.0,
    'quantization': 5.0,
    'payload': 10.0,
    'thermal_growth': 2.4,
    'friction': 10.0,
    'hysteresis': 8.0,
}
"""The same for causes that become absurd sooner."""
LEAST = {'servo_lag': 0.15, 'joint_compliance': 0.1}
"""The same for causes that the simulator cannot have any smaller: a servo or spring too stiff."""
INSIDE = 0.8
"""Share of what a machine can have up to which causes are drawn: the estimate may be higher."""
TWINS = {('bearing_tilt', 'tilt'): 'lean', ('hose_pull', 'tension'): 'force'}
"""What the twin calls the size of a cause, where it is another word."""
LONG = 0.1
"""Length [m] from which the growth of a link shows."""
RIPPLE_ORDERS = (1, 2, 3, 8, 20, 50, 80, 100)
"""Orders of ripple [1/turn]: eccentric wheels, teeth, and the waves of a strain wave gear."""


def draw(family: str, robot: Robot, span: float, rng: np.random.Generator) -> Cause:
    """
    Return a cause of its typical size on a joint drawn at random.

    Parameters
    ----------
    family : str
    robot : Robot
    span : float [s]
        Duration of the recording, for what happens at a time.
    rng : Generator

    """
    drawn = _DRAWN[family](robot, span, rng)
    if set(SIZES[family]) & {'xyz', 'rotvec', 'xyz_rate'} or family in _POSITIVE:
        return {'effect': family, **drawn}
    size = SIZES[family][0]
    return {'effect': family, **drawn, size: drawn[size] * float(rng.choice([-1.0, 1.0]))}


def plausible(robot: Robot, cause: Mapping[str, Any], factor: float) -> bool:
    """
    Tell whether a cause may be so many times its typical size.

    Parameters
    ----------
    robot : Robot
    cause : mapping
        Of its typical size.
    factor : float

    """
    family = cause['effect']
    if not LEAST.get(family, SPREAD[0]) < factor < MOST.get(family, SPREAD[1]):
        return False
    return all(
        factor * float(np.abs(cause[key]).max()) < INSIDE * machines(robot, cause, key)
        for key in SIZES[family]
        if key in cause
    )


def machines(robot: Robot, cause: Mapping[str, Any], key: str) -> float:
    """
    Return the largest value of a parameter that a machine has.

    Parameters
    ----------
    robot : Robot
    cause : mapping
    key : str
        Of the parameter that is its size.

    """
    parameter = TWINS.get((cause['effect'], key), key)
    return plausible_of(robot, cause['effect'], parameter, cause.get('joint')).high


def scaled(cause: Mapping[str, Any], factor: float) -> Cause:
    """Return a cause that is so many times as large."""
    out = dict(cause)
    for key in SIZES[cause['effect']]:
        if key in out:
            out[key] = (factor * np.asarray(out[key], dtype=float)).tolist()
    return out


def site(cause: Mapping[str, Any]) -> tuple[str, str | None]:
    """Return family and joint."""
    return cause['effect'], cause.get('joint')


_POSITIVE = frozenset(
    {
        'transmission_ripple',
        'backlash',
        'joint_compliance',
        'cartesian_compliance',
        'servo_lag',
        'thermal_growth',
        'link_warm_up',
        'vibration',
        'quantization',
        'payload',
        'stick_slip',
        'friction_wander',
        'loaded_play',
        'friction',
        'hysteresis',
        'pedestal_tilt',
        'hose_pull',
        'refraction',
        *(name for name in NEW if REGISTRY[name].parameters[0].lower >= 0.0),
    }
)


def _joint(robot: Robot, rng: np.random.Generator) -> str:
    return str(rng.choice(robot.joint_names))


def _vector(size: float, rng: np.random.Generator) -> list[float]:
    way = rng.standard_normal(3)
    return [float(size * part) for part in way / np.linalg.norm(way)]


def _one(key: str, size: float) -> Callable[..., Cause]:
    """Return how to draw a cause with a joint and one number."""
    return lambda robot, span, rng: {'joint': _joint(robot, rng), key: size}


def _whole(key: str, size: float) -> Callable[..., Cause]:
    return lambda robot, span, rng: {key: size}


def _frame(xyz: float, turn: float) -> Callable[..., Cause]:
    return lambda robot, span, rng: {'xyz': _vector(xyz, rng), 'rotvec': _vector(turn, rng)}


def _ripple(robot: Robot, span: float, rng: np.random.Generator) -> Cause:
    return {
        'joint': _joint(robot, rng),
        'amplitude': 2e-4,
        'order': int(rng.choice(RIPPLE_ORDERS)),
        'phase': float(rng.uniform(-np.pi, np.pi)),
    }


def _coupling(robot: Robot, span: float, rng: np.random.Generator) -> Cause:
    """Return a wrist joint that follows its neighbour, as in a gear train."""
    at = int(rng.integers(1, robot.n))
    return {'joint': robot.joint_names[at], 'source': robot.joint_names[at - 1], 'ratio': 5e-4}


def _compliance(robot: Robot, span: float, rng: np.random.Generator) -> Cause:
    at = int(rng.integers(1, min(4, robot.n)))
    return {'joint': robot.joint_names[at], 'compliance': 8e-6}


def _give(robot: Robot, span: float, rng: np.random.Generator) -> Cause:
    return {'compliance': np.abs(_vector(5e-6, rng)).tolist()}


def _payload(robot: Robot, span: float, rng: np.random.Generator) -> Cause:
    return {'mass': 1.0, 'com': _vector(float(rng.uniform(0.0, 0.1)), rng)}


def _vibration(robot: Robot, span: float, rng: np.random.Generator) -> Cause:
    return {
        'joint': _joint(robot, rng),
        'frequency': float(rng.uniform(4.0, 15.0)),
        'damping': float(rng.uniform(0.02, 0.08)),
        'gain': 0.5,
    }


def _warm_up(robot: Robot, span: float, rng: np.random.Generator) -> Cause:
    long = np.flatnonzero(np.hypot(robot.a, robot.d) > LONG)
    joint = robot.joint_names[int(rng.choice(long))]
    return {'joint': joint, 'strain': 3e-4, 'warming_time': float(span * rng.uniform(0.2, 0.8))}


def _tilt(robot: Robot, span: float, rng: np.random.Generator) -> Cause:
    return {'joint': _joint(robot, rng), 'tilt': 3e-4, 'phase': float(rng.uniform(-3.1, 3.1))}


def _knock(robot: Robot, span: float, rng: np.random.Generator) -> Cause:
    time = float(span * rng.uniform(0.3, 0.7))
    return {'time': time, 'xyz': _vector(3e-4, rng), 'rotvec': _vector(3e-4, rng)}


def _bend(robot: Robot, span: float, rng: np.random.Generator) -> Cause:
    return {'rotvec': _vector(4e-4, rng), 'time_constant': float(span * rng.uniform(0.2, 0.6))}


def _wander(robot: Robot, span: float, rng: np.random.Generator) -> Cause:
    return {'joint': _joint(robot, rng), 'amplitude': 4e-4, 'time_constant': 0.15 * span}


def _friction(robot: Robot, span: float, rng: np.random.Generator) -> Cause:
    uneven = float(rng.uniform(-0.3, 0.3))
    return {'joint': _joint(robot, rng), 'windup': 3e-4, 'asymmetry': uneven}


def _hysteresis(robot: Robot, span: float, rng: np.random.Generator) -> Cause:
    travel = float(np.exp(rng.uniform(*np.log((0.01, 0.1)))))
    return {'joint': _joint(robot, rng), 'amplitude': 3e-4, 'travel': travel}


def _pedestal(robot: Robot, span: float, rng: np.random.Generator) -> Cause:
    """Return a pedestal that is softer one way than the other, as brackets are."""
    return {'compliance': (2e-6 * rng.uniform(0.3, 1.7, 2)).tolist()}


def _hose(robot: Robot, span: float, rng: np.random.Generator) -> Cause:
    """Return a hose from above the arm, out of its reach."""
    reach = float(np.hypot(robot.a, robot.d).sum())
    hook = [rng.uniform(-0.4, 0.4), rng.uniform(-0.4, 0.4), rng.uniform(1.0, 1.5)]
    return {'hook': [reach * float(x) for x in hook], 'tension': 15.0, 'length': reach}


_DRAWN: dict[str, Callable[..., Cause]] = {
    'joint_offset': _one('offset', 5e-4),
    'link_length': _one('da', 3e-4),
    'link_offset': _one('dd', 3e-4),
    'link_twist': _one('dalpha', 5e-4),
    'axis_parallelism': _one('dbeta', 5e-4),
    'base_pose': _frame(3e-4, 5e-4),
    'tool_pose': _frame(3e-4, 1e-3),
    'gear_ratio': _one('scale', 5e-4),
    'transmission_ripple': _ripple,
    'joint_coupling': _coupling,
    'backlash': _one('width', 6e-4),
    'joint_compliance': _compliance,
    'cartesian_compliance': _give,
    'payload': _payload,
    'servo_lag': _one('time_constant', 0.008),
    'time_delay': _whole('delay', 0.006),
    'thermal_growth': _whole('coefficient', 3e-5),
    'drift': lambda robot, span, rng: {'xyz_rate': _vector(1e-5, rng)},
    'vibration': _vibration,
    'quantization': _one('step', 6e-4),
    'measurement_scale': _whole('scale', 1e-4),
    'bearing_tilt': _tilt,
    'station_step': _knock,
    'tool_slip': _knock,
    'quadratic_scale': lambda robot, span, rng: {
        'coefficient': 3e-4,
        'origin': _vector(float(rng.uniform(0.0, 1.0)), rng),
    },
    'column_bend': _bend,
    'stick_slip': _one('amplitude', 6e-4),
    'friction_wander': _wander,
    'loaded_play': _one('width', 6e-4),
    'dress_pack': _one('amplitude', 5e-4),
    'friction': _friction,
    'hysteresis': _hysteresis,
    'pedestal_tilt': _pedestal,
    'hose_pull': _hose,
    'refraction': lambda robot, span, rng: {'warming': _vector(2.0, rng)},
    'wear': lambda robot, span, rng: {'rate': 1e-5, 'slower': float(span * rng.uniform(1.5, 4.0))},
    'gear_ratio_by_direction': _one('difference', 1e-3),
    'clock_rate': _whole('rate', 2e-5),
    'link_warm_up': _warm_up,
}


def _usual(family: str) -> Callable[..., Cause]:
    """Return how to draw an effect of the sizes that its parameters say are typical."""
    kind = REGISTRY[family]
    sizes = {p.name: p.typical if p.size < 2 else [p.typical] * p.size for p in kind.parameters}
    return lambda robot, span, rng: {
        **({'joint': _joint(robot, rng)} if kind.of in ('joint', 'link') else {}),
        **sizes,
    }


_DRAWN |= {name: _usual(name) for name in NEW}
