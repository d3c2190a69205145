# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Reliability and risk over coverage, before and after, as pictures that take a page's colours."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arrays import Array

from ..blind.statistics import reliability
from .told import Belief, risk_curve

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BEFORE, AFTER, GREY = '#d98a2b', '#3b82c4', '#8d98a6'
PAPER = '#ffffff'


def reliability_picture(belief: Belief) -> str:
    """
    Return the share that was right over what was believed, as SVG.

    Parameters
    ----------
    belief : Belief

    """
    figure, axes = _figure()
    axes.plot([0, 1], [0, 1], color=GREY, lw=1, ls='--')
    for told, colour, label, off in (
        (belief.before, BEFORE, 'set by hand', -0.006),
        (belief.after, AFTER, 'learned', 0.006),
    ):
        _bins(axes, told, belief.right, colour, label, off)
    axes.legend(frameon=False, fontsize=8)
    axes.set(xlim=(0, 1.03), ylim=(0, 1.03), xlabel='believed', ylabel='share that was right')
    return _svg(figure)


def _bins(
    axes: Axes, told: Array, right: NDArray[np.bool_], colour: str, label: str | None, off: float
) -> None:
    for b in reliability(list(told), list(map(bool, right))):
        value, low, high, count = b.right
        if value is None or low is None or high is None:
            continue
        axes.plot([b.confidence + off] * 2, [low, high], color=colour, lw=1.3)
        size = 3.0 + 0.9 * float(np.sqrt(count))
        axes.plot(b.confidence + off, value, 'o', color=colour, ms=size, label=label)
        label = None


def risk_picture(belief: Belief) -> str:
    """
    Return the share wrong among the surest, over how many are looked at, as SVG.

    Parameters
    ----------
    belief : Belief

    """
    figure, axes = _figure()
    for told, colour, label in (
        (belief.before, BEFORE, 'set by hand'),
        (belief.after, AFTER, 'learned'),
    ):
        coverage, risk = risk_curve(told, belief.right)
        axes.plot(100.0 * coverage, 100.0 * risk, color=colour, lw=1.5, label=label)
    axes.axvline(70.0, color=GREY, lw=1, ls='--')
    axes.legend(frameon=False, fontsize=8)
    axes.set(
        xlim=(0, 100),
        ylim=(0, None),
        xlabel='cases answered, the surest first [%]',
        ylabel='of them wrong [%]',
    )
    return _svg(figure)


def _figure() -> tuple[Figure, Any]:
    from matplotlib.figure import Figure

    figure = Figure((4.6, 3.6), layout='constrained', facecolor=PAPER)
    axes = figure.add_subplot()
    axes.tick_params(labelsize=8)
    for side in ('top', 'right'):
        axes.spines[side].set_visible(False)
    return figure, axes


def _svg(figure: Figure) -> str:
    import matplotlib

    stream = io.StringIO()
    with matplotlib.rc_context({'svg.hashsalt': 'belief', 'svg.fonttype': 'none'}):
        figure.savefig(stream, format='svg', metadata={'Date': None})
    return stream.getvalue()
