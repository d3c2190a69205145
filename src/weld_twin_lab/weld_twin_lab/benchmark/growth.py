# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How the cost grows with the number of poses, of joints, of parameters and with the bag."""

from __future__ import annotations

from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from weld_twin_core.arm.bulk import BulkKernel
from weld_twin_core.arm.robot import Robot

from .arms import arm_of, calibrated_arm, random_positions
from .processes import bag

ROUNDS = 7
"""Timings of which the least counts."""
COUNTS = (10, 30, 100, 300, 1000, 3000, 10_000, 30_000, 100_000, 300_000)
"""Poses at once."""
JOINTS = tuple(range(2, 13))
"""Joints of the arm."""
MANY = 20_000
"""Poses over which time and memory of one are taken."""
QUICK = 3000
"""The same for a quick run."""


def growth(minutes: tuple[float, ...], quick: bool) -> dict[str, Any]:
    """Return curves: what is on the abscissa, and seconds (per pose, but for bags)."""
    arm = calibrated_arm()
    counts = [n for n in COUNTS if not quick or n <= QUICK]
    many = QUICK if quick else MANY
    turns = _channels(arm, ('theta', 'alpha'))
    return {
        'poses': {
            'x': counts,
            'pose': [_per_pose(arm, 0, n) for n in counts],
            'pose and Jacobian': [_per_pose(arm, arm.n, n) for n in counts],
        },
        'joints': {
            'x': list(JOINTS),
            'pose': [_per_pose(arm_of(n), 0, many) for n in JOINTS],
            'pose and Jacobian': [_per_pose(arm_of(n), n, many) for n in JOINTS],
        },
        'parameters': {
            'x': [2 * k for k in range(len(turns) + 1)],
            'pose and derivatives': [_per_pose(arm, -k, many) for k in range(len(turns) + 1)],
        },
        'bag': _bags(minutes),
    }


def _channels(robot: Robot, kinds: tuple[str, ...]) -> list[tuple[str, int]]:
    return [(kind, i) for i in range(robot.n) for kind in kinds]


def _per_pose(robot: Robot, screws: int, count: int) -> float:
    """Return seconds per pose, with the first screws, negative: of theta and alpha in turn."""
    kinds = ('theta',) if screws > 0 else ('theta', 'alpha')
    kernel = BulkKernel(robot, _channels(robot, kinds)[: abs(screws)])
    q = random_positions(robot, count)
    poses, out = kernel.screws(q)
    seconds = []
    for _ in range(ROUNDS):
        start = process_time()
        if screws:
            kernel.screws(q, poses, out)
        else:
            kernel.poses(q, poses)
        seconds.append((process_time() - start) / count)
    return float(np.median(seconds))


def _bags(minutes: tuple[float, ...]) -> dict[str, Any]:
    found = [bag(length) for length in minutes]
    return {
        'x': list(minutes),
        'read': [f['read_s'] for f in found],
        'align and compare': [f['compare_s'] for f in found],
        'runs': found,
    }


def draw(curves: dict[str, Any], path: Path) -> None:
    """Draw the curves."""
    import matplotlib

    matplotlib.use('Agg')
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 7.0), layout='constrained', dpi=120)
    labels = {
        'poses': 'poses in one call',
        'joints': 'joints of the arm',
        'parameters': 'DH values derived by',
        'bag': 'length of the bag [min]',
    }
    for axes, (key, label) in zip(figure.subplots(2, 2).flat, labels.items(), strict=True):
        curve = curves[key]
        scale = 1.0 if key == 'bag' else 1e9
        for name, values in curve.items():
            if name not in ('x', 'runs'):
                axes.plot(curve['x'], np.array(values) * scale, marker='o', ms=3.5, label=name)
        axes.set(xlabel=label, ylabel='processor time [s]' if key == 'bag' else 'ns per pose')
        if key == 'poses':
            axes.set(xscale='log', yscale='log')
        else:
            axes.set_ylim(bottom=0.0)
        axes.grid(alpha=0.3)
        axes.legend(frameon=False)
    figure.savefig(path)
