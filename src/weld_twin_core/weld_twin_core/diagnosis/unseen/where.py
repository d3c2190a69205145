# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the gap lies: joints, regimes, stretches of the path, directions along the seam."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array
from ...twin.features import Features
from ..algebra.fit import trusted
from ..algebra.problem import Model, Problem
from ..hypotheses.search import Search
from ..result import Cause, Where
from .leftover_structure import of_joint
from .unseen_stretches import Unseen

REGRESSORS = (
    'constant',
    'angle, low order',
    'angle, high order',
    'reversal',
    'speed',
    'acceleration',
    'load',
    'temperature',
    'time',
)
REGIMES = ('static', 'reversal', 'speed', 'acceleration', 'load', 'temperature', 'time')
REGIME_OF = {
    'constant': 'static',
    'angle': 'static',
    'place': 'static',
    'direction': 'reversal',
    **{name: name for name in REGIMES[2:]},
}
"""The regime in which each dependence shows."""
STRETCHES = 12
"""Stretches of time that the gap is told for: as many as a figure can show."""


def locate(result: Search, final: Unseen, causes: Sequence[Cause] = ()) -> Where:
    """
    Return where the gap lies.

    Parameters
    ----------
    result : Search
        Its baseline is the model before any effect was found.
    causes : sequence of Cause
        Of the answer, if there are any: joints and regimes are then theirs, so that they say what
        the answer says, also where a cause sits at no joint or its place is not certain.

    """
    problem, start = result.problem, result.baseline.model
    baseline = Unseen.of(problem, result.scale, result.baseline, np.zeros(0))
    shares = _map(problem, baseline, start)
    if causes:
        joints, regimes = _of_causes(causes, start.robot.joint_names)
    elif result.final.model.found:
        joints, regimes = _explained(final, result.final.model)
    else:
        joints = {
            name: float(row.max())
            for name, row in zip(start.robot.joint_names, shares, strict=True)
        }
        regimes = _map_regimes(shares)
    ordered = sorted(joints.items(), key=lambda item: -item[1])
    good = trusted(final.scale.weights)
    return Where(
        joints=tuple(ordered),
        regimes=regimes,
        path=_path(problem, start, good),
        direction=_direction(problem, start, good),
        map_regressors=REGRESSORS,
        map_shares=tuple(tuple(float(v) for v in row) for row in shares),
    )


def _of_causes(
    causes: Sequence[Cause], names: Sequence[str]
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the shares of the causes by their places and dependences, as far as believed."""
    joints, regimes = dict.fromkeys(names, 0.0), dict.fromkeys(REGIMES, 0.0)
    for cause in causes:
        at, on = (sum(p for _, p in reported) for reported in (cause.place, cause.dependence))
        for place, p in cause.place:
            if place in joints:
                joints[place] += cause.share * p / at
        for dependence, p in cause.dependence:
            regimes[REGIME_OF[dependence]] += cause.share * p / on
    return joints, regimes


def _explained(final: Unseen, result: Model) -> tuple[dict[str, float], dict[str, float]]:
    """Return how much of the unseen squared gap the effects of every joint and regime explain."""
    everything = range(len(result.found))
    total = final.squares(final.bare).mean()
    after = final.squares(final.whole).mean()

    def fall(members: list[int]) -> float:
        if not members:
            return 0.0
        less = final.predict([k for k in everything if k not in members])
        return max(float(final.squares(less).mean() - after), 0.0)

    at = {
        name: [k for k in everything if result.found[k].site == name]
        for name in result.robot.joint_names
    }
    under = {
        name: [k for k in everything if REGIME_OF[result.found[k].on] == name] for name in REGIMES
    }
    free = [k for k in everything if result.found[k].site is None]
    return (
        _shares({name: fall(members) for name, members in at.items()}, fall(free), total, after),
        _shares({name: fall(members) for name, members in under.items()}, 0.0, total, after),
    )


def _shares(falls: dict[str, float], rest: float, total: float, after: float) -> dict[str, float]:
    """Return each fall's part of the share of the squared gap that the model explains."""
    explained = max(total - after, 0.0) / max(total, 1e-300)
    scale = explained / max(sum(falls.values()) + rest, 1e-300)
    return {name: value * scale for name, value in falls.items()}


def _map(problem: Problem, baseline: Unseen, model: Model) -> Array:
    """Return the share of unseen squared gap that each joint x regressor explains, (n, R)."""
    features = problem.features(model)
    base = baseline.base(range(len(baseline.parts)))
    before = baseline.squares(base.residual).mean()
    out = np.zeros((model.robot.n, len(REGRESSORS)))
    for i in range(model.robot.n):
        for r, name in enumerate(REGRESSORS):
            each = [_regressor(maker, i, name) for maker in features]
            block = of_joint(problem, features, baseline.scale, i, each)
            if block.shape[0]:
                after = baseline.squares(base.extended(block, [1.0])[0]).mean()
                out[i, r] = max(0.0, 1.0 - float(after / max(before, 1e-300)))
    return out


def _regressor(maker: Features, i: int, name: str) -> Array:
    view = maker.view
    q, qd = view.q[:, i], view.qd[:, i]
    one = np.ones_like(q)
    match name:
        case 'constant':
            return one[None]
        case 'angle, low order':
            return np.stack([q, np.sin(q), np.cos(q), np.sin(2 * q), np.cos(2 * q)])
        case 'angle, high order':
            return np.stack([f(n * q) for n in range(3, 41) for f in (np.sin, np.cos)])
        case 'reversal':
            if view.static:
                return np.sign(np.diff(q, prepend=q[:1]))[None]
            fast = max(float(np.abs(qd).max()), 1e-12)
            return np.tanh(qd / (0.02 * fast))[None]
        case 'speed':
            return qd[None]
        case 'acceleration':
            return np.zeros((1, q.size)) if view.static else np.gradient(qd, view.t)[None]
        case 'load':
            return np.asarray(view.shift[('tau', i)])[None] * one
        case 'temperature':
            return np.zeros((1, q.size)) if view.temperature is None else view.temperature[None]
        case _:
            return view.elapsed[None]


def _map_regimes(shares: Array) -> dict[str, float]:
    best = {name: float(shares[:, r].max()) for r, name in enumerate(REGRESSORS)}
    best['static'] = max(best[name] for name in REGRESSORS[:3])
    return {name: best[name] for name in REGIMES}


def _path(
    problem: Problem, model: Model, good: list[np.ndarray]
) -> tuple[tuple[float, float, float, float], ...]:
    """Return stretches of time with their share of the squared gap and their RMS."""
    out = []
    parts = problem.residuals(model)
    total = sum(float((part[:3, g] ** 2).sum()) for part, g in zip(parts, good, strict=True))
    for recording, part, kept in zip(problem.recordings, parts, good, strict=True):
        squares = (part[:3] ** 2).sum(axis=0)
        count = max(1, round(STRETCHES * squares.size / max(sum(problem.samples), 1)))
        for stretch in np.array_split(np.arange(squares.size), count):
            index = stretch[kept[stretch]]
            if index.size:
                t = recording.seen.t[index]
                share = float(squares[index].sum()) / max(total, 1e-300)
                rms = float(np.sqrt(squares[index].mean()))
                out.append((float(t[0]), float(t[-1]), share, rms))
    return tuple(out)


def _direction(problem: Problem, model: Model, good: list[np.ndarray]) -> dict[str, float]:
    """
    Return the RMS gap along the path, across it, and along the tool's axis (stick-out), [m].

    Along is the direction of travel; stations have none and count as across.
    """
    sums = np.zeros(3)
    for recording, part, maker, kept in zip(
        problem.recordings, problem.residuals(model), problem.features(model), good, strict=True
    ):
        error, poses = part[:3].T, maker.run.poses
        normal = poses.rotation[:, :, 2]
        travel = np.zeros_like(error)
        if not recording.joints.static and error.shape[0] > 2:
            travel = np.gradient(poses.position, maker.at, axis=0)
        size = np.linalg.norm(travel, axis=1, keepdims=True)
        along = np.where(size > 1e-6, travel / np.maximum(size, 1e-12), 0.0)
        normal = normal - along * (normal * along).sum(axis=1, keepdims=True)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        a, c = (error * along).sum(axis=1)[kept], (error * normal).sum(axis=1)[kept]
        across = np.maximum((error[kept] ** 2).sum(axis=1) - a**2 - c**2, 0.0)
        sums += [float((a**2).sum()), float(across.sum()), float((c**2).sum())]
    rms = np.sqrt(sums / max(sum(int(g.sum()) for g in good), 1))
    return {'along_m': float(rms[0]), 'across_m': float(rms[1]), 'normal_m': float(rms[2])}
