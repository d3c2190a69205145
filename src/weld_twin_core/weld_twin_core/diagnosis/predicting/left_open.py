# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Directions of the frames that the recordings do not show, in words."""

from __future__ import annotations

import numpy as np

from ..algebra.problem import Model, Problem
from ..frames.open_directions import VISIBLE, open_directions

PARTNERS = 0.35
"""Part of a direction from which on an axis is named with it."""
MOST = 3
"""Axes that name a direction."""
AXES = ('x', 'y', 'z', 'turn about x', 'turn about y', 'turn about z')


def left_open(problem: Problem, model: Model) -> tuple[str, ...]:
    """
    Return the directions of aligned frames in which an error does not show, in words.

    A direction is named by the axes that make most of it: 'base z with tool z' is a shift of both
    along z by which no measured pose changes.
    """
    found = open_directions(problem, model)
    size = np.array([VISIBLE[int(name.split('.')[1]) // 3] for name in found.names])
    out = []
    for vector in found.vectors.T:
        share = np.abs(vector / size)
        order = [i for i in np.argsort(-share) if share[i] >= PARTNERS * share.max()]
        out.append(' with '.join(_named(found.names[i]) for i in order[:MOST]))
    return tuple(out)


def _named(name: str) -> str:
    frame, axis = name.split('.')
    kind, _, number = frame.partition(' ')
    which = '' if number in ('', '0') else f' of recording {int(number) + 1}'
    return f'{kind} {AXES[int(axis)]}{which}'
