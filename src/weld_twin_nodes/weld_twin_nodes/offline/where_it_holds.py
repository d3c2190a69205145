# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a corrected model holds, in sentences for its files, the page and the terminal."""

from __future__ import annotations

from weld_twin_core.twin.posterior import Posterior


def where_it_holds(posterior: Posterior) -> list[str]:
    """Return how far a model can be relied on, what was left open, and where it was measured."""
    recorded, anywhere = (
        f'{v * 1e3:.2g} mm' for v in (posterior.recorded_m, posterior.anywhere_m)
    )
    out = [
        f'Corrected, the robot is right within {recorded} where it was measured, but only within '
        f'{anywhere} elsewhere in its reach (one standard deviation each).'
        if anywhere != recorded
        else f'Corrected, the robot is right within {recorded} (one standard deviation).'
    ]
    out += left_open(posterior)
    return [*out, 'Measured at ' + '; '.join(posterior.domain.sentences()) + '.']


def left_open(posterior: Posterior) -> list[str]:
    """Return the directions that the recordings left open, in one sentence or none."""
    if not posterior.left_open:
        return []
    count = len(posterior.left_open)
    named = 'direction of the frames is' if count == 1 else 'directions of the frames are'
    return [
        f'{count} {named} left open by the recordings, and as given as far as the data bear that: '
        f'{"; ".join(posterior.left_open)}.'
    ]
