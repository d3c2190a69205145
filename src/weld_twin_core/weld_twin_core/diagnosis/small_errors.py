# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Dozens of small errors acting together, as in every arm once its one large fault is mended.

All geometric errors, the gears' ripple of every order, and the errors of load, play and coupling
are fitted at once, each family held to a size learned from the data (`shrinkage`); narrow ripple
lines above the dense orders are then looked for one by one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Array
from ..effects import REGISTRY
from ..effects.base import Effect, Stage
from ..features import Features, sites
from .fit import Fit, robust_scale
from .gram import Gram
from .library import families
from .problem import Model, Problem, Scale
from .shrinkage import shrunk_fit

ONE_BY_ONE = ('quantization', 'payload', 'drift', 'measurement_scale')
"""Families kept only where the search has found them: not small errors of the arm's making."""
DENSE_ORDERS = 60
HIGHEST_ORDER = 420
LINE = 25.0
"""Chi-square of two degrees of freedom that a single line must reach: one false in 1e5 looks."""
LINES = 40
SETUP = 60.0
"""Chi-square of six degrees of freedom that a motion of the set-up must reach, over 40 looks."""
RANGE = 1.0
"""A joint must travel this far [rad] for its ripple to be told from its neighbours' orders."""


def many_small(
    problem: Problem, model: Model, exclude: Sequence[str], progress: Callable[[str], None]
) -> tuple[Fit, Scale, Array]:
    """Return the fit of all families together, its noise and its prior precision."""
    everything = model.with_found(_everything(problem, model, exclude))
    scale = robust_scale(problem, problem.residuals(model))
    result, precision = shrunk_fit(problem, everything, scale, passes=1)
    progress('families fitted together')
    scale = robust_scale(problem, problem.residuals(result.model))
    if 'transmission_ripple' not in exclude:
        lined = with_lines(problem, result.model, scale)
        progress('lines of high order looked for')
    else:
        lined = result.model
    if 'base' in problem.align:
        lined = with_setup(problem, lined, scale)
        progress('motion of the set-up looked for')
    result, precision = shrunk_fit(problem, lined, scale, passes=1)
    scale = robust_scale(problem, problem.residuals(result.model))
    result, precision = shrunk_fit(problem, result.model, scale, passes=1)
    return result, scale, precision


def _everything(problem: Problem, model: Model, exclude: Sequence[str]) -> tuple[Effect, ...]:
    """Return every effect that fits linearly, at zero unless the search has found its value."""
    maker = problem.features(model)[0]
    have = {effect.key: effect for effect in model.found}
    out: list[Effect] = []
    for kind in families(exclude, problem.align):
        if kind.stage in (Stage.SERVO, Stage.CLOCK) or kind.name in ONE_BY_ONE:
            out += [e for e in model.found if e.name == kind.name]
            continue
        for joint in sites(kind, model.robot.joint_names):
            if kind.applicable(maker.view, joint) is not None:
                continue
            if kind.name == 'transmission_ripple':
                out += _dense_ripple(maker, str(joint))
                continue
            for seed in list(kind.seeds(maker.view, joint))[:2]:
                if seed.name == 'backlash':
                    seed = seed.with_coordinates(np.array([1e-5]))
                if seed.key not in {e.key for e in out}:
                    out.append(have.get(seed.key, seed))
    return tuple(out)


def _dense_ripple(maker: Features, joint: str) -> list[Effect]:
    q = maker.view.joint(maker.twin.robot.index(joint))
    if float(np.ptp(q)) < RANGE:
        return []
    orders = np.arange(1.0, DENSE_ORDERS + 1.0)
    zero = np.zeros(orders.size)
    return [REGISTRY['transmission_ripple'](joint, zero, orders, zero)]  # type: ignore[call-arg]


def with_setup(problem: Problem, model: Model, scale: Scale) -> Model:
    """
    Return the model with the set-up's own creep and step in time, where they show.

    Both are nuisance: they are part of where the frames were, not of the robot.
    """
    for name in ('setup_settling', 'setup_step'):
        kind = REGISTRY[name]
        features = problem.features(model)
        residual = problem.whitened(problem.residuals(model), scale)
        frames = problem.whitened(problem.frame_columns(features)[0], scale)
        best: tuple[float, Effect] | None = None
        for seed in features[0].seeds(kind, None)[0]:
            own = problem.whitened(problem.effect_columns(features, seed), scale)
            gram = Gram.of(np.concatenate([frames, own]), residual)
            index = np.arange(frames.shape[0], frames.shape[0] + own.shape[0])
            gram = gram.without(np.arange(frames.shape[0]))
            chi = gram.gain(index)
            if best is None or chi > best[0]:
                best = (chi, seed.from_atoms(gram.solve(index)))
        if best is not None and best[0] > SETUP:
            model = model.with_found((*model.found, best[1]))
    return model


def with_lines(problem: Problem, model: Model, scale: Scale) -> Model:
    """
    Return the model with narrow ripple lines above its dense orders.

    The score statistic of sine and cosine at every order costs one small product per joint; the
    strongest lines that are local peaks enter, the residual they explain is taken off, and the
    look is repeated.
    """
    residual = problem.residuals(model)
    features = problem.features(model)
    found = list(model.found)
    orders = np.arange(DENSE_ORDERS + 1.0, HIGHEST_ORDER + 1.0)
    for _ in range(LINES):
        best = max(
            (_peak(problem, features, residual, scale, i, orders, found)
             for i in range(model.robot.n)), key=lambda item: item[0],
        )  # fmt: skip
        if best[0] < LINE:
            break
        _, i, order, (sine, cosine) = best
        joint = model.robot.joint_names[i]
        for r, maker in enumerate(features):
            q = maker.view.q[:, i]
            wave = sine * np.sin(order * q) + cosine * np.cos(order * q)
            residual[r] = residual[r] - maker.column(('q', i))[: problem.rows[r]] * wave
        found = _with_order(found, joint, order)
    return model.with_found(tuple(found))


def _peak(
    problem: Problem, features: list[Features], residual: list[Array], scale: Scale, i: int,
    orders: Array, found: list[Effect],
) -> tuple[float, int, float, tuple[float, float]]:  # fmt: skip
    """Return the strongest order of a joint not taken yet: chi-square, joint, order, sin, cos."""
    right = np.zeros((orders.size, 2))
    normal = np.zeros((orders.size, 2, 2))
    low, high = np.inf, -np.inf
    for r, maker in enumerate(features):
        unit = np.full(problem.rows[r], scale.position**-2)
        unit[3:] = scale.orientation**-2
        column = maker.column(('q', i))[: problem.rows[r]]
        pull = (column * residual[r] * unit[:, None]).sum(axis=0) * scale.weights[r]
        mass = (column**2 * unit[:, None]).sum(axis=0) * scale.weights[r]
        q = maker.view.q[:, i]
        low, high = min(low, float(q.min())), max(high, float(q.max()))
        sine, cosine = np.sin(orders[:, None] * q), np.cos(orders[:, None] * q)
        right += np.stack([sine @ pull, cosine @ pull], axis=-1)
        cross = (sine * cosine) @ mass
        normal[:, 0, 0] += sine**2 @ mass
        normal[:, 1, 1] += cosine**2 @ mass
        normal[:, 0, 1] += cross
        normal[:, 1, 0] += cross
    if high - low < RANGE:
        return 0.0, i, 0.0, (0.0, 0.0)
    # Half the resolution that the range of motion allows separates one line from the next.
    apart = np.ceil(np.pi / (high - low))
    for effect in found:
        if effect.name == 'transmission_ripple' and effect.site == features[0].twin.robot.joint_names[i]:
            for order in np.atleast_1d(effect.order):
                right[np.abs(orders - order) < apart] = 0.0
    step = np.linalg.solve(normal + 1e-9 * np.eye(2) * np.trace(normal[0]), right[..., None])[..., 0]
    chi = (right * step).sum(axis=-1)
    k = int(np.argmax(chi))
    return float(chi[k]), i, float(orders[k]), (float(step[k, 0]), float(step[k, 1]))


def _with_order(found: list[Effect], joint: str, order: float) -> list[Effect]:
    out = []
    for effect in found:
        if effect.name == 'transmission_ripple' and effect.site == joint:
            effect = replace(
                effect,
                amplitude=np.append(effect.amplitude, 0.0),
                order=np.append(effect.order, order),
                phase=np.append(effect.phase, 0.0),
            )
        out.append(effect)
    return out
