# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of a seam that was welded twice: as it is, and with the loop closed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from weld_twin_core.arrays import Array

from ..report.charts import Axis, Line, chart
from ..report.html import Html, document, main, section, table, tag

WAYS = {
    'goals': 'as a goal of a trajectory controller, with the correction of play',
    'poses': 'as a stream of poses, for control_msgs is not installed here. Play of an arm would not be '
    'corrected in poses, which do not tell where a joint will turn around',
}
"""How the seam was corrected, in words."""
SHOWN = 600
"""Points of a line."""
AXES = 'xyz'


@dataclass(frozen=True, eq=False)
class Seam:
    """One run along a seam."""

    meant: Array
    real: Array
    """Shape (N, 3) [m]: where the tool was to be, and where it was measured."""

    @cached_property
    def off(self) -> Array:
        """Return the distance of the tool from where it was to be, shape (N,) [m]."""
        return np.asarray(np.linalg.norm(self.real - self.meant, axis=1))

    @cached_property
    def way(self) -> Array:
        """Return the way along the seam, shape (N,) [m]."""
        steps = np.linalg.norm(np.diff(self.meant, axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def rms(self) -> float:
        """Return the RMS distance [m]."""
        return float(np.sqrt((self.off**2).mean()))

    @property
    def worst(self) -> float:
        """Return the largest distance [m]."""
        return float(self.off.max())


def closed_loop_page(robot: str, seams: tuple[Seam, Seam], how: str, noise: float) -> str:
    """
    Return the page.

    ``seams``: as it is, and corrected. ``how``: a key of `WAYS`. ``noise`` [m]: RMS distance
    that measuring alone makes.
    """
    before, after = seams
    head = (
        f'The same seam on the same arm: {before.rms * 1e3:.3f} mm off as it is, '
        f'{after.rms * 1e3:.3f} mm through the compensator (RMS).'
    )
    how_done = (
        'The error injector stands in for the arm. The diagnosis of its first run is the model. '
        f'The seam was corrected {WAYS[how]}. The noise of the measurement alone is '
        f'{noise * 1e3:.3f} mm.'
    )
    lead = 'How far the measured tool is from where it was to be. Both runs have one scale.'
    body = main(
        ('Closed loop', ''),
        robot,
        head,
        _figures(before, after),
        section('Along the seam', *_charts(before, after), id_='seam', lead=lead),
        section('How it was done', tag('p', how_done), id_='how'),
    )
    return document(f'Closed loop · {robot}', body, charts=True)


def _figures(before: Seam, after: Seam) -> Html:
    rows = [
        (name, f'{one.rms * 1e3:.3f}', f'{one.worst * 1e3:.3f}')
        for name, one in (('as it is', before), ('corrected', after))
    ]
    return table(('run', 'RMS, mm', 'at worst, mm'), rows)


def _charts(before: Seam, after: Seam) -> list[Html]:
    """Return the distance along the seam of both runs, and their parts along the axes."""
    x = np.linspace(0.0, min(before.way[-1], after.way[-1]), SHOWN)

    def drawn(title: str, across: str, parts: list[Array], height: int, from_zero: bool) -> Html:
        lines = [
            Line(name, np.interp(x, one.way, part) * 1e3, colour)
            for one, part, name, colour in zip(
                (before, after), parts, ('as it is', 'corrected'), ('before', 'after'), strict=True
            )
        ]
        axes = (Axis('way along the seam', 'mm'), Axis(across, 'mm'))
        return chart(title, x * 1e3, lines, axes, key='seam', from_zero=from_zero, height=height)

    off = [one.real - one.meant for one in (before, after)]
    return [
        drawn('Distance from the seam', 'distance', [before.off, after.off], 240, True),
        *(
            drawn(f'Part along {name}', name, [part[:, k] for part in off], 120, False)
            for k, name in enumerate(AXES)
        ),
    ]
