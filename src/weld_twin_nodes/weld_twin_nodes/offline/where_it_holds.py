# SPDX-FileCopyrightText: weld_twin contributors
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
        f'This model holds within {recorded} (one standard deviation) where it was measured, within '
        f'{anywhere} elsewhere in its reach.'
    ]
    out += left_open(posterior)
    return [*out, 'Measured at ' + '; '.join(posterior.domain.sentences()) + '.']


def left_open(posterior: Posterior) -> list[str]:
    """Return the directions that the recordings left open, in one sentence or none."""
    if not posterior.left_open:
        return []
    many = 'directions are' if len(posterior.left_open) > 1 else 'direction is'
    return [
        f'{len(posterior.left_open)} {many} left open by the recordings and as it was given, or '
        f'nearly: {"; ".join(posterior.left_open)}.'
    ]
