# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Do measured orientations turn as the joints say, and does gravity pull down?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array
from ..algebra.problem import Model
from .evidence import Case, Finding, warning
from .limits import CLEAR, TILTED, WRONG
from .snapshot import Snapshot
from .suspicions import conventions


def orientation(case: Case) -> Sequence[Finding]:
    """Return what is wrong with orientations while positions are right."""
    if _angle(case.residuals) < WRONG:
        return ()
    shot = case.snapshot
    turned = disagreement(shot, shot.framed)
    if turned < WRONG:
        return ()
    for suspicion in conventions():
        assert suspicion.mend is not None
        trial = shot.mended(suspicion.mend)
        if CLEAR * disagreement(trial, trial.framed) < turned:
            sentence = f'{suspicion.sentence}; undone, they agree with the joints.'
            return (suspicion._replace(sentence=sentence),)
    return (
        warning(
            f'Measured orientations disagree with the joints by {np.degrees(turned):.3g} degrees '
            '(median) though positions agree; check their convention, or give positions only.'
        ),
    )


def disagreement(shot: Snapshot, model: Model) -> float:
    """Return the median angle [rad] that a model leaves of orientations; 0 where none are."""
    return _angle(shot.problem.residuals(model))


def _angle(parts: Sequence[Array]) -> float:
    angles = [np.linalg.norm(part[3:], axis=0) for part in parts if len(part) > 3]
    return float(np.median(np.concatenate(angles))) if angles else 0.0


DOWN = np.array([0.0, 0.0, -1.0])
"""Where gravity pulls in a measuring frame that stands upright."""


def gravity(case: Case) -> Sequence[Finding]:
    """Return that gravity and the way the arm was said to stand contradict each other."""
    robot = case.model.robot
    if robot.behind:
        return ()  # The measuring frame tilts with the workpiece.
    turn, pull = robot.T_world_base[:3, :3], robot.gravity
    if _off_upright(turn @ -DOWN, -DOWN) < TILTED or not np.linalg.norm(pull) > 0.0:
        return ()  # It stands upright, or nothing was said of how it stands.
    off = _off_upright(turn @ pull, DOWN)
    if off < TILTED:
        return ()
    own, right = (
        ', '.join(f'{value:.4g}' for value in vector + 0.0)
        for vector in (pull, np.round(np.linalg.norm(pull) * turn.T @ DOWN, 5))
    )
    return (
        warning(
            f'Gravity ({own}) m/s^2 is in the base frame, and with the base that was given it pulls '
            f'{np.degrees(off):.0f} degrees away from down. If the measuring frame stands upright, '
            f'gravity is ({right}); springs and payload come out wrong with another.'
        ),
    )


def _off_upright(one: Array, other: Array) -> float:
    cosine = float(one @ other) / float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))
