# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a robot file can do by itself, without the effects that it cannot hold.

The constants of a model with springs are right beside the springs; without them the arm of the file
may be worse than the nominal one. So they are fitted once more, by themselves, and taken where they
leave less of what was not fitted. What they were changed by stands beside the springs with the other
sign.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...effects import REGISTRY
from ...effects.dated import of_the_robot
from ...effects.effect import Effect
from ...effects.geometry import ChannelError, FrameError
from ...twin.compensation import corrected
from ...twin.features import joints_of
from ..algebra.fit import effect_precision, fit, frame_offset, trusted
from ..algebra.problem import ROWS, Alone, Model, Problem, Scale
from ..beliefs import Beliefs
from ..result import Shrink
from ..unseen.unseen_stretches import Unseen

STEPS = 2
"""Steps of a fit that starts nearby; constants are nearly linear."""


def alone(
    problem: Problem,
    model: Model,
    scale: Scale,
    shrink: Shrink,
    beliefs: Beliefs,
    *,
    many: bool = False,
) -> Alone | None:
    """
    Return what is left with the constants of a model alone, and how they are best changed for that.

    None where places of contacts take the part of an instrument, which no file is judged by.

    many: whether many small errors were fitted together, of which none is certain by itself. Else
    constants that were found mean the arm, and stay: frames and other zeros give way.
    """
    if problem.touched or not model.found + model.known:
        return None
    problem, scale = problem.thinned_with(scale, ROWS)
    good = trusted(scale.weights)
    whole = _rms(problem, model, good)
    constants = _constants(model)
    recorded = _rms(problem, constants, good)
    unseen = float(np.sqrt(max(shrink.rms_after_m**2 + recorded**2 - whole**2, 0.0)))
    out = Alone((), recorded, unseen, whole, shrink.rms_after_m)
    if not _left(model):
        return out
    scale = replace(scale, position=max(scale.position, recorded / np.sqrt(3)))
    best, left = None, unseen
    # Aligned frames mean nothing of the arm, so they are where they do best.
    for start, gain in ((_framed(constants), 1.0), (_freed(constants, many=many), beliefs.better)):
        precision = effect_precision(start)
        if not problem.frame_count + precision.size:
            continue
        own = fit(problem, start, scale, precision, STEPS)
        ways = Unseen.of(problem, scale, own, precision).every_way()
        tried = max(each.rms(each.whole) for each in ways)
        if tried < gain * left:
            best, left = own.model, tried
    if best is None:
        return out
    changes = _changes(constants, best)
    return Alone(changes, _rms(problem, best, good), left, whole, shrink.rms_after_m)


def _left(model: Model) -> tuple[Effect, ...]:
    """Return what a robot file cannot hold of the arm and its cell."""
    return corrected(model.robot, of_the_robot(model.known + model.found))[1]


def _constants(model: Model) -> Model:
    """
    Return the model with what a robot file holds, and how the recordings' set-ups differ.

    A file has what slipped as it is afterwards; before that the recordings are without.
    """
    held = tuple(
        effect
        for effect in model.known + model.found
        if isinstance(effect, ChannelError | FrameError) and effect.twin.lasting() is not None
    )
    return replace(model, known=(), found=held)


def _framed(constants: Model) -> Model:
    """Return the model with nothing to be fitted but aligned frames: a spring moves them elsewhere."""
    return replace(constants, known=constants.found, found=())


def _freed(constants: Model, *, many: bool) -> Model:
    """Return the model with zeros of all joints to be fitted beside the constants that it has."""
    own = {(effect.name, effect.site) for effect in constants.found}
    robot = constants.robot
    more = tuple(
        kind(joint)  # type: ignore[call-arg]
        for kind in REGISTRY.values()
        if kind.traits.set_at_controller
        for joint in joints_of(kind, robot)
        if (kind.name, joint) not in own
    )
    if many:
        return constants.with_found((*constants.found, *more))
    return replace(constants, known=constants.found, found=more)


def _rms(problem: Problem, model: Model, good: Sequence[NDArray[np.bool_]]) -> float:
    parts = problem.residuals(model)
    squares = [(p[:3, fine] ** 2).sum(axis=0) for p, fine in zip(parts, good, strict=True)]
    return float(np.sqrt(np.concatenate(squares).mean()))


def _changes(constants: Model, own: Model) -> tuple[Effect, ...]:
    """Return what a file has to have beside the constants, as constant effects."""
    before = {(effect.name, effect.site): effect for effect in constants.found}
    out: list[Effect] = []
    for effect in own.found:
        old = before.get((effect.name, effect.site))
        step = effect.fit.coordinates() - (0.0 if old is None else old.fit.coordinates())
        if np.abs(step).max() > 0.0:
            out.append(effect.fit.with_coordinates(step))
    frames = {
        'base': frame_offset(own.bases[0], constants.bases[0], left=True),
        'tool': frame_offset(own.robot.T_flange_tool, constants.robot.T_flange_tool, left=False),
    }
    for kind in REGISTRY.values():
        moved = frames.get(str(kind.traits.fitted_with))
        if issubclass(kind, FrameError) and moved is not None and np.abs(moved).max() > 0.0:
            out.append(kind(xyz=moved[:3], rotvec=moved[3:]))
    return of_the_robot(out)
