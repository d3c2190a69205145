# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Is there anything to work on: enough measurements, and something that moves?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...errors import DataError
from .evidence import Case, Finding
from .snapshot import measured

STILL = 1e-5
"""A spread [m, rad] below which nothing moved."""
FEW_STATIONS = 20
"""Stations below which it is told: sixty coordinates for the some thirty of a geometric fit."""


def quantity(case: Case) -> Sequence[Finding]:
    """
    Return a note when there are few stations.

    Raises
    ------
    DataError
        There are fewer numbers than a frame has, or nothing moves.

    """
    problem = case.problem
    frames = 6 * (len(case.recordings) if 'base' in problem.align else 0)
    frames += (6 if max(problem.rows) == 6 else 3) if 'tool' in problem.align else 0
    if problem.size <= frames or sum(problem.samples) < 3:
        raise DataError(
            f'{sum(problem.samples)} measurements give {problem.size} numbers, but the frames to '
            f'align have {frames}; measure more, or align less'
        )
    spread = max(float(np.ptp(q, axis=0).max()) for q in case.motions)
    seen = max(float(np.ptp(measured(r).position, axis=0).max()) for r in case.recordings)
    if spread < STILL:
        raise DataError(
            'the joints do not move in any recording; '
            + (
                'there is nothing to compare'
                if seen < STILL
                else 'the tool does, so these are not its joint states'
            )
        )
    if seen < STILL:
        raise DataError('the joints move, but the measured tool never does; is the topic right?')
    total = sum(problem.samples)
    if problem.at_rest and total < FEW_STATIONS:
        return (Finding('note', f'With {total} stations few causes can be told apart.'),)
    return ()
