# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Every place that could be at fault, and everything the fault could depend on, without a formula.

A group is a place and a dependence, spanned by curves (`JointCurve`, `FrameCurve`) or, where no curve
can be carried over to another motion, by plain columns. Groups compete as wholes.

Some places no single joint shows: a wrong unit of length looks like small constants of several joints,
a weight like several springs, links that warm up like several lengths. One group for each lets the
simplest explanation win. Beside them stands lost motion of every joint, free in its gaps, angle, speed
and load.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...arm.dynamics import payload_torque, wrench_rotation
from ...arrays import Array
from ...effects.associative_scan import play
from ...effects.compliance import PedestalTilt, base_leans, base_moments
from ...effects.curves import QUANTITIES, FrameCurve, JointCurve, basis
from ...effects.effect import Effect
from ...twin.features import Features
from ...twin.stages import Picker
from ..algebra.independent_rows import ENOUGH
from ..algebra.problem import Model, Problem, Scale
from ..negligible import FLAT, ROUNDING
from .folds import STRETCHES

KNOTS = {'angle': 7, 'direction': 2, 'speed': 5, 'load': 4, 'temperature': 3, 'time': 6}
"""Knots of a curve: enough for two waves of an angle, and few enough for a minute of motion."""
FINE, LEAST_FINE = 3 * KNOTS['angle'], 400
"""Knots of a second curve over the angle, for a gear's waves; measurements from which it is tried."""
NEAR = 1e-3
"""Span below which a distance [m], an angle [rad] or a speed [rad/s] did not vary."""
LEAST = {'angle': NEAR, 'direction': 1.0, 'speed': NEAR, 'load': 0.2, 'temperature': 0.5}
"""The same of every quantity, of a torque [N m] and a temperature [K]. Curves over less are straight
lines, and told from nothing."""
WANDERS = 2 * STRETCHES
"""Times over a recording at which a lost motion may have another size: a few seconds apart."""
LOOSE = 100.0
"""Carriers may be so many times their typical size: their group has been found by its columns."""
OFF_AXIS = ('d', 'a', 'alpha', 'beta')
FIELD = 3 * 9
"""Columns of a smooth field: every coordinate over the place, up to its squares."""
FALLEN = 3
"""Columns of a loose tool: to either side along each of its axes."""
GAPS = np.geomspace(5e-5, 4e-2, 6)
"""Widths [rad, or tens of centimetres] of gaps in series: from half of what the finest play is to
what takes a tenth of a radian to build up."""
TURNED = 1e-4
"""Travel [rad, or tens of centimetres] after which a joint counts as going the other way."""
BENT = 4
"""Knots over the distance from the instrument, and over the angle for each way: straight or bent."""
SHARES = np.geomspace(0.02, 0.4, 3)
"""Shares of the joint's largest speed about which what depends on the way may set in."""


@dataclass(frozen=True, eq=False)
class Group:
    """One place with one dependence."""

    at: str
    on: str  # place and dependence
    curves: tuple[Effect, ...]
    """What spans it, all values zero; empty where it is spanned by plain columns."""
    columns: Array  # whitened, together of unit mean square, shape (E, rows)
    scales: Array
    """What the columns were divided by, noise per unit of a curve's value, shape (E,)."""
    carriers: tuple[Effect, ...] = ()
    """Curves that do on any motion what plain columns do on this one."""

    @property
    def movable_curves(self) -> tuple[Effect, ...]:
        """Return the curves that take the group along to another motion; none for a few kinds."""
        return self.curves or self.carriers

    def prior_precision(self, ridge: float) -> Array:
        """Return the prior precision of the carried curves' values, in units of noise."""
        if self.curves:
            return ridge * self.scales**2
        sizes = [curve.fit.coordinate_scales() for curve in self.carriers]
        return np.concatenate([np.zeros(0), *(1.0 / (LOOSE * size) ** 2 for size in sizes)])

    def __str__(self) -> str:
        return f'{self.on} at {self.at}' if self.on not in ('constant', self.at) else self.at


def all_groups(
    problem: Problem, model: Model, scale: Scale, *, wandering: bool = False
) -> Iterator[Group]:
    """Yield the groups that the data can show; if ``wandering`` losses by direction change with time."""
    features = problem.features(model)
    for at, on, curves in _curved(features, model):
        parts = [problem.effect_columns(features, curve, atoms=False) for curve in curves]
        joined = [np.concatenate(blocks) for blocks in zip(*parts, strict=True)]
        yield from _spanned(problem, scale, at, on, joined, curves=tuple(curves))
    plain = [*_of_joints(problem, features, wandering=wandering), *_of_all(problem, features)]
    for at, on, blocks, carriers in plain:
        seen = [problem.seen(k, block) for k, block in enumerate(blocks)]
        yield from _spanned(problem, scale, at, on, seen, carriers=carriers)


def _spanned(
    problem: Problem,
    scale: Scale,
    at: str,
    on: str,
    parts: list[Array],
    *,
    curves: tuple[Effect, ...] = (),
    carriers: tuple[Effect, ...] = (),
) -> Iterator[Group]:
    """Yield the group of some columns, (E, c, M) per recording; none where these data do not show it."""
    columns = problem.whitened(parts, scale)
    size = np.sqrt((columns**2).mean(axis=1))
    if not curves:
        columns, size = columns[size > ROUNDING], size[size > ROUNDING]
    if size.max(initial=0.0) > ROUNDING:
        # Knots that little was recorded at keep their small columns, or a ridge would free them.
        size = np.maximum(size, 0.2 * size.max())
        yield Group(at, on, curves, columns / size[:, None], size, carriers)


def _curved(features: list[Features], model: Model) -> Iterator[tuple[str, str, list[Effect]]]:
    static = all(maker.run.view.static for maker in features)
    for index, joint in enumerate(model.robot.joint_names):
        channels = ('q', *OFF_AXIS)
        fixed = [JointCurve(joint, (0.0,), (0.0,), 'constant', channel) for channel in channels]
        yield joint, 'constant', list(fixed)
        for on in ('angle', 'direction', 'speed', 'load', 'temperature', 'time'):
            knots = _knots(features, index, on)
            if knots is None or (static and on in ('direction', 'speed')):
                continue
            zero = (0.0,) * len(knots)
            yield joint, on, [JointCurve(joint, zero, knots, on)]
            if on == 'angle' and sum(m.at.size for m in features) > LEAST_FINE:
                fine = tuple(np.linspace(knots[0], knots[-1], FINE))
                yield joint, on, [JointCurve(joint, (0.0,) * FINE, fine, on)]
            if on in ('angle', 'temperature'):
                few = tuple(np.linspace(knots[0], knots[-1], min(len(knots), 4)))
                zero = (0.0,) * len(few)
                off = [JointCurve(joint, zero, few, on, channel) for channel in OFF_AXIS]
                yield joint, on, list(off)
    for frame in ('base', 'tool'):
        yield frame, 'constant', [FrameCurve((0.0,) * 3, (0.0,) * 3, (0.0,), 'constant', frame)]
        for on in ('temperature', 'time'):
            knots = _knots(features, 0, on)
            if knots is not None:
                few = tuple(np.linspace(knots[0], knots[-1], min(len(knots), 4)))
                zero = (0.0,) * (3 * len(few))
                yield frame, on, [FrameCurve(zero, zero, few, on, frame)]


def _knots(features: list[Features], index: int, on: str) -> tuple[float, ...] | None:
    """Return knots over what was recorded, or None where it did not vary."""
    if on == 'direction':
        spread = [float(np.ptp(QUANTITIES[on](m.view, index))) for m in features]
        return (-1.0, 1.0) if max(spread) > LEAST[on] else None
    if on == 'temperature' and any(m.view.temperature is None for m in features):
        return None
    values = [QUANTITIES[on](m.view, index) for m in features]
    return _spaced(values, KNOTS[on], LEAST.get(on, 0.0))


Plain = tuple[str, str, list[Array], tuple[Effect, ...]]
"""Place, dependence, columns (E, 6, M) per recording, and the curves that carry them."""


def _of_joints(problem: Problem, features: list[Features], *, wandering: bool) -> Iterator[Plain]:
    """Yield what a joint does that no curve stands for."""
    if problem.at_rest:
        return
    for index, joint in enumerate(features[0].twin.robot.joint_names):
        columns = [maker.column(('q', index)) for maker in features]
        if max(m.at.size for m in features) >= ENOUGH:
            pushes = (_push(maker, index) for maker in features)
            each = zip(columns, pushes, strict=True)
            yield joint, 'acceleration', [column[None] * push for column, push in each], ()
        if max(float(np.ptp(m.run.view.q[:, index])) for m in features) > LEAST['angle']:
            shapes = [_lost(maker, features, index) for maker in features]
            each = zip(columns, shapes, strict=True)
            curve = JointCurve(joint, (0.0, 0.0), (-1.0, 1.0), 'direction')
            yield joint, 'direction', [c[None] * s[:, None, :] for c, s in each], (curve,)
        if wandering:
            each = zip(columns, (_wandering(maker, index) for maker in features), strict=True)
            yield joint, 'direction', [c[None] * s[:, None, :] for c, s in each], ()


def _of_all(problem: Problem, features: list[Features]) -> Iterator[Plain]:
    """Yield what no single joint shows."""
    if not problem.at_rest:
        yield 'clock', 'speed', [_velocity(maker) for maker in features], _late(features)
    if not problem.untracked:
        field = [smooth_field(maker) for maker in features]
        yield 'instrument', 'place', field, ()
        # Where noise hides the squares of the place, its linear part may still show.
        linear = [np.concatenate([f[k : k + 3] for k in range(0, len(f), 9)]) for f in field]
        sight = [_sighted(maker, None) for maker in features]
        yield 'instrument', 'place', sight, ()
        # A law about an origin of its own also shifts what is in the middle of the frame.
        for law in (field, linear, sight):
            about = [np.concatenate([_shifted(part), part]) for part in law]
            yield 'instrument', 'place', about, ()
        knots = _spaced([_distance(maker) for maker in features], BENT, NEAR)
        if knots is not None:
            yield 'instrument', 'place', [_sighted(maker, knots) for maker in features], ()
    if all(m.view.wrench is not None for m in features):
        yield 'tool', 'load', [_yielding(maker) for maker in features], ()
    elif not problem.untracked and features[0].view.robot.gravity.any():
        for hanging in zip(*map(_hanging, features), strict=True):
            yield 'tool', 'load', list(hanging), ()
    if any(PedestalTilt.applicable(maker.view, None) is None for maker in features):
        yield 'base', 'load', [_leaning(maker) for maker in features], ()
    if any(maker.view.effort is None for maker in features):  # else what hangs there was measured
        views = [(maker, maker.view) for maker in features]
        weighed = [(m, payload_torque(v.robot, v.frames, 1.0, np.zeros(3))) for m, v in views]
        # Every joint bent by a mass at the tool; and what that does through the springs that are known.
        bent = [np.array([m.column(('q', i)) * t for i, t in enumerate(ts)]) for m, ts in weighed]
        yield 'load', 'load', bent, ()
        sprung = [m.changes([{('tau', i): t for i, t in enumerate(ts)}]) for m, ts in weighed]
        yield 'load', 'load', sprung, ()
    if all(maker.view.temperature is not None for maker in features):
        warmth = [np.asarray(maker.view.temperature) for maker in features]
        knots = _spaced(warmth, KNOTS['temperature'], LEAST['temperature'])
        if knots is not None:
            each = [(_grown(maker)[None], w) for maker, w in zip(features, warmth, strict=True)]
            yield 'base', 'temperature', [g * basis(knots, w)[:, None] for g, w in each], ()
            middle = (knots[0] + knots[-1]) / 2.0
            yield 'base', 'temperature', [g * (w - middle) for g, w in each], ()


def _late(features: list[Features]) -> tuple[Effect, ...]:
    """Return what a late clock does to every joint: behind in proportion to its speed."""
    out = []
    for index, joint in enumerate(features[0].twin.robot.joint_names):
        fastest = max(float(np.abs(m.view.qd[:, index]).max()) for m in features)
        if fastest > LEAST['speed']:
            out.append(JointCurve(joint, (0.0, 0.0), (-fastest, fastest), 'speed'))
    return tuple(out)


def _velocity(maker: Features) -> Array:
    """Return the tool's twist, shape (1, 6, M): what a late clock shows."""
    joints = range(maker.twin.robot.n)
    total = sum(maker.column(('q', i)) * maker.view.qd[:, i] for i in joints)
    return np.asarray(total)[None]


def smooth_field(maker: Features) -> Array:
    """Return every coordinate of the position over the place, up to its squares, (FIELD, 6, M)."""
    p = maker.run.poses.position
    x = ((p - p.mean(axis=0)) / np.maximum(p.std(axis=0), FLAT)).T
    shapes = [*x, *(x[a] * x[b] for a in range(3) for b in range(a, 3))]
    out = np.zeros((3, len(shapes), 6, x.shape[1]))
    for axis in range(3):
        out[axis, :, axis] = shapes
    return out.reshape(-1, 6, x.shape[1])


def _yielding(maker: Features) -> Array:
    """Return the tool pushed along its axes by the force on it, shape (3, 6, M)."""
    rotation, wrench = maker.run.poses.rotation, maker.view.wrench
    assert wrench is not None
    out = np.zeros((3, 6, wrench.shape[0]))
    force = wrench[:, :3]
    if maker.view.wrench_frame != 'tool':
        axes = wrench_rotation(maker.view.robot, maker.view.frames, 'base')
        force = np.einsum('mji,mj->mi', rotation, (axes @ force[..., None])[..., 0])
    for axis in range(3):
        out[axis, :3] = (rotation[:, :, axis] * force[:, axis, None]).T
    return out


def _hanging(maker: Features) -> tuple[Array, Array]:
    """
    Return the tool pushed along its axes by what hangs on it, shapes (9, 6, M) and (3, 6, M).

    A bracket sags, along any axis of the tool by how far down each of its axes points. A loose tool
    falls along each axis to the side that is lower, by as much however low it is.
    """
    poses = maker.run.poses
    # A tool that no joint turns has one rotation for all samples.
    rotation = np.broadcast_to(poses.rotation, (*poses.position.shape, 3))
    down = np.asarray(maker.view.frames.root_rotation @ maker.view.robot.gravity)
    weight = np.einsum('mji,mj->mi', rotation, np.broadcast_to(down, rotation.shape[:2]))
    sagging, fallen = np.zeros((3, 3, 6, len(rotation))), np.zeros((FALLEN, 6, len(rotation)))
    for axis in range(3):
        way = rotation[:, :, axis].T
        sagging[axis, :, :3] = weight.T[:, None] * way
        fallen[axis, :3] = np.sign(weight[:, axis]) * way
    return sagging.reshape(9, 6, -1), fallen


def _leaning(maker: Features) -> Array:
    """Return the base leaning under the arm's weight, more to one side than the other, (8, 6, M)."""
    view = maker.view
    moments = [m for moment in base_moments(view) for m in (moment, np.abs(moment))]
    leans = base_leans(view.robot, view.robot.T_base_foot[:3, :2].T)
    return maker.changes(
        [
            {channel: share * moment for channel, share in lean.items()}
            for lean in leans
            for moment in moments
        ]
    )


def _spaced(values: list[Array], count: int, least: float) -> tuple[float, ...] | None:
    low, high = min(float(v.min()) for v in values), max(float(v.max()) for v in values)
    return tuple(np.linspace(low, high, count).tolist()) if high - low > least else None


def _distance(maker: Features) -> Array:
    return np.asarray(np.linalg.norm(maker.run.poses.position, axis=1))


def _shifted(columns: Array) -> Array:
    """Return a shift along each axis, (3, 6, M), for as many samples as columns have, (..., M)."""
    return np.repeat(np.eye(6)[:3, :, None], columns.shape[-1], axis=2)


def _sighted(maker: Features, knots: tuple[float, ...] | None) -> Array:
    """Return the position along the line of sight, by distance: (1 or knots, 6, M)."""
    out = np.zeros((1, 6, maker.at.size))
    out[0, :3] = maker.run.poses.position.T
    return out if knots is None else out * basis(knots, _distance(maker))[:, None]


def _grown(maker: Features) -> Array:
    """Return what all lengths grown by the same share do, (6, M)."""
    robot = maker.twin.robot
    lengths = [((k, i), float(getattr(robot, k)[i])) for i in range(robot.n) for k in ('a', 'd')]
    return np.asarray(sum(length * maker.column(channel) for channel, length in lengths if length))


def _push(maker: Features, index: int) -> Array:
    """Return how a joint is accelerated (M,); none in a recording of too few samples to tell."""
    if maker.at.size < ENOUGH:
        return np.zeros(maker.at.size)
    return np.gradient(maker.view.qd[:, index], maker.view.t)


def _wandering(maker: Features, index: int) -> Array:
    """Return what a joint loses by its direction, more and less as time goes on, (WANDERS, M)."""
    way = QUANTITIES['direction'](maker.view, index)
    since = np.linspace(0.0, WANDERS - 1.0, way.size)
    return np.maximum(1.0 - np.abs(since - np.arange(WANDERS)[:, None]), 0.0) * way


def _lost(maker: Features, features: list[Features], index: int) -> Array:
    """Return what a joint may lose by the way it goes, (E, M): in gaps, by angle, speed and load."""
    view, unit = maker.view, maker.view.radian(index)
    q = maker.joint_view.joint(index)
    widths = unit * np.array([*GAPS, TURNED])[:, None]
    trails = play(q, widths, np.full(len(widths), q[0])) - q
    trails = Picker(maker.recording.joints, maker.run.view.t).pick(trails)
    way = trails[-1] / (-widths[-1] / 2.0)
    angles = [m.view.q[:, index] for m in features]
    knots = np.linspace(min(map(np.min, angles)), max(map(np.max, angles)), BENT)
    speed = view.qd[:, index]
    fastest = max(float(np.abs(m.view.qd[:, index]).max()) for m in features)
    rest = QUANTITIES['direction'](view, index)
    about = np.tanh(speed / (SHARES[:, None] * max(fastest, LEAST['speed'])))
    shapes = [
        *trails[:-1],
        *(way * basis(knots.tolist(), view.q[:, index])),
        *about,
        *(rest, np.abs(rest), speed, way * QUANTITIES['load'](view, index)),
    ]
    return np.asarray(shapes)
