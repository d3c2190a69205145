# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a joint stands at a reading, and what its zero has to become: the one place that says so."""

from __future__ import annotations

import numpy as np

TURNED_ROUND = (
    'X is the recorded reading with its sign turned round: a controller that shows the joint as '
    'it was recorded needs the opposite sign in all of this.'
)
"""What a person has to know of a joint whose readings were recorded with the other sign."""


def further(offset: float, *, sliding: bool = False) -> str:
    """
    Return how much further than its reading a joint stands, to follow the reading in a sum.

    Parameters
    ----------
    offset : float [rad or m]
        The joint stands at reading + offset.
    sliding : bool
        Whether the joint slides; its offset is then in metres.

    Returns
    -------
    str
        Such as ``+ 0.0456 deg``: a sign, a blank, a number and its unit.

    """
    places, unit = (3, 'mm') if sliding else (4, 'deg')
    shown = offset * 1e3 if sliding else float(np.degrees(offset))
    return f'{"-" if shown < 0.0 else "+"} {abs(shown):.{places}f} {unit}'


def stands(joint: str, offset: float, *, sliding: bool = False) -> str:
    """Return where a joint stands at any reading, as a sentence; see `further`."""
    return f'At reading X {joint} stands at X {further(offset, sliding=sliding)}.'


def to_mend(offset: float, *, sliding: bool = False) -> str:
    """Return what mends a zero, by the readings before and after; see `further`."""
    return (
        'To mend: set its zero anew so that, with the joint left where it is, the reading X '
        f'becomes X {further(offset, sliding=sliding)}.'
    )
