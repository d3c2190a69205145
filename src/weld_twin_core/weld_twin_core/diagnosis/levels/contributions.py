# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What every cause adds to the gap, sample by sample, so that causes can be thought away."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array
from ..result import Cause, Contributions
from ..unseen.unseen_stretches import Unseen


def contributions(unseen: Unseen, causes: Sequence[Cause]) -> Contributions | None:
    """
    Return what every cause adds to the residual on unseen stretches; None where none can be told.

    A cause is taken off as it acts along with the others, and the frames that are fitted anew take
    their part of it. What the fits of fewer effects make of each other is a small rest; it is
    shared out by size, so that all adds up.

    Parameters
    ----------
    unseen : Unseen
        Of the model that the causes stand for.

    """
    if not any(cause.members for cause in causes):
        return None
    fields = _fields(unseen)
    named = {k for cause in causes for k in cause.members}
    others = tuple(k for k in range(len(fields)) if k not in named)
    groups = [cause.members for cause in causes] + [others] * bool(others)
    parts = np.array([fields[list(group)].sum(axis=0) for group in groups])
    left = unseen.whole
    rest = unseen.bare - left - parts.sum(axis=0)
    sizes = (parts**2).mean(axis=1)
    parts += rest * (sizes / max(float(sizes.sum()), 1e-300))[:, None]
    split = [_metres(unseen, part) for part in (left, *parts)]
    return Contributions(
        left=tuple(split[0]),
        parts=tuple(np.array(each) for each in zip(*split[1:], strict=True)),
    )


def _fields(unseen: Unseen) -> Array:
    """Return what each effect adds once the frames are fitted anew, (K, rows), whitened."""
    fields, count = unseen.targets[1:], unseen.frames
    if not count:
        return fields
    columns = unseen.columns.chosen(np.arange(count)).written_out()
    normal = columns @ columns.T + np.diag(unseen.precision[:count])
    step = np.linalg.lstsq(normal, columns @ fields.T, rcond=None)[0]
    return np.asarray(fields - step.T @ columns)


def _metres(unseen: Unseen, rows: Array) -> list[Array]:
    """Return the position part of whitened rows, (M, 3) [m] for every recording."""
    return [part[:, :3] for part in unseen.problem.measured_rows(rows, unseen.scale)]
