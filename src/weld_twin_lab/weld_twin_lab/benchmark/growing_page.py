# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""All pieces of work at all sizes: a picture, and a table of what twice as much costs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.markdown import table
from weld_twin_nodes.offline.environment import THREADS

from .growing import KINDS

Points = Sequence[Mapping[str, float]]
MB = 1e6
"""Bytes; what memory is told in."""
MANY = 1e5
"""Sizes up to this span so many decades that they are drawn by their logarithm."""


def measured(
    only: Sequence[str], tell: Callable[[str], None]
) -> dict[str, list[dict[str, float]]]:
    """
    Return what every size of every piece of work costs.

    Parameters
    ----------
    only : sequence of str
        Parts of names; empty for all.
    tell : callable
        Told what has been measured.

    Raises
    ------
    DataError
        Nothing is called so, or a piece of work fails.

    """
    names = [name for name in KINDS if not only or any(part in name for part in only)]
    if not names:
        raise DataError(f'nothing is called {", ".join(only)}; there are {", ".join(KINDS)}')
    out: dict[str, list[dict[str, float]]] = {}
    for name in names:
        out[name] = [_point(name, size) for size in KINDS[name][1]]
        tell(f'{name}: ' + ', '.join(f'{point["seconds"]:.3g} s' for point in out[name]))
    return out


def _point(name: str, size: float) -> dict[str, float]:
    words = [sys.executable, '-m', f'{__package__}.growing', name, str(size)]
    one = {**os.environ, **dict.fromkeys(THREADS, '1')}
    done = subprocess.run(words, env=one, capture_output=True, text=True, check=False)
    if done.returncode:
        reason = done.stderr.strip().splitlines() or ['no reason given']
        raise DataError(f'{name} of {size:g} ended with {done.returncode}: {reason[-1]}')
    said: dict[str, float] = json.loads(done.stdout)
    return said


def twice(points: Points, key: str) -> float:
    """Return by what twice the largest size would multiply a cost: a line through the last three."""
    size, spent = (np.log([point[name] for point in points[-3:]]) for name in ('size', key))
    return float(2.0 ** np.polyfit(size, spent, 1)[0])


def page(found: Mapping[str, Points]) -> str:
    """Return the table in Markdown."""
    rows: list[Sequence[object]] = [
        ('what grows', 'from', 'to', 'processor [s]', 'memory [MB]')
        + ('twice as much takes, of the time', 'of the memory')
    ]
    for name, points in found.items():
        ends = points[0], points[-1]
        rows.append(
            (
                name,
                *(f'{end["size"]:,.4g}' for end in ends),
                ' to '.join(f'{end["seconds"]:.3g}' for end in ends),
                ' to '.join(f'{end["bytes"] / MB:.0f}' for end in ends),
                f'{twice(points, "seconds"):.2f}',
                f'{twice(points, "bytes"):.2f}',
            )
        )
    return table(*rows)


def draw(found: Mapping[str, Points], path: Path) -> None:
    """Draw seconds and memory over size, a frame for everything that grows."""
    import matplotlib

    matplotlib.use('Agg')
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    across = 4
    down = -(-len(found) // across)
    figure = Figure(figsize=(3.4 * across, 2.9 * down), layout='constrained', dpi=110)
    frames = list(figure.subplots(down, across, squeeze=False).flat)
    for frame in frames[len(found) :]:
        frame.remove()
    for axes, (name, points) in zip(frames, found.items(), strict=False):
        size = [point['size'] for point in points]
        axes.plot(size, [p['seconds'] for p in points], 'o-', ms=4, color='C0')
        other = axes.twinx()
        other.plot(size, [p['bytes'] / MB for p in points], 's--', ms=4, color='C1')
        axes.set(xlabel=name)
        other.set_ylim(0.0, 1.1 * other.get_ylim()[1])
        if max(size) >= MANY:
            axes.set(xscale='log', yscale='log')
        else:
            axes.set_ylim(0.0, 1.1 * axes.get_ylim()[1])
        axes.grid(alpha=0.3)
    lines = (
        Line2D([], [], color='C0', marker='o'),
        Line2D([], [], color='C1', ls='--', marker='s'),
    )
    names = ('processor time [s], left', 'memory [MB], right')
    figure.legend(lines, names, loc='outside upper center', ncols=2, frameon=False)
    figure.savefig(path)
