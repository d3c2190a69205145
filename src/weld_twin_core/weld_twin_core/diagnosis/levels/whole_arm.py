# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Places that no single joint shows: the instrument, all links alike, a weight at the tool.

A wrong unit of length looks like small constants of several joints, a weight like several
springs, links that warm up like several lengths. One group for each lets the simplest explanation
win. Beside them stand loops of joints: lost motion that builds up over a travel, without a formula
for how. None of these groups can be carried to another motion as a curve; they say where, and on
what it depends.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...arm.dynamics import payload_torque
from ...arrays import Array
from ...effects.associative_scan import play
from ...effects.curve import basis
from ...twin.features import Features
from ...twin.resampling import Picker
from ..algebra.problem import Model, Problem, Scale
from .groups import LEAST, Group, spanned

RANGES = 4
"""Knots over the distance from the instrument: straight, bent, and bent back."""
WARM = 3
"""Knots over the temperature."""
LOOPS = (2e-3, 1e-2, 4e-2, 0.16)
"""Widths [rad, or tens of centimetres] of the gaps in series that make up a loop: from what acts
like a gap to what takes a quarter of a radian to build up."""
SLIDING = 0.1
"""Metres of a joint that slides which are looked at as a radian of one that turns."""
NEAR = 1e-3
"""Span of distances [m] below which there is one distance."""


def whole_arm_groups(problem: Problem, model: Model, scale: Scale) -> list[Group]:
    """Return the groups of causes that act at several joints at once, and loops of each joint."""
    features = problem.features(model)
    out = [
        spanned(
            problem, scale, at, on, (), [problem.seen(k, part) for k, part in enumerate(parts)]
        )
        for at, on, parts in _yielded(features)
        if not (at == 'instrument' and problem.untracked)
    ]
    return [group for group in out if group.columns.size]


def _yielded(features: list[Features]) -> Iterator[tuple[str, str, list[Array]]]:
    yield 'instrument', 'place', [_sighted(maker, None) for maker in features]
    knots = _knots([_distance(maker) for maker in features], RANGES, NEAR)
    if knots is not None:
        yield 'instrument', 'place', [_sighted(maker, knots) for maker in features]
    if any(maker.view.effort is None for maker in features):  # else what hangs there was measured
        yield 'load', 'load', [_weighed_down(maker) for maker in features]
        yield 'load', 'load', [_carried(maker) for maker in features]
    if all(maker.view.temperature is not None for maker in features):
        warmth = [np.asarray(maker.view.temperature) for maker in features]
        knots = _knots(warmth, WARM, LEAST['temperature'])
        if knots is not None:
            pairs = zip(features, warmth, strict=True)
            yield (
                'base',
                'temperature',
                [_grown(m)[None] * basis(knots, w)[:, None] for m, w in pairs],
            )
            pairs = zip(features, warmth, strict=True)
            middle = 0.5 * (knots[0] + knots[-1])
            yield 'base', 'temperature', [_grown(m)[None] * (w - middle) for m, w in pairs]
    if not all(maker.run.view.static for maker in features):
        for index, joint in enumerate(features[0].twin.robot.joint_names):
            yield joint, 'direction', [_looped(maker, index) for maker in features]


def _knots(values: list[Array], count: int, least: float) -> tuple[float, ...] | None:
    low, high = min(float(v.min()) for v in values), max(float(v.max()) for v in values)
    return tuple(np.linspace(low, high, count).tolist()) if high - low > least else None


def _distance(maker: Features) -> Array:
    return np.asarray(np.linalg.norm(maker.run.poses.position, axis=1))


def _sighted(maker: Features, knots: tuple[float, ...] | None) -> Array:
    """Return the position along the line of sight, by distance: (1 or knots, 6, M)."""
    out = np.zeros((1, 6, maker.at.size))
    out[0, :3] = maker.run.poses.position.T
    return out if knots is None else out * basis(knots, _distance(maker))[:, None]


def _weighed_down(maker: Features) -> Array:
    """Return every joint bent by the torque of a mass at the tool, (n, 6, M)."""
    torque = _torque(maker)
    return np.array([maker.column(('q', i)) * t for i, t in enumerate(torque)])


def _carried(maker: Features) -> Array:
    """Return what a mass at the tool does through the springs that are known, (1, 6, M)."""
    return maker.changes([{('tau', i): t for i, t in enumerate(_torque(maker))}])


def _torque(maker: Features) -> Array:
    view = maker.view
    return payload_torque(view.robot, view.frames, 1.0, np.zeros(3))


def _grown(maker: Features) -> Array:
    """Return what all lengths grown by the same share do, (6, M)."""
    robot = maker.twin.robot
    lengths = [((k, i), float(getattr(robot, k)[i])) for i in range(robot.n) for k in ('a', 'd')]
    return np.asarray(sum(length * maker.column(channel) for channel, length in lengths if length))


def _looped(maker: Features, index: int) -> Array:
    """Return a joint that trails in gaps of several widths in series, (L, 6, M)."""
    view = maker.joint_view
    unit = SLIDING if view.robot.prismatic[index] else 1.0
    q = view.joint(index)
    widths = unit * np.array(LOOPS)[:, None]
    trails = play(q, widths, np.full(len(LOOPS), q[0])) - q
    at = Picker(maker.recording.joints, maker.run.view.t).pick(trails)
    return np.asarray(maker.column(('q', index))[None] * at[:, None, :])
