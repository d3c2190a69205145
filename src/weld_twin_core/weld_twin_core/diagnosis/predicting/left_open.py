# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Directions of the frames that the recordings do not show: they stay as they were given."""

from __future__ import annotations

import numpy as np

from ..algebra.problem import Model, Problem, Scale

VISIBLE = (1e-3, 5e-3)
"""A frame error [m, rad] that the data should show above their noise."""
PARTNERS = 0.35
"""Part of a direction from which on an axis is named with it."""
AXES = ('x', 'y', 'z', 'turn about x', 'turn about y', 'turn about z')


def left_open(problem: Problem, model: Model, scale: Scale) -> tuple[str, ...]:
    """
    Return the directions of aligned frames in which an error does not show, in words.

    A direction is named by the axes that make most of it: 'base z with tool z' is a shift of both
    along z by which no measured pose changes.

    Parameters
    ----------
    problem : Problem
        The recordings to explain, and the frames that are fitted along.
    model : Model
        What is believed so far; everything is taken about it.
    scale : Scale
        The noise that residuals are measured in, and the weight of every sample.

    """
    problem = problem.thinned(3000)
    parts, names = problem.frame_columns(problem.features(model))
    if not names:
        return ()
    columns = problem.whitened(parts, problem.unit_scale())
    size = np.array([VISIBLE[0] if int(n.split('.')[1]) < 3 else VISIBLE[1] for n in names])
    scaled = columns * size[:, None]
    strength, vectors = np.linalg.eigh(scaled @ scaled.T)
    out = []
    for k in np.flatnonzero(strength < 1.0):
        share = np.abs(vectors[:, k])
        order = [i for i in np.argsort(-share) if share[i] >= PARTNERS * share.max()]
        out.append(' with '.join(_named(names[i]) for i in order[:3]))
    return tuple(out)


def _named(name: str) -> str:
    frame, axis = name.split('.')
    kind, _, number = frame.partition(' ')
    which = '' if number in ('', '0') else f' of recording {int(number) + 1}'
    return f'{kind} {AXES[int(axis)]}{which}'
