# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Control charts: a value over time beside what is usual for this cell.

Usual is what its own first diagnoses were: their median, and three times their scatter from one to
the next, as the chart of individuals has it [1]_.

References
----------
.. [1] W. A. Shewhart, "Economic Control of Quality of Manufactured Product", 1931; ISO 7870-2:2013.

"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from weld_twin_core.arrays import Array

from ..report.charts import Axis, Line, chart
from ..report.html import Html

FIRST = 12
"""Diagnoses that a baseline is made of, if nothing changed among them: a quarter of weeks."""
FEWEST = 3
"""Diagnoses without which there is no baseline."""
LIMIT = 3.0
"""Standard deviations from the baseline to a control limit, as ever."""
MARKED = 60
"""Diagnoses up to which each has its dot; more of them run into one another."""
MOVING = 0.6745 * np.sqrt(2.0)
"""Median distance of two normal draws, in standard deviations."""


class Baseline(NamedTuple):
    """What is usual: the middle, and the control limits on both sides."""

    middle: float
    low: float
    high: float


def baseline(values: Array, before: int | None = None) -> Baseline | None:
    """
    Return what is usual of a value; None where there are too few.

    ``values`` (shape (N,)): in the order of time; what is not finite does not count. ``before``:
    number of diagnoses before the first change.
    """
    first = values[: min(FIRST, values.size if before is None else before)]
    first = first[np.isfinite(first)]
    if first.size < FEWEST:
        return None
    middle = float(np.median(first))
    sigma = float(np.median(np.abs(np.diff(first)))) / MOVING
    return Baseline(middle, middle - LIMIT * sigma, middle + LIMIT * sigma)


def control_chart(
    title: str,
    seconds: Array,  # shape (N,), since 1970, ascending
    values: Array,  # shape (N,)
    axis: Axis,  # what the values are
    *,
    before: int | None = None,  # number of diagnoses before the first change
    from_zero: bool = False,
) -> Html:
    """Return a chart of values over dates, with the baseline and its limits."""
    usual = baseline(values, before)
    lines = [Line(axis.label, values, marked=values.size <= MARKED)]
    band = None
    if usual is not None:
        every = np.ones(values.size)
        lines.append(Line('baseline', usual.middle * every, 'soft', dashed=True))
        low = max(usual.low, 0.0) if from_zero else usual.low
        band = (low * every, usual.high * every)
    axes = (Axis('recorded'), axis)
    return chart(
        title, seconds, lines, axes, key='history', band=band, dates=True, from_zero=from_zero
    )
