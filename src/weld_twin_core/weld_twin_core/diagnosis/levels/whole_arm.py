# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Places that no single joint shows: the instrument, all links alike, a weight at the tool.

A wrong unit of length looks like small constants of several joints, a weight like several
springs, links that warm up like several lengths. One group for each lets the simplest explanation
win. Beside them stands what each joint loses by the way it goes, without a formula for how. None of
these groups can be carried to another motion as a curve; they say where, and on what it depends.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...arm.dynamics import payload_torque
from ...arrays import Array
from ...effects.associative_scan import play
from ...effects.curve import QUANTITIES, basis
from ...twin.features import Features
from ...twin.resampling import Picker
from ..algebra.problem import Model, Problem, Scale
from .groups import LEAST, Group, spanned

RANGES = 4
"""Knots over the distance from the instrument: straight, bent, and bent back."""
WARM = 3
"""Knots over the temperature."""
GAPS = (5e-5, 2e-4, 8e-4, 2e-3, 1e-2, 4e-2, 0.16)
"""Widths [rad, or tens of centimetres] of gaps in series: from half of what the finest play is to
what takes a quarter of a radian to build up."""
TURNED = 1e-4
"""Travel [rad, or tens of centimetres] after which a joint counts as going the other way: teeth
have changed flanks by then."""
BENT = 4
"""Knots over the angle for each way: straight, bent, and bent back."""
SHARES = (0.02, 0.1, 0.4)
"""Shares of the joint's largest speed about which what depends on the way may set in."""
SLIDING = 0.1
"""Metres of a joint that slides which are looked at as a radian of one that turns."""
NEAR = 1e-3
"""Span of distances [m] below which there is one distance."""


def whole_arm_groups(problem: Problem, model: Model, scale: Scale) -> list[Group]:
    """
    Return the groups of causes that act at several joints at once, and what each joint loses.

    Parameters
    ----------
    problem : Problem
    model : Model
        What is believed so far; everything is taken about it.
    scale : Scale

    """
    features = problem.features(model)
    out = [
        spanned(
            problem, scale, at, on, (), [problem.seen(k, part) for k, part in enumerate(parts)]
        )
        for at, on, parts in _yielded(features)
        if not (at == 'instrument' and problem.untracked)
    ]
    for i, joint in enumerate(model.robot.joint_names if not problem.at_rest else ()):
        if moves(features, i):
            parts = [
                lost_motion(problem, k, maker, features, i) for k, maker in enumerate(features)
            ]
            out.append(spanned(problem, scale, joint, 'direction', (), parts))
    return [group for group in out if group.columns.size]


def _yielded(features: list[Features]) -> Iterator[tuple[str, str, list[Array]]]:
    yield 'instrument', 'place', [_sighted(maker, None) for maker in features]
    knots = _knots([_distance(maker) for maker in features], RANGES, NEAR)
    if knots is not None:
        yield 'instrument', 'place', [_sighted(maker, knots) for maker in features]
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


def moves(features: list[Features], i: int) -> bool:
    """Return whether joint i moves at all."""
    return max(float(np.ptp(m.run.view.q[:, i])) for m in features) > LEAST['angle']


def lost_motion(
    problem: Problem, k: int, maker: Features, features: list[Features], i: int
) -> Array:
    """
    Return what joint i may lose by the way it goes, shape (E, c, M).

    Lost motion is free in the gaps it trails in, and in angle, speed and load by the way it goes.

    Parameters
    ----------
    problem : Problem
    k : int
        Which recording, counted from 0.
    maker : Features
        Of that recording.
    features : list of Features
        Of all recordings.
    i : int
        Which joint, counted from 0.

    """
    view, unit = maker.view, SLIDING if maker.twin.robot.prismatic[i] else 1.0
    q = maker.joint_view.joint(i)
    widths = unit * np.array([*GAPS, TURNED])[:, None]
    trails = play(q, widths, np.full(len(widths), q[0])) - q
    trails = Picker(maker.recording.joints, maker.run.view.t).pick(trails)
    way = trails[-1] / (-0.5 * widths[-1])
    angles = [m.view.q[:, i] for m in features]
    knots = np.linspace(min(map(np.min, angles)), max(map(np.max, angles)), BENT)
    speed = view.qd[:, i]
    fastest = max(float(np.abs(m.view.qd[:, i]).max()) for m in features)
    rest = QUANTITIES['direction'](view, i)
    about = np.tanh(speed / (np.array(SHARES)[:, None] * max(fastest, LEAST['speed'])))
    shapes = [
        *trails[:-1],
        *(way * basis(knots.tolist(), view.q[:, i])),
        *about,
        *(rest, np.abs(rest), speed, way * QUANTITIES['load'](view, i)),
    ]
    return np.asarray(problem.seen(k, maker.column(('q', i))) * np.array(shapes)[:, None, :])
