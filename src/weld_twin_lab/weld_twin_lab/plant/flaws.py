# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What can be wrong with a cell: every flaw is a function, and says which part of the cell it is in.

A flaw is known to the plant by standing in a file of this folder:

    @flaw('tool')
    def wear(entry, here): ...

| part | the function takes | and returns |
|---|---|---|
| joint | entry, `Here` | how far the link is from its motor, (M,) [rad or m] |
| axis | entry, `Here` | how far the joint's axis leans, (M,) [rad] |
| base, tool | entry, `Here` | shift and turn of that frame, in its own axes, (M, 6) [m, rad] |
| hand | entry, `Here`, pose | the tool as it hangs at the arm |
| stand, sight | entry, `Here`, pose | the pose from where the instrument stands; then as it is seen |

What acts through masses and springs is worked out together, in `drives`, `compliance` and `tree`;
these flaws, and those with a closed form, are `LIBRARY`: geometry as built, gearing, frames, the
instrument. Their names and parameters are those of docs/effects.md.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import odeint

from . import exponentials
from .exponentials import Arm, Entry, Motion, Rows

REFERENCE_TEMPERATURE = 20.0
"""Temperature [degC] at which the arm has the lengths of its file, as for gauges (ISO 1)."""
ROW_EFFECTS = {
    'link_length': ('a', 'da'),
    'link_offset': ('d', 'dd'),
    'link_twist': ('alpha', 'dalpha'),
    'axis_parallelism': ('beta', 'dbeta'),
}
LIBRARY = frozenset(ROW_EFFECTS) | {
    'joint_offset',
    'base_pose',
    'tool_pose',
    'gear_ratio',
    'transmission_ripple',
    'joint_coupling',
    'backlash',
    'joint_compliance',
    'cartesian_compliance',
    'payload',
    'servo_lag',
    'time_delay',
    'clock_rate',
    'thermal_growth',
    'link_warm_up',
    'drift',
    'vibration',
    'quantization',
    'measurement_scale',
    'measurement_noise',
    'pedestal_tilt',
    'hose_pull',
}


@dataclass(frozen=True)
class Causes:
    """The effects at work, and the joints they may name."""

    items: tuple[Entry, ...]
    """As in an effects file."""
    joints: tuple[str, ...]

    def of(self, effect: str) -> Iterator[Entry]:
        return (item for item in self.items if item['effect'] == effect)

    def joint(self, name: str) -> int:
        if name not in self.joints:
            raise ValueError(f'no joint {name!r}; joints: {", ".join(self.joints)}')
        return self.joints.index(name)

    def per_joint(self, effect: str, key: str) -> np.ndarray:
        """Return the sum of one parameter over the entries of an effect, shape (n,)."""
        total = np.zeros(len(self.joints))
        for item in self.of(effect):
            total[self.joint(item['joint'])] += float(item[key])
        return total

    def total(self, effect: str, key: str, width: int | None = None) -> np.ndarray:
        """Return the sum of one parameter of a robot effect, a number or a vector (width,)."""
        zero = np.zeros(() if width is None else width)
        values = (np.asarray(item.get(key, zero), dtype=float) for item in self.of(effect))
        return np.asarray(sum(values, start=zero))


def causes_from(effects: Sequence[Entry], arm: Arm, known: frozenset[str]) -> Causes:
    """Check the effects against the names known to the plant and the joints of the arm."""
    causes = Causes(tuple(effects), arm.names)
    for item in causes.items:
        if item.get('effect') not in known:
            raise ValueError(
                f'unknown effect {item.get("effect")!r}; known: {", ".join(sorted(known))}'
            )
        for key in ('joint', 'source'):
            if item.get(key) is not None:
                causes.joint(item[key])
    return causes


def warm_up(item: Entry, t: np.ndarray, temperature: np.ndarray | None) -> np.ndarray:
    """
    Return the warming against the reference, shape (len(t),) [K].

    item: a thermal_growth entry; `rise` [K] and `time_constant` [s] give a warm-up curve where no
    temperature is recorded.
    t: since the recording's first stamp, shape (M,) [s].
    temperature: shape (M,) [degC], or None.
    """
    if temperature is not None:
        return temperature - float(item.get('reference', REFERENCE_TEMPERATURE))
    if 'rise' not in item:
        raise ValueError('thermal_growth needs a temperature in the command, or a rise')
    return float(item['rise']) * (1.0 - np.exp(-t / float(item['time_constant'])))


def rows_as_built(causes: Causes, arm: Arm, t: np.ndarray, temperature: np.ndarray | None) -> Rows:
    """Return the DH rows as they really are, each (n,), or (len(t), n) while they warm up."""
    rows = arm.rows
    for effect, (column, key) in ROW_EFFECTS.items():
        error = causes.per_joint(effect, key)
        rows = rows._replace(**{column: getattr(rows, column) + error})
    for item in causes.of('thermal_growth'):
        chosen = item.get('links')
        warm = [chosen is None or name in chosen for name in arm.names]
        growth = float(item['coefficient']) * warm_up(item, t, temperature)
        factor = 1.0 + growth[:, None] * np.array(warm, dtype=float)
        rows = rows._replace(a=rows.a * factor, d=rows.d * factor)
    for item in causes.of('link_warm_up'):
        own = np.eye(len(arm.names))[causes.joint(item['joint'])]
        factor = 1.0 + float(item['strain']) * np.outer(
            heated(t, float(item['warming_time'])), own
        )
        rows = rows._replace(a=rows.a * factor, d=rows.d * factor)
    return rows


def heated(t: np.ndarray, warming_time: float) -> np.ndarray:
    """
    Return how warm a motor's heat has made a link, 1 in the end, shape (len(t),).

    Still air takes the more heat the warmer the link is, by the power 5/4: y' = 1 - y^(5/4).
    """
    times, place = np.unique(t / warming_time, return_inverse=True)
    warm = odeint(lambda y, _: 1.0 - max(y[0], 0.0) ** 1.25, 0.0, np.r_[-1e-9, times])
    return np.asarray(warm[1:, 0][place])


def gearing(causes: Causes, q: np.ndarray) -> np.ndarray:
    """Return the error of the joints' transmissions at motor positions, shape (..., n) [rad or m]."""
    error: np.ndarray = causes.per_joint('gear_ratio', 'scale') * q
    error += causes.per_joint('joint_offset', 'offset')
    for item in causes.of('transmission_ripple'):
        i = causes.joint(item['joint'])
        waves = np.broadcast_arrays(
            *(
                np.atleast_1d(np.asarray(item.get(key, 0.0), dtype=float))
                for key in ('amplitude', 'order', 'phase')
            )
        )
        for amplitude, order, phase in zip(*waves, strict=True):
            error[..., i] += amplitude * np.sin(order * q[..., i] + phase)
    for item in causes.of('joint_coupling'):
        i, source = causes.joint(item['joint']), causes.joint(item['source'])
        error[..., i] += float(item['ratio']) * q[..., source]
    return error


def rounding(causes: Causes, q: np.ndarray) -> np.ndarray:
    """Return the distance to the encoder's nearest count, shape (..., n) [rad or m]."""
    step = causes.per_joint('quantization', 'step')
    counts = np.divide(q, step, out=np.zeros_like(q), where=step > 0.0)
    return np.where(step > 0.0, step * np.round(counts) - q, 0.0)


def frames(causes: Causes, arm: Arm) -> tuple[Motion, Motion]:
    """Return the base in the world and the tool on the flange, as they really are."""

    def error(effect: str) -> Motion:
        return exponentials.from_rotvec(
            causes.total(effect, 'rotvec', 3), causes.total(effect, 'xyz', 3)
        )

    base, tool = error('base_pose'), error('tool_pose')
    return (
        Motion(base.rotation @ arm.base.rotation, arm.base.position + base.position),
        Motion(arm.tool.rotation @ tool.rotation, arm.tool.position + tool.position),
    )


def yielding(causes: Causes, pose: Motion, wrench: np.ndarray | None) -> Motion:
    """Return the tool displaced by its load, the compliance being in the tool frame."""
    compliance = causes.total('cartesian_compliance', 'compliance', 3)
    if wrench is None or not compliance.any():
        return pose
    give = np.einsum('...ij,...j->...i', pose.rotation, compliance * wrench[..., :3])
    return pose._replace(position=pose.position + give)


def measured(causes: Causes, pose: Motion, t: np.ndarray) -> Motion:
    """Return the pose as the instrument has it: creep of the frame, then its scale."""
    creep = np.multiply.outer(t, causes.total('drift', 'xyz_rate', 3))
    scale = 1.0 + causes.total('measurement_scale', 'scale')
    return pose._replace(position=scale * (pose.position + creep))


PARTS = ('joint', 'axis', 'base', 'tool', 'hand', 'stand', 'sight')
_FLAWS: dict[str, dict[str, Callable[..., Any]]] = {part: {} for part in PARTS}
"""By part and by name."""


class Here(NamedTuple):
    """What a flaw may look at: the cell at some instants."""

    causes: Causes
    arm: Arm
    t: np.ndarray
    """Since the recording's first stamp, shape (M,) [s]."""
    q: np.ndarray
    """Motor side, shape (M, n); a sequence in time."""
    richness: float
    rng: np.random.Generator
    wrench: np.ndarray | None = None
    """On the tool, in its frame, shape (M, 6) [N, N m]; what a pose is seen with."""
    torque: Callable[[], np.ndarray] = lambda: np.zeros((0, 0))
    """Gives the load torque, shape (M, n), to what displaces a joint; asked only where needed."""


F = Callable[..., Any]


def flaw(part: str) -> Callable[[F], F]:
    """Return what makes a function known as a flaw of a part, by its own name."""

    def keep(function: F) -> F:
        _FLAWS[part][function.__name__] = function
        return function

    return keep


@flaw('joint')
def joint_warm_up(entry: Entry, here: Here) -> np.ndarray:
    """Return how far the heat of its gear has turned a joint."""
    return float(entry['offset']) * heated(here.t, float(entry['warming_time']))


@cache
def known() -> frozenset[str]:
    """Return the names of all flaws that an effects file may have."""
    for file in iter_modules([str(Path(__file__).parent)]):
        try:
            import_module(f'.{file.name}', __package__)
        except ModuleNotFoundError as error:
            if error.name != 'mujoco':  # without it nothing is simulated, and all can be named
                raise
    return LIBRARY.union(*_FLAWS.values())


def _of(part: str, causes: Causes) -> list[tuple[F, list[Entry]]]:
    """Return the flaws of a part that are at work, in the order of their names."""
    each = [(_FLAWS[part][name], list(causes.of(name))) for name in sorted(_FLAWS[part])]
    return [(function, items) for function, items in each if items]


def on_joints(here: Here, part: str = 'joint') -> np.ndarray:
    """Return the displacement of all links, or the lean of all axes, shape (M, n) [rad or m]."""
    out = np.zeros_like(here.q)
    for item in here.causes.items:
        function = _FLAWS[part].get(item['effect'])
        if function is not None:
            out[:, here.causes.joint(item['joint'])] += function(item, here)
    return out


def any_on_joints(causes: Causes) -> bool:
    """Return whether a flaw of the joints is at work."""
    return bool(_of('joint', causes))


def frame(part: str, here: Here) -> Motion:
    """Return how far the base or the tool is from where the arm's file has it, (M,)."""
    total = exponentials.identity()
    for function, items in _of(part, here.causes):
        moved = sum(function(item, here) for item in items)
        total = exponentials.compose(total, exponentials.from_rotvec(moved[:, 3:], moved[:, :3]))
    return total


def seen(here: Here, pose: Motion, *parts: str) -> Motion:
    """Return a pose as the flaws of some parts leave it, one part after the other."""
    for part in parts:
        for function, items in _of(part, here.causes):
            for item in items:
                pose = function(item, here, pose)
    return pose
