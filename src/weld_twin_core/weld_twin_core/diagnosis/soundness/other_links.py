# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Are the links those of another arm, where frames, zeros, twists and springs explain no gap?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ...arrays import Array
from ...effects.base_pose import BasePose
from ...effects.effect import Effect
from ...effects.joint_compliance import JointCompliance
from ...effects.joint_offset import JointOffset
from ...effects.link_length import LinkLength
from ...effects.link_offset import LinkOffset
from ...effects.link_twist import LinkTwist
from ...effects.tool_pose import ToolPose
from ..algebra.fit import fit, robust_scale
from ..algebra.prior import effect_precision
from ..algebra.problem import Model, Problem, Scale
from .evidence import Mistake, length
from .limits import LARGE, LINKS_APART, LINKS_EXPLAIN, SIBLING
from .snapshot import FRAMES, Snapshot, gap

ROUNDS = 3
"""Fits, each with the weights of the last."""
LENGTHS = {'link_length': 'a', 'link_offset': 'd'}
"""The lengths of a link, and what a robot file calls them."""


def other_links(shot: Snapshot, align: frozenset[str]) -> tuple[Mistake, float] | None:
    """
    Return that the lengths of the links are those of another arm; None where they are not.

    With it comes the median gap [m] that every other error of an arm leaves.

    Frames that are not aligned stay within what they can be off by, as all errors do.

    Parameters
    ----------
    shot : Snapshot
    align : frozenset of str
        Frames that are fitted.

    """
    problem = replace(shot.problem, align=align)
    start = _framed(shot, problem)
    given = [
        kind() for frame, kind in (('base', BasePose), ('tool', ToolPose)) if frame not in align
    ]
    own = [*given, *_of_joints(shot, (JointOffset, LinkTwist))]
    fitted = partial(_fitted, problem, start, shot.soft)
    without = fitted([*own, *_of_joints(shot, (JointCompliance,))])
    left = gap(problem, without)
    if left < LARGE:
        return None
    for spread in LINKS_APART:
        errors = [*own, *_of_joints(shot, (LinkLength, LinkOffset))]
        arm = fitted(errors, spread)
        if LINKS_EXPLAIN * gap(problem, arm) < left:
            far = _moved(problem, arm) > SIBLING
            return (_mistake(arm, left, gap(problem, arm)), left) if far else None
    return None


def _framed(shot: Snapshot, problem: Problem) -> Model:
    return shot.framed() if problem.align == FRAMES else shot.aligned(problem.align)


def _of_joints(shot: Snapshot, kinds: Sequence[type[Effect]]) -> list[Effect]:
    return [kind(name) for kind in kinds for name in shot.robot.joint_names]  # type: ignore[call-arg]


def _fitted(
    problem: Problem, start: Model, least: Scale, errors: Sequence[Effect], spread: float = 0.0
) -> Model:
    """Return the fit of errors, each with its own prior but lengths with a spread [m]."""
    model = start.with_found(tuple(errors))
    precision = effect_precision(model)
    if spread > 0.0:
        names = np.concatenate([np.repeat(e.name, e.coordinates().size) for e in errors])
        precision = np.where(np.isin(names, list(LENGTHS)), spread**-2.0, precision)
    for _ in range(ROUNDS):
        scale = robust_scale(problem, problem.residuals(model), least)
        # What an arm can have leaves less: more is no noise that would excuse anything.
        scale = replace(scale, position=min(scale.position, LARGE))
        model = fit(problem, model, scale, precision, iterations=6).model
    return model


def _moved(problem: Problem, arm: Model) -> float:
    """Return how far the lengths that were fitted move the tool, RMS [m]."""
    rest = arm.with_found(tuple(e for e in arm.found if e.name not in LENGTHS))
    pairs = zip(problem.residuals(rest), problem.residuals(arm), strict=True)
    way: Array = np.concatenate([(a - b)[:3] for a, b in pairs], axis=1)
    return float(np.sqrt((way**2).sum(axis=0).mean()))


def _mistake(arm: Model, before: float, after: float) -> Mistake:
    lengths = [e for e in arm.found if e.name in LENGTHS]
    worst = max(lengths, key=lambda e: abs(float(e.vector()[0])))
    words = (
        f'The links are not those of {arm.robot.name!r} as the model has it: {LENGTHS[worst.name]} of '
        f'{str(worst.site)!r} differs by {float(worst.vector()[0]) * 1e3:+.1f} mm; with other '
        f'lengths the gap falls from {length(before)} to {length(after)}.'
    )
    return Mistake('other_robot', ('robot',), words, GIVE_ITS_MODEL, None)


GIVE_ITS_MODEL = (
    'Give the model of the arm that was measured (siblings differ by as much); if it is this one, '
    'and less precisely built than industrial arms are, put its own lengths into the robot file'
)
