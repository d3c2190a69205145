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

from ...arrays import Array
from ...effects import REGISTRY
from ...effects.effect import Effect, Stage
from ...twin.features import Features, sites
from ..algebra.fit import Fit, robust_scale
from ..algebra.gram import Gram
from ..algebra.problem import Model, Problem, Scale
from ..beliefs import Beliefs
from ..hypotheses.library import families
from ..hypotheses.ripple_lines import DENSE_ORDERS, with_lines
from .shrinkage import shrunk_fit, shrunk_step

CLOSED = 1e-5
"""Width of play [rad] that many small errors start from; less is none."""
ONE_BY_ONE = ('quantization', 'payload', 'drift', 'measurement_scale')
"""Families kept only where the search has found them: not small errors of the arm's making."""


def many_small(
    problem: Problem,
    model: Model,
    exclude: Sequence[str],
    beliefs: Beliefs,
    progress: Callable[[str], None],
) -> tuple[Fit, Scale, Array]:
    """Return the fit of all families together, its noise and its prior precision."""
    everything = model.with_found(_everything(problem, model, exclude, beliefs))
    scale = robust_scale(problem, problem.residuals(model))
    model, scale = shrunk_step(problem, everything, scale, beliefs)
    model = model.with_found(tuple(_coasting(effect) for effect in model.found))
    progress('families fitted together')
    if 'transmission_ripple' not in exclude:
        model = with_lines(problem, model, scale, beliefs)
        progress('lines of high order looked for')
    if 'base' in problem.align:
        model = with_setup(problem, model, scale, beliefs)
        progress('motion of the set-up looked for')
    model, scale = shrunk_step(problem, model, scale, beliefs)
    result, precision = shrunk_fit(problem, model, scale, beliefs)
    return result, scale, precision


def _coasting(effect: Effect) -> Effect:
    """Return play that the data refuse as the arm resting ahead instead of behind."""
    if effect.name != 'backlash' or effect.coordinates()[0] > CLOSED:
        return effect
    return replace(effect, form='coast', width=CLOSED)  # type: ignore[call-arg]


def _everything(
    problem: Problem, model: Model, exclude: Sequence[str], beliefs: Beliefs
) -> tuple[Effect, ...]:
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
                out += _dense_ripple(maker, str(joint), problem.size, beliefs)
                continue
            for seed in list(kind.seeds(maker.view, joint))[:2]:
                if seed.name == 'backlash':
                    seed = seed.with_coordinates(np.array([CLOSED]))
                if seed.key not in {e.key for e in out}:
                    out.append(have.get(seed.key, seed))
    return tuple(out)


def _dense_ripple(maker: Features, joint: str, rows: int, beliefs: Beliefs) -> list[Effect]:
    q = maker.view.joint(maker.twin.robot.index(joint))
    if float(np.ptp(q)) < beliefs.wave_range:
        return []
    # All joints' sines and cosines together stay below half the rows.
    highest = min(DENSE_ORDERS, rows // (4 * maker.twin.robot.n))
    if highest < 1:
        return []
    orders = np.arange(1.0, highest + 1.0)
    zero = np.zeros(orders.size)
    return [REGISTRY['transmission_ripple'](joint, zero, orders, zero)]  # type: ignore[call-arg]


def with_setup(problem: Problem, model: Model, scale: Scale, beliefs: Beliefs) -> Model:
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
        if best is not None and best[0] > beliefs.setup_chi2:
            model = model.with_found((*model.found, best[1]))
    return model
