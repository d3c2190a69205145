# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Were the joint positions measured, or are they what was commanded?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array
from ...recording import JointMotion
from ..algebra.independent_rows import NORMAL
from .evidence import Case, Finding

SMOOTH = 2e-8
"""Noise of a joint position [rad, m] below which no encoder has seen it."""
ENOUGH = 50
"""Samples below which noise of an encoder cannot be measured."""


def source(case: Case) -> Sequence[Finding]:
    """Return a note when moving joint positions carry no trace of an encoder."""
    names = [r.name for r in case.recordings if _commanded(r.joints)]
    if not names:
        return ()
    return (
        Finding(
            'note',
            f'The joint positions of {", ".join(names)} are as smooth as a command: what the '
            'drives make of it (lag, following error) is then part of the gap.',
        ),
    )


def _commanded(joints: JointMotion) -> bool:
    if joints.static or joints.t.size < ENOUGH:
        return False
    noise = _noise(joints.q)
    moving = np.ptp(joints.q, axis=0) > 1e-3
    return bool(moving.any() and noise[moving].max() < SMOOTH)


def _noise(q: Array) -> Array:
    """Return the noise of every joint from its fifth differences, which a smooth path has not."""
    fifth = np.diff(q, n=5, axis=0)
    return np.asarray(NORMAL * np.median(np.abs(fifth), axis=0) / np.sqrt(252.0))
