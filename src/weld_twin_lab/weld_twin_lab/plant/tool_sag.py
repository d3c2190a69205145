# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A torch that bends its bracket: a bar on a ball joint with springs, which hangs where they hold it."""

import numpy as np
from scipy.spatial.transform import Rotation

from . import exponentials, screws
from .flaws import Here, flaw
from .plant_recording import Entry

FLAT = 0.4
"""Share by which a bracket of sheet metal bends less about its second axis."""
ROUNDS = 3
"""Times that the balance is sought anew; the bar turns by a milliradian, so two would do."""


@flaw('tool')
def tool_sag(entry: Entry, here: Here) -> np.ndarray:
    """
    Return how the torch has turned about its bracket, and its tip with it.

    bend: way of the tip [m] where the torch is level.
    lever: from the bracket to the tip, in the tool frame, shape (3,) [m].
    """
    lever = np.asarray(entry['lever'], dtype=float)
    length = np.linalg.norm(lever)
    soft = float(entry['bend']) / length * np.array([1.0, 1.0 - FLAT * here.richness, 1.0])
    flange = exponentials.flange(here.arm, exponentials.home(here.arm), here.q)
    weight = -screws.compose(flange, here.arm.tool).rotation[..., 2, :]
    turn = np.zeros((len(here.q), 3))
    for _ in range(ROUNDS):
        bar = Rotation.from_rotvec(turn).apply(lever)
        turn = soft * np.cross(bar / length, weight)
    return np.hstack([Rotation.from_rotvec(turn).apply(lever) - lever, turn])
