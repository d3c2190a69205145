# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Makes the files beside it, of a UR5 whose errors are known: tools/in_env python make_files.py."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

import weld_twin_core as wt
from weld_twin_core.arrays import Array

PLACE = Path(__file__).parent
ROBOT = wt.load('ur5')
REAL = wt.Twin(ROBOT, [wt.effects.JointOffset('elbow_joint', offset=1.2e-3)])
NOISE = 2e-5
"""Standard deviation of a measured coordinate [m], of instrument and arm together."""
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
STANDS = np.array([2.1, -0.4, 0.3])
"""How the instrument stands: turned by a quarter about z, at this place [m]."""
PINS = {
    'front a': (0.55, 0.10, 0.20),
    'front b': (0.60, 0.10, 0.20),
    'left a': (0.15, 0.55, 0.35),
    'left b': (0.15, 0.60, 0.35),
}
"""Where the pins are [m]; two of a pair are 50 mm apart."""


def tool_point(q: Array) -> Array:
    """Return where the tool point of the real arm is, shape (M, 3) [m]."""
    motion = wt.JointMotion(np.arange(float(len(q))), q, static=True)
    return wt.Twin(REAL.robot, REAL.effects).poses(wt.Recording('', motion)).position


def measured(q: Array, rng: np.random.Generator, anywhere: bool) -> Array:
    """Return what the instrument reads, shape (M, 3) [mm]; it may stand anywhere."""
    seen = tool_point(q)
    if anywhere:
        seen = seen @ TURN.T + STANDS
    return np.asarray(1e3 * (seen + rng.normal(scale=NOISE, size=seen.shape)))


def postures(count: int, rng: np.random.Generator) -> Array:
    """Return joint positions about those of the bundled seams, shape (count, 6) [rad]."""
    seam = wt.plan(ROBOT, wt.default_seam(ROBOT, 'spline'), 'smooth', rate_hz=10.0).motion.q
    half = np.array([1.0, 0.5, 0.6, 0.9, 0.8, 1.5])
    return np.asarray(seam.mean(axis=0) + half * rng.uniform(-1.0, 1.0, (count, 6)))


def touching(pin: Array, rng: np.random.Generator) -> Array:
    """Return a posture in which the real tool point touches a pin, shape (6,) [rad]."""
    while True:
        found = least_squares(lambda q: tool_point(q[None])[0] - pin, postures(1, rng)[0])
        if found.cost < 1e-16 and abs(found.x).max() < np.pi:
            return np.asarray(found.x)


def write(name: str, header: list[str], rows: list[list[object]]) -> None:
    """Write a table."""
    with (PLACE / name).open('w', newline='', encoding='utf-8') as file:
        writer = csv.writer(file, lineterminator='\n')
        writer.writerow(header)
        writer.writerows(rows)


def table(name: str, q: Array, rng: np.random.Generator, *, anywhere: bool) -> None:
    """Write joint angles as a pendant shows them, and what the instrument reads there."""
    shown = np.round(np.degrees(q), 4)
    rows = np.hstack([shown, np.round(measured(np.radians(shown), rng, anywhere), 3)])
    joints = [f'{joint} [deg]' for joint in ROBOT.joint_names]
    write(name, [*joints, 'x [mm]', 'y [mm]', 'z [mm]'], rows.tolist())


def main() -> None:
    """Write all files."""
    rng = np.random.default_rng(2026)
    table('measurements.csv', postures(40, rng), rng, anywhere=True)
    table('cycles.csv', np.tile(postures(5, rng), (30, 1)), rng, anywhere=False)
    touches = [
        [*np.round(touching(np.array(pin), rng), 5).tolist(), label]
        for label, pin in PINS.items()
        for _ in range(8)
    ]
    joints = [f'{joint} [rad]' for joint in ROBOT.joint_names]
    write('touches.csv', [*joints, 'contact'], touches)


if __name__ == '__main__':
    main()
