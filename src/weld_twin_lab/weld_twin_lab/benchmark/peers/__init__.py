# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Peers: the same arm in other packages, each in the fastest way its Python interface offers.

A module here has ``make(robot)``, which imports the package and returns a `Peer`. Both loop in Python.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array

PACKAGES = {'pinocchio': 'pin', 'mujoco': 'mujoco'}
"""What they are called on PyPI."""


@dataclass(frozen=True)
class Peer:
    poses: Callable[[Array], Array]
    """Joint positions (N, n) to poses (N, 4, 4)."""
    screws: Callable[[Array], tuple[Array, Array]]
    """Joint positions to poses and Jacobians (N, 6, n)."""
    single: Callable[[Array], Array]
    """One joint position (n,) to a pose (4, 4)."""
    dh: Callable[[Array], tuple[Array, Array]] | None = None
    """Joint positions to poses and derivatives by the DH values, (N, 6, 4 n), of each row by
    theta, d, a, alpha."""


def find_peers(robot: Robot) -> tuple[dict[str, Peer], dict[str, str]]:
    peers, missing = {}, {}
    for name, package in PACKAGES.items():
        try:
            peers[name] = import_module(f'{__name__}.{name}_peer').make(robot)
        except ImportError as error:
            missing[name] = f'not installed (pip install {package}): {error}'
    return peers, missing
