# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How every figure looks: size, colours, axes, and the files it becomes."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_msgs_py.files.csv_text import csv_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Table = Mapping[str, Array]
"""Columns of one length; their names carry the unit."""
COLOURS = ('#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9', '#666666', '#000000')
"""Okabe and Ito's, which people with any colour vision tell apart."""
WIDTH = 9.0
"""Width of a figure [inch]."""
_STYLE: dict[Any, Any] = {  # matplotlib types its settings key by key
    'font.size': 9.0,
    'axes.spines.top': False,
    'axes.spines.right': False,
    'axes.grid': True,
    'grid.color': '#e3e6ea',
    'grid.linewidth': 0.6,
    'axes.axisbelow': True,
    'legend.frameon': False,
    'legend.fontsize': 8.0,
    'lines.linewidth': 1.6,
    'svg.fonttype': 'path',
    'svg.hashsalt': 'weld_twin',
    'axes.formatter.useoffset': False,
}


@dataclass(frozen=True)
class Drawing:
    """A figure: its table, its picture as SVG text, and the sentence under it."""

    name: str
    caption: str
    table: Table
    svg: str

    @property
    def csv(self) -> str:
        """Return the table as CSV; floats read back exactly."""
        columns = (np.asarray(c).tolist() for c in self.table.values())
        return csv_text(list(self.table), zip(*columns, strict=True))


def panels(count: int, height: float = 3.1, **options: Any) -> tuple[Figure, Sequence[Axes]]:
    """Return a figure with panels side by side."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(_STYLE):
        figure = Figure(figsize=(WIDTH, height), layout='constrained')
        axes = figure.subplots(1, count, squeeze=False, **options)[0]
    return figure, axes


def label(axes: Axes, title: str, x: str, y: str) -> None:
    axes.set_title(title, loc='left', fontsize=9.5)
    axes.set_xlabel(x)
    axes.set_ylabel(y)


def legend(axes: Axes, **options: Any) -> None:
    """Add a legend in the style of the figures."""
    from matplotlib import rc_context

    with rc_context(_STYLE):
        axes.legend(**options)


def from_zero(axes: Axes, headroom: float = 1.12) -> None:
    """Start the vertical axis at zero and leave room above what is drawn."""
    top = max(float(np.max(line.get_ydata())) for line in axes.get_lines())
    axes.set_ylim(0.0, headroom * top if top > 0.0 else None)


def plain_powers(axes: Axes) -> None:
    """Write the powers of a vertical axis as plain numbers; formulas take as long as a figure."""
    axes.yaxis.set_major_formatter(lambda value, _: f'{value:g}')


def svg(figure: Figure) -> str:
    """Return the picture; equal data give equal text."""
    from matplotlib import rc_context

    out = io.StringIO()
    engine = figure.get_layout_engine()
    with rc_context(_STYLE):
        # Laid out here, the figure is drawn once; left to matplotlib, once more before, for nothing.
        if engine is not None:
            engine.execute(figure)
            figure.set_layout_engine(None)
        figure.savefig(out, format='svg', metadata={'Date': None, 'Creator': None})
    text = out.getvalue()
    return text[text.index('<svg') :]
