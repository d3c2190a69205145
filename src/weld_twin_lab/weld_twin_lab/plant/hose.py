# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A hose package from a hook to the flange, as a rope: it pulls along itself, and it hangs.

The hose goes straight from its hook, fixed to the base, to the flange. It has its stated tension
at its stated length, more where it is stretched, and none where it is slack. Half of its own
weight hangs at the flange, the more so the richer the physics.
"""

import numpy as np

from . import exponentials, screws
from .exponentials import Arm
from .textbook_effects import Causes

STRETCH = 0.5
"""Share by which the tension grows when the hose has to be half as long again: a soft balancer."""
SLACK = 0.05
"""Share of the tension within which a hose goes from slack to taut."""
WEIGHT = 0.2
"""Weight of half the hose over its tension."""


def pull(causes: Causes, arm: Arm, q: np.ndarray, richness: float) -> np.ndarray | None:
    """
    Return the pull of the hoses as a wrench on the tool, tool frame, (N, 6) [N, N m], or None.

    Parameters
    ----------
    causes : Causes
        Entries of hose_pull: hook [m] in the base frame, tension [N], length [m].
    arm : Arm
    q : array, shape (N, n)
    richness : float

    """
    hoses = list(causes.of('hose_pull'))
    if not hoses:
        return None
    flange = exponentials.flange(arm, exponentials.home(arm), q)
    force = np.zeros((len(q), 3))
    for item in hoses:
        way = np.asarray(item['hook'], dtype=float) - flange.position
        far = np.linalg.norm(way, axis=1, keepdims=True)
        share = 1.0 + 2.0 * STRETCH * (far / float(item['length']) - 1.0)
        taut = SLACK * np.logaddexp(0.0, share / SLACK)
        force += float(item['tension']) * taut * way / far
        force[:, 2] -= richness * WEIGHT * float(item['tension'])
    tool = screws.compose(flange, arm.tool)
    moment = np.cross(flange.position - tool.position, force)
    return np.hstack([np.einsum('nji,nj->ni', tool.rotation, part) for part in (force, moment)])


def with_hoses(
    causes: Causes, arm: Arm, q: np.ndarray, wrench: np.ndarray | None, richness: float
) -> np.ndarray | None:
    """Return a wrench on the tool, (N, 6) or None, with what the hoses add to it."""
    more = pull(causes, arm, q, richness)
    if more is None:
        return wrench
    return more if wrench is None else wrench + more
