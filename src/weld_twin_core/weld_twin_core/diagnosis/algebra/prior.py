# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a fit believes before it sees data: how large errors of machines are, where frames were.

Every fit is maximum a posteriori: the table of `weld_twin_core.effects.plausible` gives the
spread of every effect coordinate about zero. A frame that is fitted has a wide spread about where
the alignment put it, so that what the data leave open stays there.
"""

from __future__ import annotations

import numpy as np

from ...arm.rotation import rotation_vector
from ...arrays import Array
from ...effects.plausible import spreads
from .problem import Model, Problem

FRAME_SHIFT = 0.02
"""Spread [m] of a frame's origin about where the alignment put it: alignment starts a fit within
2 cm, or says so."""
FRAME_TURN = 0.05
"""Spread [rad] of a frame's turn: 2 cm at an arm's reach of 0.4 m."""


def effect_precision(model: Model) -> Array:
    """Return the prior precision of every effect coordinate about zero, shape (K,)."""
    parts = [spreads(model.robot, effect) for effect in model.found]
    return np.asarray(np.concatenate([np.zeros(0), *parts]) ** -2.0) if parts else np.zeros(0)


def frame_prior(problem: Problem, model: Model) -> tuple[Array, Array]:
    """
    Return the prior precision of the frame columns, and how far the frames are off, (F,) each.

    In the order of `Problem.frame_columns`; nothing is believed of frames without an anchor.
    Errors that samples share come in standard deviations. What may differ between recordings is
    believed to be as large as in a machine.
    """
    anchor, frames = problem.anchor, list[Array]()
    precision = np.zeros(problem.frame_count)
    if anchor is not None:
        # Nothing is believed of frames without an anchor.
        sizes = np.repeat([FRAME_SHIFT, FRAME_TURN], 3)
        first = [group[0] for group in problem.stands] if 'base' in problem.align else []
        frames = [frame_offset(model.bases[k], anchor.bases[k], left=True) for k in first]
        if 'tool' in problem.align:
            tool = model.robot.T_flange_tool
            frames.append(frame_offset(tool, anchor.tool, left=False))
        names = [*('base' for _ in first), *(problem.align & {'tool'})]
        believed = np.repeat([name in anchor.of for name in names], 6)
        precision = believed * np.tile(sizes**-2.0, len(names))
    off = np.concatenate(frames) if frames else np.zeros(problem.frame_count)
    beside = [model.shared(k, own.mean.size) - own.mean for k, own in problem.common]
    precision = np.concatenate([precision, *(np.ones(part.size) for part in beside)])
    off = np.concatenate([off, *beside])
    spread = [spreads(model.robot, change.effect) for change in model.changes]
    now = [change.effect.fit.coordinates() for change in model.changes]
    own = np.concatenate([np.zeros(0), *spread]) ** -2.0 if spread else np.zeros(0)
    return np.concatenate([precision, own]), np.concatenate([off, *now])


def frame_offset(now: Array, was: Array, *, left: bool) -> Array:
    """
    Return the step (xyz, rotvec) that leads from one frame to another, as `Model.moved` does.

    now: the frame that the step leads to, shape (4, 4) [m].
    was: the frame that it starts from, shape (4, 4) [m].
    left: the turn is about the axes outside (a base), else about its own (a tool).
    """
    one, other = now[:3, :3], was[:3, :3]
    turn = one @ other.T if left else other.T @ one
    return np.concatenate([now[:3, 3] - was[:3, 3], rotation_vector(turn)])
