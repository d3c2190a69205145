# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The pictures of the score page, as SVG that takes the page's colours."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from weld_twin_report.report.html import Html

from .achieved import Achieved
from .judging import Judged
from .measures import BINS
from .statistics import reliability

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK = '#010203'
"""Stands for the page's own text colour."""
BLUE, ORANGE, RED, GREY = '#3b82c4', '#d98a2b', '#c8483d', '#8d98a6'
OUTCOMES = {'exact': BLUE, 'partial': ORANGE, 'silent': GREY, 'wrong': RED}


def reliability_plot(cases: Sequence[Judged]) -> Html:
    """Return how often a verdict was right, over how sure it was."""
    told = [c for c in cases if c.status != 'error']
    figure, axes = _figure(4.2, 3.6)
    axes.plot([0, 1], [0, 1], color=GREY, lw=1, ls='--')
    for b in reliability([c.confidence for c in told], [c.right for c in told]):
        value, low, high, count = b.right
        if value is None or low is None or high is None:
            continue
        axes.plot([b.confidence] * 2, [low, high], color=BLUE, lw=1.5)
        axes.plot(b.confidence, value, 'o', color=BLUE, ms=3.0 + 1.2 * np.sqrt(count))
        axes.annotate(
            f'{count}',
            (b.confidence, value),
            (8, -9),
            textcoords='offset points',
            color=INK,
            fontsize=8,
            ha='right',
        )
    axes.set(xlim=(0, 1.02), ylim=(0, 1.02), xlabel='confidence', ylabel='share that was right')
    return _svg(figure, 'Reliability: share of right verdicts over their confidence')


def shrink_plot(shrinks: Sequence[Achieved]) -> Html:
    """Return the shrink achieved on sealed recordings over the shrink claimed."""
    figure, axes = _figure(4.2, 3.6)
    axes.plot([0.01, 1.1], [0.01, 1.1], color=GREY, lw=1, ls='--')
    for test, colour in (('same motion', BLUE), ('new motion', ORANGE)):
        pairs = np.array([(s.claimed, s.ratio) for s in shrinks if s.test == test])
        if pairs.size:
            axes.plot(*pairs.T, 'o', color=colour, ms=4, alpha=0.8, label=test)
    if shrinks:
        axes.legend(frameon=False, labelcolor=INK, fontsize=8)
    axes.set(xscale='log', yscale='log', xlabel='claimed RMS after / before', ylabel='achieved')
    return _svg(figure, 'Shrink achieved on the sealed recording over the shrink claimed')


def outcome_plot(cases: Sequence[Judged]) -> Html:
    """Return the outcomes of cases with causes in the library, by size of the weakest cause."""
    figure, axes = _figure(4.2, 3.6)
    known = [c for c in cases if c.in_library]
    bottom = np.zeros(len(BINS))
    for outcome, colour in OUTCOMES.items():
        height = np.array(
            [
                sum(low <= c.stratum < high and c.set == outcome for c in known)
                for low, high, _ in BINS
            ]
        )
        axes.bar([label for *_, label in BINS], height, 0.7, bottom, color=colour, label=outcome)
        bottom += height
    axes.legend(frameon=False, labelcolor=INK, fontsize=8)
    axes.set(xlabel='effect RMS over noise, of the weakest cause', ylabel='cases')
    return _svg(figure, 'Outcomes by effect size')


def error_plot(cases: Sequence[Judged]) -> Html:
    """Return the errors of parameters in their standard errors, against the normal law."""
    z = np.array([value for case in cases for value in case.z])
    figure, axes = _figure(4.2, 3.6)
    x = np.linspace(-5.0, 5.0, 201)
    axes.plot(x, np.exp(-0.5 * x * x) / np.sqrt(2.0 * np.pi), color=ORANGE, lw=1.5)
    if z.size:
        edges = np.linspace(-5.0, 5.0, 41).tolist()
        axes.hist(np.clip(z, -5.0, 5.0), edges, density=True, color=BLUE)
    axes.set(xlabel='error of a parameter over its standard error', ylabel='density')
    return _svg(figure, 'Parameter errors in standard errors; the ends hold all beyond')


def _figure(width: float, height: float) -> tuple[Figure, Axes]:
    from matplotlib.figure import Figure

    figure = Figure((width, height), layout='constrained')
    axes = figure.add_subplot()
    axes.patch.set_alpha(0.0)
    axes.tick_params(colors=INK, labelsize=8)
    for side in ('top', 'right'):
        axes.spines[side].set_visible(False)
    for side in ('left', 'bottom'):
        axes.spines[side].set_color(INK)
    axes.xaxis.label.set_color(INK)
    axes.yaxis.label.set_color(INK)
    return figure, axes


def _svg(figure: Figure, title: str) -> Html:
    import matplotlib

    stream = io.StringIO()
    with matplotlib.rc_context({'svg.hashsalt': title, 'svg.fonttype': 'none'}):
        figure.savefig(stream, format='svg', transparent=True, metadata={'Date': None})
    text = stream.getvalue()
    picture = text[text.index('<svg') :].replace(INK, 'currentColor')
    return Html(picture.replace('<svg', f'<svg role="img" aria-label="{title}"', 1))
