# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Motions that say little: small ones, joints at rest, one joint alone, few stations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .blind_cell import Take

WAYS = ('small', 'still', 'few', 'one')
"""How a motion is made poor."""


def poorer(taken: Take, poor: str, rng: np.random.Generator) -> Take:
    """
    Return the run with less motion.

    poor: one of `WAYS`, or empty for the run as it is: 'small' moves all joints little, 'still'
    holds some of them, 'one' moves one alone, 'few' keeps few of the stations.
    """
    q, command = taken.command.q.copy(), taken.command
    middle = np.median(q, axis=0)
    if poor == 'small':
        q = middle + float(rng.choice([0.02, 0.1, 0.3])) * (q - middle)
    elif poor == 'still':
        still = rng.choice(q.shape[1], int(rng.integers(1, q.shape[1] - 1)), replace=False)
        q[:, still] = middle[still]
    elif poor == 'one':
        moving = int(rng.integers(q.shape[1]))
        q = np.where(np.arange(q.shape[1]) == moving, q, middle)
    elif poor == 'few' and command.static:
        count = int(rng.integers(15, 40))
        wrench = None if command.wrench is None else command.wrench[:count]
        warm = None if command.temperature is None else command.temperature[:count]
        return taken._replace(
            command=replace(
                command, t=command.t[:count], q=q[:count], wrench=wrench, temperature=warm
            )
        )
    return taken._replace(command=replace(command, q=q))
