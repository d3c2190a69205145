# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Reliability and risk over coverage as pictures that take a page's colours."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arrays import Array

from ..blind.statistics import reliability

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS, GREY = ('#3b82c4', '#d98a2b'), '#8d98a6'
PAPER = '#ffffff'


Told = Mapping[str, tuple[Array, NDArray[np.bool_]]]
"""What was told of statements of a kind, and which were right."""


def reliability_picture(told: Told) -> str:
    """
    Return the share that was right over what was told, as SVG.

    Parameters
    ----------
    told : mapping from str to (array, array of bool)
        At most two kinds.

    """
    figure, axes = _figure()
    axes.plot([0, 1], [0, 1], color=GREY, lw=1, ls='--')
    for (label, (p, right)), colour, off in zip(
        told.items(), COLOURS, (-0.006, 0.006), strict=False
    ):
        _bins(axes, p, right, colour, label, off)
    axes.legend(frameon=False, fontsize=8)
    axes.set(xlim=(0, 1.03), ylim=(0, 1.03), xlabel='told', ylabel='share that was right')
    return _svg(figure)


def _bins(
    axes: Axes, told: Array, right: NDArray[np.bool_], colour: str, label: str | None, off: float
) -> None:
    for b in reliability(list(told), list(map(bool, right))):
        value, low, high, count = b.right
        if value is None or low is None or high is None:
            continue
        axes.plot([b.confidence + off] * 2, [low, high], color=colour, lw=1.3)
        size = 3.0 + 0.15 * float(np.sqrt(count))
        axes.plot(b.confidence + off, value, 'o', color=colour, ms=size, label=label)
        label = None


def risk_picture(told: Told) -> str:
    """
    Return the share wrong among the surest, over how many are looked at, as SVG.

    Parameters
    ----------
    told : mapping from str to (array, array of bool)
        At most two kinds.

    """
    figure, axes = _figure()
    for (label, (p, right)), colour in zip(told.items(), COLOURS, strict=False):
        order = np.argsort(-p, kind='stable')
        count = np.arange(1, p.size + 1)
        coverage, risk = count / p.size, np.cumsum(~right[order]) / count
        axes.plot(100.0 * coverage, 100.0 * risk, color=colour, lw=1.5, label=label)
    axes.axvline(70.0, color=GREY, lw=1, ls='--')
    axes.legend(frameon=False, fontsize=8)
    axes.set(
        xlim=(0, 100),
        ylim=(0, None),
        xlabel='statements, the surest first [%]',
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
