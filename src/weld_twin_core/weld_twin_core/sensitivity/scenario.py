# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's error scenarios (IV.ii to IV.vi): each source alone, and all of them together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arm.robot import Robot
from ..arrays import Array
from ..effects import Effect
from ..effects.backlash import Backlash
from ..effects.frame_errors import BasePose
from ..effects.geometry import JointOffset, LinkLength
from .seam_study import Study
from .sweep import DEGREE


@dataclass(frozen=True)
class Sizes:
    """Errors of the scenarios; the same on every joint."""

    offset: float = 0.05 * DEGREE
    """[rad]"""
    length: float = 1e-4
    """[m]"""
    initial: float = 5e-4
    """Size of the initialization offset, along the diagonal of the world frame [m]."""
    width: float = 0.03 * DEGREE
    """[rad]"""


def _sources(robot: Robot, sizes: Sizes | None = None) -> dict[str, tuple[Effect, ...]]:
    """Return the effects of every source of the combined scenario."""
    size = sizes or Sizes()
    joints = robot.joint_names
    return {
        'angular': tuple(JointOffset(joint, size.offset) for joint in joints),
        'link length': tuple(LinkLength(joint, size.length) for joint in joints),
        'initialization': (BasePose(xyz=np.full(3, size.initial / np.sqrt(3.0))),),
        'backlash': tuple(Backlash(joint, size.width) for joint in joints),
    }


def scenario_deviations(study: Study, sizes: Sizes | None = None) -> dict[str, Array]:
    """
    Return the deviations of every source alone and of all together, in seam axes.

    Parameters
    ----------
    study : Study
    sizes : Sizes, optional
        Left out, those of the paper.

    Returns
    -------
    dict of str to array, shape (N, 3) [m]
        By source; 'combined' for all together.

    """
    each = _sources(study.robot, sizes)
    out = {name: study.deviations((*study.known, *effects)) for name, effects in each.items()}
    every = tuple(effect for effects in each.values() for effect in effects)
    return {**out, 'combined': study.deviations((*study.known, *every))}


def spread_of_passes(study: Study, deviations: Array) -> Array:
    """
    Return how far apart the passes over one place of the seam are, shape (...) [m].

    The median over twentieths of the seam.

    Parameters
    ----------
    study : Study
    deviations : array, shape (..., N, 3) [m]

    """
    part = np.floor(study.s / study.length * 20.0).astype(int)
    apart = [
        np.linalg.norm(np.ptp(deviations[..., part == k, :], axis=-2), axis=-1)
        for k in np.unique(part)
    ]
    return np.asarray(np.median(apart, axis=0))


def cumulative(deviations: Array) -> Array:
    """
    Return D_cum up to every sample (paper, eq. III.iv), shape (N,) [m].

    Parameters
    ----------
    deviations : array, shape (N, 3) [m]

    """
    return np.cumsum(np.linalg.norm(deviations, axis=-1))
