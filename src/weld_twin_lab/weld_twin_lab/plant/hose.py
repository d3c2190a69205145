# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A hose package from a hook to the flange, as a rope: it pulls along itself, and it hangs.

The hose goes straight from its hook, fixed to the base, to the flange. Its balancer gives it the
stated tension at the stated length, and a little more where it is drawn out further. Half of the
hose's own weight hangs at the flange.
"""

import numpy as np

from . import exponentials, screws
from .exponentials import Arm
from .textbook_effects import Causes

STRETCH = 0.5
"""Share by which the tension grows when the hose is twice as long: balancers keep it steady."""
WEIGHT = 0.2
"""Weight of half the hose over its tension."""


def pull(causes: Causes, arm: Arm, q: np.ndarray) -> np.ndarray | None:
    """
    Return the pull of the hoses as a wrench on the tool, tool frame, (N, 6) [N, N m], or None.

    causes: entries of hose_pull: hook [m] in the base frame, tension [N], length [m].
    q: shape (N, n).
    """
    hoses = list(causes.of('hose_pull'))
    if not hoses:
        return None
    flange = exponentials.flange(arm, exponentials.home(arm), q)
    force = np.zeros((len(q), 3))
    for item in hoses:
        way = np.asarray(item['hook'], dtype=float) - flange.position
        far = np.linalg.norm(way, axis=1, keepdims=True)
        share = 1.0 + STRETCH * (far / float(item['length']) - 1.0)
        force += float(item['tension']) * share * way / far
        force[:, 2] -= WEIGHT * float(item['tension'])
    tool = screws.compose(flange, arm.tool)
    moment = np.cross(flange.position - tool.position, force)
    return np.hstack([np.einsum('nji,nj->ni', tool.rotation, part) for part in (force, moment)])


def with_hoses(
    causes: Causes, arm: Arm, q: np.ndarray, wrench: np.ndarray | None
) -> np.ndarray | None:
    """Return a wrench on the tool, (N, 6) or None, with what the hoses add to it."""
    more = pull(causes, arm, q)
    if more is None:
        return wrench
    return more if wrench is None else wrench + more
