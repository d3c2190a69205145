# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What may be wrong with a cell: every cause with a typical size, and how its size is changed.

Some causes no measurement, or not this one, can tell from another: each construction gives the causes
at work and every answer that is as right as the truth.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm.chain import frames
from weld_twin_core.arm.robot import Robot
from weld_twin_core.diagnosis.predicting import plausible_arm
from weld_twin_core.effects import REGISTRY
from weld_twin_core.effects.effect import Effect
from weld_twin_core.effects.plausible import plausible as plausible_of

from ..plant.flaws import known

Cause = dict[str, Any]
"""An entry of an effects file."""

POSE = ('xyz', 'rotvec')
"""Parameters of a frame."""
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
TWINS = {
    ('bearing_tilt', 'tilt'): 'lean',
    ('hose_pull', 'tension'): 'force',
    ('tool_sag', 'bend'): 'sag',
}
"""What the twin calls the size of a cause, where it is another word."""
LONG = 0.1
"""Length [m] from which the growth of a link shows."""
RIPPLE_ORDERS = (1, 2, 3, 8, 20, 50, 80, 100)
"""Orders of ripple [1/turn]: eccentric wheels, teeth, and the waves of a strain wave gear."""


def draw(family: str, robot: Robot, span: float, rng: np.random.Generator) -> Cause:
    """Return a cause of its typical size on a joint drawn at random, for a recording of a span [s]."""
    typical = CAUSES[family]
    drawn = typical.draw(Here(robot, span, rng))
    if not typical.signed:
        return {'effect': family, **drawn}
    size = typical.sizes[0]
    return {'effect': family, **drawn, size: drawn[size] * float(rng.choice([-1.0, 1.0]))}


def plausible(robot: Robot, cause: Mapping[str, Any], factor: float) -> bool:
    """Tell whether a cause of its typical size may be so many times as large."""
    family = cause['effect']
    if not LEAST.get(family, SPREAD[0]) < factor < MOST.get(family, SPREAD[1]):
        return False
    return all(
        factor * float(np.abs(cause[key]).max()) < INSIDE * machines(robot, cause, key)
        for key in SIZES[family]
        if key in cause
    )


def machines(robot: Robot, cause: Mapping[str, Any], key: str) -> float:
    """Return the largest value that a machine has of the parameter that is a cause's size."""
    parameter = TWINS.get((cause['effect'], key), key)
    return plausible_of(robot, cause['effect'], parameter, cause.get('joint')).high


def scaled(cause: Mapping[str, Any], factor: float) -> Cause:
    out = dict(cause)
    for key in SIZES[cause['effect']]:
        if key in out:
            out[key] = (factor * np.asarray(out[key], dtype=float)).tolist()
    return out


def site(cause: Mapping[str, Any]) -> tuple[str, str | None]:
    return cause['effect'], cause.get('joint')


class Here(NamedTuple):
    """What a cause is drawn for, and by what."""

    robot: Robot
    span: float
    """Duration of the recording [s]."""
    rng: np.random.Generator

    def joint(self) -> str:
        return str(self.rng.choice(self.robot.joint_names))

    def between(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def vector(self, size: float) -> list[float]:
        way = self.rng.standard_normal(3)
        return [float(size * part) for part in way / np.linalg.norm(way)]


Drawn = Callable[[Here], Any]


class Typical(NamedTuple):
    draw: Drawn
    """Returns the cause without its name."""
    sizes: tuple[str, ...]
    """The parameters that grow with it."""
    signed: bool = False
    """Whether it may be negative; what has a direction is drawn with it."""
    moving: bool = False
    """Whether stations at rest cannot show it."""
    outside: bool = False
    """Whether the library of effects has none of its kind."""

    def beside(self, **more: Drawn) -> Typical:
        """Return the same with more that is drawn after it."""
        return self._replace(
            draw=lambda here: self.draw(here) | {key: tell(here) for key, tell in more.items()}
        )


def _one(key: str, size: float, **more: bool) -> Typical:
    return Typical(lambda here: {'joint': here.joint(), key: size}, (key,), **more)


def _whole(key: str, size: float, **more: bool) -> Typical:
    return Typical(lambda here: {key: size}, (key,), **more)


def _turned(key: str, size: float, **more: bool) -> Typical:
    """Return a cause with one vector that points anywhere."""
    return Typical(lambda here: {key: here.vector(size)}, (key,), **more)


def _frame(xyz: float, turn: float) -> Typical:
    return Typical(lambda here: {'xyz': here.vector(xyz), 'rotvec': here.vector(turn)}, POSE)


def _coupling(here: Here) -> Cause:
    """Return a wrist joint that follows its neighbour, as in a gear train."""
    at, names = int(here.rng.integers(1, here.robot.n)), here.robot.joint_names
    return {'joint': names[at], 'source': names[at - 1], 'ratio': 5e-4}


def _compliance(here: Here) -> Cause:
    at = int(here.rng.integers(1, min(4, here.robot.n)))
    return {'joint': here.robot.joint_names[at], 'compliance': 8e-6}


def _warm_up(here: Here) -> Cause:
    long = np.flatnonzero(np.hypot(here.robot.a, here.robot.d) > LONG)
    joint = here.robot.joint_names[int(here.rng.choice(long))]
    return {'joint': joint, 'strain': 3e-4, 'warming_time': _slow(here)}


def _slow(here: Here) -> float:
    """Return a time constant that shows within the motion [s]."""
    return here.span * here.between(0.2, 0.8)


def _knock(here: Here) -> Cause:
    time = here.span * here.between(0.3, 0.7)
    return {'time': time, 'xyz': here.vector(3e-4), 'rotvec': here.vector(3e-4)}


def _friction(here: Here) -> Cause:
    uneven = here.between(-0.3, 0.3)
    return {'joint': here.joint(), 'windup': 3e-4, 'asymmetry': uneven}


def _hysteresis(here: Here) -> Cause:
    travel = float(np.exp(here.between(*np.log((0.01, 0.1)))))
    return {'joint': here.joint(), 'amplitude': 3e-4, 'travel': travel}


def _hose(here: Here) -> Cause:
    """Return a hose from above the arm, out of its reach."""
    reach = float(np.hypot(here.robot.a, here.robot.d).sum())
    hook = [here.between(-0.4, 0.4), here.between(-0.4, 0.4), here.between(1.0, 1.5)]
    return {'hook': [reach * x for x in hook], 'tension': 15.0, 'length': reach}


def _usual(kind: type[Effect]) -> Typical:
    """Return an effect of the sizes that its parameters say are typical."""
    first, sizes = kind.parameters[0], {}
    for p in kind.parameters:
        sizes[p.name] = p.typical if p.size < 2 else [p.typical] * p.size
    on_joint = kind.of in ('joint', 'link')
    return Typical(
        lambda here: {**({'joint': here.joint()} if on_joint else {}), **sizes},
        (first.name,),
        signed=first.lower < 0.0,
        moving='velocity' in kind.needs,
    )


CAUSES: dict[str, Typical] = {
    'joint_offset': _one('offset', 5e-4, signed=True),
    'link_length': _one('da', 3e-4, signed=True),
    'link_offset': _one('dd', 3e-4, signed=True),
    'link_twist': _one('dalpha', 5e-4, signed=True),
    'axis_parallelism': _one('dbeta', 5e-4, signed=True),
    'base_pose': _frame(3e-4, 5e-4),
    'tool_pose': _frame(3e-4, 1e-3),
    'gear_ratio': _one('scale', 5e-4, signed=True),
    'transmission_ripple': _one('amplitude', 2e-4).beside(
        order=lambda here: int(here.rng.choice(RIPPLE_ORDERS)),
        phase=lambda here: here.between(-np.pi, np.pi),
    ),
    'joint_coupling': Typical(_coupling, ('ratio',), signed=True),
    'backlash': _one('width', 6e-4),
    'joint_compliance': Typical(_compliance, ('compliance',)),
    'cartesian_compliance': Typical(
        lambda here: {'compliance': np.abs(here.vector(5e-6)).tolist()}, ('compliance',)
    ),
    'payload': _whole('mass', 1.0).beside(com=lambda here: here.vector(here.between(0.0, 0.1))),
    'servo_lag': _one('time_constant', 0.008, moving=True),
    'time_delay': _whole('delay', 0.006, signed=True, moving=True),
    'thermal_growth': _whole('coefficient', 3e-5),
    'drift': _turned('xyz_rate', 1e-5),
    'vibration': _one('gain', 0.5, moving=True).beside(
        frequency=lambda here: here.between(4.0, 15.0),
        damping=lambda here: here.between(0.02, 0.08),
    ),
    'quantization': _one('step', 6e-4),
    'measurement_scale': _whole('scale', 1e-4, signed=True),
    'station_step': Typical(_knock, POSE, outside=True),
    'tool_slip': Typical(_knock, POSE, outside=True),
    'quadratic_scale': _whole('coefficient', 3e-4, signed=True, outside=True).beside(
        origin=lambda here: here.vector(here.between(0.0, 1.0))
    ),
    'column_bend': _turned('rotvec', 4e-4, outside=True).beside(
        time_constant=lambda here: here.span * here.between(0.2, 0.6)
    ),
    'stick_slip': _one('amplitude', 6e-4, moving=True, outside=True),
    'friction_wander': _one('amplitude', 4e-4, moving=True, outside=True).beside(
        time_constant=lambda here: 0.15 * here.span
    ),
    'dress_pack': _one('amplitude', 5e-4, signed=True, outside=True),
    'friction': Typical(_friction, ('windup',), moving=True),
    'hysteresis': Typical(_hysteresis, ('amplitude',), moving=True),
    'bearing_tilt': _one('tilt', 3e-4, signed=True).beside(
        phase=lambda here: here.between(-3.1, 3.1)
    ),
    'loaded_play': _one('width', 6e-4),
    'wear': _whole('rate', 1e-5, signed=True).beside(
        slower=lambda here: here.span * here.between(1.5, 4.0)
    ),
    # Brackets are softer one way than the other.
    'pedestal_tilt': Typical(
        lambda here: {'compliance': (2e-6 * here.rng.uniform(0.3, 1.7, 2)).tolist()},
        ('compliance',),
    ),
    'hose_pull': Typical(_hose, ('tension',)),
    # Most torches stand aside of their bracket.
    'tool_sag': _whole('bend', 2.5e-4).beside(
        lever=lambda here: [*here.rng.uniform(-0.1, 0.1, 2), here.between(0.15, 0.35)]
    ),
    'refraction': _turned('warming', 2.0),
    'gear_ratio_by_direction': _one('difference', 1e-3, signed=True),
    'clock_rate': _whole('rate', 2e-5, signed=True, moving=True),
    'link_warm_up': Typical(_warm_up, ('strain',), moving=True),
    'joint_warm_up': _one('offset', 4e-4, signed=True, moving=True).beside(warming_time=_slow),
}
NEW = sorted((known() & set(REGISTRY)) - set(CAUSES) - {'measurement_noise'})
"""Effects that plant and library have, and that nothing is said of here: as they say themselves."""
CAUSES |= {name: _usual(REGISTRY[name]) for name in NEW}
SIZES = {name: typical.sizes for name, typical in CAUSES.items()}
"""The parameters of every cause that grow with it."""
FAMILIES = tuple(name for name, typical in CAUSES.items() if not typical.outside)
OUTSIDE = tuple(name for name, typical in CAUSES.items() if typical.outside)
AT_REST = (
    'joint_offset',
    'link_length',
    'link_offset',
    'link_twist',
    'gear_ratio',
    'transmission_ripple',
    'joint_compliance',
    'joint_coupling',
)
"""Causes that stations at rest show of any arm, and that no frame is one with."""
MOVING = frozenset(name for name, typical in CAUSES.items() if typical.moving)
"""Causes that stations at rest cannot show."""


Site = tuple[str, str | None]
PARALLEL = 1e-6
"""Sine of the angle between two axes up to which they are parallel; tables of rows are exact."""


class Construction(NamedTuple):
    """Causes, and other lists of sites that predict the same."""

    causes: list[Cause]
    alike: list[list[Site]]


def construct(name: str, robot: Robot, span: float, rng: np.random.Generator) -> Construction:
    return CONSTRUCTIONS[name](robot, span, rng)


def _at_an_end(
    family: str, at: int, frame: str, robot: Robot, span: float, rng: np.random.Generator
) -> Construction:
    """Turn or raise the first or last joint; a frame turned about or moved along it is the same."""
    cause = {**draw(family, robot, span, rng), 'joint': robot.joint_names[at]}
    return Construction([cause], [[(frame, None)]])


def _base_turn(robot: Robot, span: float, rng: np.random.Generator) -> Construction:
    """Turn the base about the first axis."""
    base = robot.T_world_base
    turn = 5e-4 * float(rng.choice([-1.0, 1.0])) * base[:3, 2]
    shift = base[:3, 3] - (base[:3, 3] + np.cross(turn, base[:3, 3]))
    cause = {'effect': 'base_pose', 'xyz': shift.tolist(), 'rotvec': turn.tolist()}
    return Construction([cause], [[('joint_offset', robot.joint_names[0])]])


def _parallel(robot: Robot, span: float, rng: np.random.Generator) -> Construction:
    """Lengthen a link along one of parallel axes; the neighbours shift the tool alike."""
    axes = np.array([row.z for row in frames(robot, np.zeros(robot.n)).rows])
    for at in rng.permutation(robot.n):
        mates = [k for k in range(robot.n) if k != at and _linked(axes, at, k)]
        if mates:
            cause = {**draw('link_offset', robot, span, rng), 'joint': robot.joint_names[at]}
            alike: list[list[Site]] = [[('link_offset', robot.joint_names[k])] for k in mates]
            return Construction([cause], alike)
    return construct('first axis', robot, span, rng)


def _lag_on_every_joint(robot: Robot, span: float, rng: np.random.Generator) -> Construction:
    """Let every joint lag alike; a clock that is late is nearly the same."""
    causes: list[Cause] = [
        {'effect': 'servo_lag', 'joint': joint, 'time_constant': 0.008}
        for joint in robot.joint_names
    ]
    return Construction(causes, [[('time_delay', None)]])


CONSTRUCTIONS: dict[str, Callable[..., Construction]] = {
    'first axis': partial(_at_an_end, 'joint_offset', 0, 'base_pose'),
    'base turn': _base_turn,
    'parallel axes': _parallel,
    'equal lag': _lag_on_every_joint,
    'last axis': partial(_at_an_end, 'joint_offset', -1, 'tool_pose'),
    'pedestal': partial(_at_an_end, 'link_offset', 0, 'base_pose'),
}


def _linked(axes: np.ndarray, a: int, b: int) -> bool:
    """Tell whether the axes of joints a to b are parallel one after the other."""
    run = axes[min(a, b) : max(a, b) + 1]
    return bool(np.abs(np.cross(run, run[0])).max() < PARALLEL)


FREEDOM = 3.0
"""Of Student's t, after which sizes are drawn: some errors of an arm are several times as large as
the others."""
EXACT = frozenset({'gear_ratio'})
"""Not everywhere: tooth numbers are exact."""
RIPPLE = 2e-4
"""Usual amplitude of one order of a gear's ripple [rad], as `cause_sizes` has it."""
LOW_ORDERS = (1, 2)
"""Of the ripple that every gear has, beside one that is drawn."""
ROUGH = 3e-5
"""Usual amplitude of each of many orders [rad]: together they move the tool of two measured arms by
a fifth of a millimetre."""
ROUGH_PARTS = (0.3, 3.0)
"""Of that, from arm to arm; even logarithms."""
ROUGH_ORDERS = range(3, 31)
"""Orders that the gears of these two arms have alike; above, they fall."""


def small_errors(robot: Robot, rng: np.random.Generator, part: float = 1.0) -> list[Cause]:
    """Return every small error that arms of this kind have, each drawn from a part of its spread."""
    out = []
    for effect in plausible_arm.directions(robot, ()):
        if effect.of not in ('joint', 'link') or effect.traits.waves is not None:
            continue
        size = plausible_arm.sizes(robot, effect) * rng.standard_normal(effect.vector().size)
        if effect.name == 'joint_compliance':
            if robot.mass is None:
                continue
            size = np.abs(size)
        out.append(effect.with_vector(part * size).to_mapping())
    return out


def uneven_errors(robot: Robot, rng: np.random.Generator, part: float) -> list[Cause]:
    """
    Return small errors everywhere, of which some are several times as large as the others.

    Gears run unevenly, too, and their ratios are exact. part: of the usual spread.
    """
    drawn = [own for own in small_errors(robot, rng, part) if own['effect'] not in EXACT]
    out = [scaled(own, float(np.sqrt(FREEDOM / rng.chisquare(FREEDOM)))) for own in drawn]
    for joint, slides in zip(robot.joint_names, robot.prismatic, strict=True):
        for order in () if slides else (*LOW_ORDERS, int(rng.choice(RIPPLE_ORDERS))):
            amplitude = RIPPLE * part * abs(float(rng.standard_t(FREEDOM)))
            out.append(_wave(joint, order, amplitude, rng))
    return out


def rough_gears(robot: Robot, rng: np.random.Generator) -> list[Cause]:
    """Return gears that run unevenly at every order: too many for some dozens of stations to tell."""
    part = ROUGH * float(np.exp(rng.uniform(*np.log(ROUGH_PARTS))))
    out = []
    for joint, slides in zip(robot.joint_names, robot.prismatic, strict=True):
        for order in () if slides else ROUGH_ORDERS:
            amplitude = part * abs(float(rng.standard_normal()))
            out.append(_wave(joint, order, amplitude, rng))
    return out


def _wave(joint: str, order: int, amplitude: float, rng: np.random.Generator) -> Cause:
    phase = float(rng.uniform(-np.pi, np.pi))
    waves = {'order': order, 'amplitude': amplitude, 'phase': phase}
    return {'effect': 'transmission_ripple', 'joint': joint, **waves}
