# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What an experiment may cost, and where it has to stay."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...errors import DataError

USUAL_MINUTES = 60.0
"""Of robot motion that an experiment takes at most, unless told: an arm warms up in an hour."""


@dataclass(frozen=True, eq=False)
class Limits:
    """
    What an experiment may cost, and where it has to stay.

    Attributes
    ----------
    minutes : float [min]
        Of robot motion and of what has to be set up for it, at most.
    moving : float [min]
        Of robot motion alone, at most.
    set_up : bool
        Whether something in the cell may be changed for it: another tool, a moved instrument.
    box : array, shape (2, 3), optional [m]
        Corners in the measuring frame that the arm stays between.
    confirm : bool
        Whether one is asked for where the question is closed, but some joints did not move widely:
        what depends on their angle looks like something else.

    Raises
    ------
    DataError
        The minutes are not positive, or a box has no room.

    """

    minutes: float = USUAL_MINUTES
    moving: float = np.inf
    set_up: bool = True
    box: Array | None = None
    confirm: bool = False

    def __post_init__(self) -> None:
        least = min(self.minutes, self.moving)
        if not least > 0.0:
            raise DataError(f'an experiment needs minutes, got {least:g}')
        if self.box is None:
            return
        box = np.array(self.box, dtype=float)
        if box.shape != (2, 3) or not (box[0] < box[1]).all():
            raise DataError('the box of the cell is two corners, the lower one first, in metres')
        object.__setattr__(self, 'box', box)
