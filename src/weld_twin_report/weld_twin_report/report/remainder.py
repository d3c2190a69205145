# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What of the squared gap the causes leave, and how finely shares are told."""

from __future__ import annotations

from typing import Any

import numpy as np

from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_nodes.wording.quantities import fine

from .page_data import squares

SEEN = 5e-4
"""Share of the squared gap below which a row would read 0.0 %."""


def remainder(diagnosis: Diagnosis) -> tuple[tuple[str, float], ...]:
    """
    Return what the causes do not hold: what has no name, what is not explained, what is noise.

    What is fitted but not sure enough to be named explains its part, and has no cause to stand on.
    """
    rest = diagnosis.shares
    if any(cause.rest for cause in diagnosis.causes):
        # What is left has a row of its own, with the place where most of it is.
        return (('noise', rest.noise),)
    remaining = max(_left(diagnosis) - rest.noise, 0.0)
    unnamed = rest.unexplained - remaining
    # What has a place and no name is not explained by that.
    named = bool(diagnosis.effects or diagnosis.families or not diagnosis.causes)
    rows = [('not explained' if named else 'not placed', rest.unexplained), ('noise', rest.noise)]
    if unnamed >= _SPLIT:
        rows[:1] = [('fitted, but not to be named', unnamed), ('not explained', remaining)]
    return tuple(rows)


_SPLIT = 0.02
"""Share from which what is fitted without a name has a row of its own."""


def _left(diagnosis: Diagnosis) -> float:
    """Return what of the squared gap is left with everything that was fitted."""
    products: Any = np.array(squares(diagnosis))
    whole = float(products.sum())
    return float(products[0, 0]) / whole if whole > 0.0 else 1.0


def places(diagnosis: Diagnosis) -> int:
    """Return the decimals of every share of a page: one where any interval needs it, or none."""
    return int(any(fine(*cause.share_ci90) for cause in diagnosis.causes if cause.share >= SEEN))
