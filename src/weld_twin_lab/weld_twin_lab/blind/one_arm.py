# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A case recorded more than once: what its causes are must not hang on the recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.features import Features
from weld_twin_core.twin.twin import Twin

from ..plant.outside_causes import FLANK_TORQUE
from .making import SealedCase

NO_LOAD = 1e-6
"""Load [N m, N] below which it is that of rounding."""


def one_arm(case: SealedCase) -> SealedCase:
    """
    Return the case with what friction holds in a gear the same in every recording.

    The plant has it as a share of a recording's largest load where it is not given. Where there is no
    load at all, rounding would decide on which flank the gear lies.

    Raises DataError: a joint with such play carries nothing.
    """
    robot, command = case.cell.robot, case.train.command
    moved = Recording('first', JointMotion(command.t, command.q, static=command.static))
    shift = Features(Twin(robot), moved, command.t).view.shift
    causes = []
    for cause in case.causes:
        if cause['effect'] == 'loaded_play':
            most = float(np.abs(shift['tau', robot.index(str(cause['joint']))]).max())
            if most < NO_LOAD:
                raise DataError(f'{cause["joint"]} carries nothing, so no load moves its play')
            cause = {**cause, 'torque': FLANK_TORQUE * most}
        causes.append(cause)
    return replace(case, causes=causes)
