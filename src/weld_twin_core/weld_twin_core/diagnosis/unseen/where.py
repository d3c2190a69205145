# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Where the gap lies, what it depends on, and whether something is left that no named effect explains.

All groups without a formula are tried without the effects; beside the model only a few, as of many one
fits noise by chance. Those that predict unseen folds better say what the residual depends on.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from ..algebra.fit import Fit, trusted
from ..algebra.problem import Model, Problem
from ..beliefs import Beliefs
from ..evidence import NAMED, Search
from ..negligible import EMPTY, MICROMETRE, ROUNDING
from ..result import Cause, Structure, Where
from .chance import Candidates, chance_gain, may_be_chance
from .folds import Gain
from .groups import FALLEN, FIELD, FINE, KNOTS, Group, all_groups
from .unseen_stretches import RIDGES, Unseen

REGRESSORS = {
    'constant': 'constant',
    'angle, low order': 'angle',
    'angle, high order': 'waves',
    'reversal': 'direction',
    'speed': 'speed',
    'acceleration': 'acceleration',
    'load': 'load',
    'temperature': 'temperature',
    'time': 'time',
}
"""Columns of the map, and the dependence that each stands for."""
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
"""Stretches of time for which the gap is reported: as many as a figure can show."""


def locate(result: Search, found: Structure, causes: Sequence[Cause] = ()) -> Where:
    """
    Return where the gap lies, of the model before any effect was found.

    causes: of the answer, if any: joints and regimes are then theirs, so that they say what the answer
    says, also where a cause sits at no joint or its place is not certain.
    """
    problem, start = result.problem, result.baseline.model
    names = start.robot.joint_names
    shares = np.array(
        [[max(found.of_gap.get((n, on), 0.0), 0.0) for on in REGRESSORS.values()] for n in names]
    )
    if causes:
        joints, regimes = _of_causes(causes, names)
    else:
        joints = dict(zip(names, map(float, shares.max(axis=1)), strict=True))
        best = dict(zip(REGRESSORS, map(float, shares.max(axis=0)), strict=True))
        best['static'] = max(best[name] for name in list(REGRESSORS)[:3])
        regimes = {name: best[name] for name in REGIMES}
    ordered = sorted(joints.items(), key=lambda item: -item[1])
    good = trusted(result.scale.weights)
    return Where(
        joints=tuple(ordered),
        regimes=regimes,
        path=_path(problem, start, good),
        direction=_direction(problem, start, good),
        map_regressors=tuple(REGRESSORS),
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
        for part in np.array_split(np.arange(squares.size), count):
            index = part[kept[part]]
            if index.size:
                t = recording.seen.t[index]
                share = float(squares[index].sum()) / max(total, EMPTY)
                rms = float(np.sqrt(squares[index].mean()))
                out.append((float(t[0]), float(t[-1]), share, rms))
    return tuple(out)


def _direction(problem: Problem, model: Model, good: list[np.ndarray]) -> dict[str, float]:
    """Return the RMS gap along the path, across it, and along the tool's axis, [m]."""
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
        along = np.where(size > MICROMETRE, travel / np.maximum(size, ROUNDING), 0.0)
        normal = normal - along * (normal * along).sum(axis=1, keepdims=True)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), ROUNDING)
        a, c = (error * along).sum(axis=1)[kept], (error * normal).sum(axis=1)[kept]
        across = np.maximum((error[kept] ** 2).sum(axis=1) - a**2 - c**2, 0.0)
        sums += [float((a**2).sum()), float(across.sum()), float((c**2).sum())]
    rms = np.sqrt(sums / max(sum(int(g.sum()) for g in good), 1))
    return {'along_m': float(rms[0]), 'across_m': float(rms[1]), 'normal_m': float(rms[2])}


def structure(unseen: Unseen, model: Model, baseline: Fit, beliefs: Beliefs) -> Structure:
    """Return what groups without a formula add to a model, in folds not used for fitting."""
    problem = unseen.problem
    bare = Unseen.of(problem, unseen.scale, baseline, np.zeros(0))
    base, first = (each.base(range(len(each.parts))) for each in (unseen, bare))
    before = first.errors(first.residual).sum()
    found, of_gap = list[tuple[Gain, Group]](), dict[tuple[str, str], float]()
    joints = model.robot.joint_names
    # Where no instrument measured, and nothing shows where the base stands, joints alone are reported.
    elsewhere = problem.placed or not problem.untracked
    named = {effect.traits.place for effect in model.found}
    for group in all_groups(problem, model, unseen.scale):
        if group.at in joints:
            after = first.errors(first.extended(group.columns, RIDGES[1:2])[0]).sum()
            # Waves of a gear stand by themselves.
            waves = group.on == 'angle' and len(group.columns) == FINE
            key = group.at, 'waves' if waves else group.on
            of_gap[key] = max(of_gap.get(key, 0.0), float(1.0 - after / max(before, EMPTY)))
        if _tells(group, joints, named) and (elsewhere or group.at in joints):
            found.append((base.gain(group.columns), group))
    if not found:
        return Structure(unseen.rms(unseen.whole), 0.0, 0.0, (), of_gap=of_gap)
    found.sort(key=lambda item: -item[0].share)
    best = found[0][0]
    least, certain = beliefs.dependence_gain, beliefs.steady
    reliable = [g for one, g in found if one.share > least and one.steady > certain]
    names = tuple(map(str, reliable[:NAMED]))
    chance = 0.0
    counts = best.share > beliefs.structure_gain and best.steady > beliefs.blatant_sure
    if counts and may_be_chance(unseen.residual.size, best.share):
        every = all_groups(problem, model, unseen.scale)
        each = (g.columns for g in every if _tells(g, joints, named))
        columns = unseen.columns.written_out()
        tried = Candidates(columns, unseen.precision, each, RIDGES, [unseen.labels])
        chance = chance_gain(tried, beliefs.blatant_sure)
    return Structure(best.rms_m, best.share, best.steady, names, chance, of_gap)


def _tells(group: Group, joints: Collection[str], named: Collection[str]) -> bool:
    """
    Return whether a group is one of the few that show what is left: the widest of their kind.

    named: places of the effects found. Where a sag of the tool is one, a loose tool is beside it.
    """
    at_joint = group.at in joints
    if group.on == 'angle' and at_joint:
        return len(group.curves) == 1 and len(group.columns) == KNOTS['angle']
    if group.on == 'direction':
        return not group.curves
    return not at_joint and (
        group.on == 'time'
        or (group.on, len(group.columns)) == ('place', FIELD)
        or (group.at in named and len(group.columns) == FALLEN)
    )
