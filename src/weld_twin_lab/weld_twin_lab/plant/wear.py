# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A tip that wears fast while it is sharp."""

import numpy as np

from .flaws import Here, flaw
from .plant_recording import Entry


@flaw('tool')
def wear(entry: Entry, here: Here) -> np.ndarray:
    """
    Return the tool's tip as wear has drawn it back along its z.

    The rate is that of the first second, and falls off with the time constant `slower` [s].
    """
    back, slower = np.zeros((len(here.t), 6)), float(entry.get('slower', 1e6))
    back[:, 2] = float(entry['rate']) * slower * np.expm1(-here.t / slower)
    return back
