# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Peers: the same arm in other packages, each in the fastest way its Python interface offers.

A module here has ``make(robot)``, which imports the package and returns a `Peer`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array

MODULES = {
    'pinocchio': 'pinocchio_peer',
    'mujoco': 'mujoco_peer',
}
PACKAGES = {'pinocchio': 'pin', 'mujoco': 'mujoco'}
"""What they are called on PyPI."""


@dataclass(frozen=True)
class Peer:
    """One arm in one package."""

    poses: Callable[[Array], Array]
    """Joint positions (N, n) to poses (N, 4, 4)."""
    screws: Callable[[Array], tuple[Array, Array]] | None = None
    """Joint positions to poses and Jacobians (N, 6, n)."""
    dh: Callable[[Array], tuple[Array, Array]] | None = None
    """Joint positions to poses and derivatives by the DH values, (N, 6, 4 n), of each row by
    theta, d, a, alpha."""
    single: Callable[[Array], Array] | None = None
    """One joint position (n,) to a pose (4, 4)."""
    loops: bool = True
    """A Python loop, so that the time per pose does not depend on how many there are."""


def find_peers(robot: Robot) -> tuple[dict[str, Peer], dict[str, str]]:
    """Return the peers that are installed, and why the others are left out."""
    found, missing = {}, {}
    for name, module in MODULES.items():
        try:
            found[name] = import_module(f'{__name__}.{module}').make(robot)
        except ImportError as error:
            missing[name] = f'not installed (pip install {PACKAGES[name]}): {error}'
    return found, missing
