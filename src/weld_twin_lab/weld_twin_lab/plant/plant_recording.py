# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What goes into the plant and what comes out of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

Entry = Mapping[str, Any]
"""A robot file, one of its parts, or one effect of an effects file, as YAML gives it."""


@dataclass(frozen=True, eq=False)
class Command:
    """What the controller commanded, and what the surroundings did meanwhile."""

    t: np.ndarray
    """Strictly increasing, shape (N,) [s]; evenly spaced unless static."""
    q: np.ndarray
    """Shape (N, n) [rad or m]."""
    static: bool = False
    """Each row is a pose at rest; the rows are visited in order."""
    wrench: np.ndarray | None = None
    """Force and torque on the tool, in the tool frame, at the tool centre point, shape (N, 6) [N,
    N m]."""
    temperature: np.ndarray | None = None
    """The arm's own temperature, shape (N,) [degC]."""

    def __post_init__(self) -> None:
        """Keep read-only copies of the arrays, of the right shape."""
        count = np.shape(self.t)[0]
        for name, shape in (
            ('t', (count,)),
            ('q', (count, np.shape(self.q)[-1])),
            ('wrench', (count, 6)),
            ('temperature', (count,)),
        ):
            value = getattr(self, name)
            if value is None:
                continue
            array = np.array(value, dtype=float)
            if array.shape != shape or not np.isfinite(array).all():
                raise ValueError(f'{name} must be finite, of shape {shape}, got {array.shape}')
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        steps = np.diff(self.t)
        if (steps <= 0.0).any():
            raise ValueError('t must be strictly increasing')
        if not self.static and (count < 4 or np.ptp(steps) > 1e-6 * steps.mean() + 1e-9):
            raise ValueError('a moving command must be evenly spaced, four samples or more')


@dataclass(frozen=True, eq=False)
class PlantRecording:
    """What the cell recorded: several streams, each with its own stamps."""

    t_joint: np.ndarray
    """Shape (N,) [s]."""
    q: np.ndarray
    """As commanded: the controller does not know better, shape (N, n) [rad or m]."""
    qd: np.ndarray | None
    """Shape (N, n) [rad/s or m/s] or None."""
    t_measured: np.ndarray
    """Shape (M,) [s]."""
    position: np.ndarray
    """Tool centre point in the measuring frame, shape (M, 3) [m]."""
    quaternion: np.ndarray | None
    """Shape (M, 4) x y z w, or None."""
    wrench_t: np.ndarray | None
    wrench: np.ndarray | None
    """[s] and (W, 6) [N, N m], or None"""
    temperature_t: np.ndarray | None
    temperature: np.ndarray | None
    """[s] and (K,) [degC], or None"""
    static: bool


class Course:
    """
    The commanded motion between its samples.

    A cubic spline, so that the drives see a continuous acceleration; before and after the
    command the arm rests. Static stations are looked up, not interpolated.
    """

    def __init__(self, command: Command) -> None:
        self.command = command
        self._spline = None if command.static else CubicSpline(command.t, command.q)

    def q(self, t: np.ndarray, order: int = 0) -> np.ndarray:
        """Return the joint positions, or their derivative of that order, shape (len(t), n)."""
        if self._spline is None:
            rows = np.searchsorted(self.command.t, t)
            return self.command.q[rows] if order == 0 else np.zeros_like(self.command.q[rows])
        return np.asarray(self._spline(np.clip(t, self.command.t[0], self.command.t[-1]), order))

    def wrench(self, t: np.ndarray) -> np.ndarray | None:
        """Return the tool wrench, shape (len(t), 6), linear between samples."""
        if self.command.wrench is None:
            return None
        columns = [np.interp(t, self.command.t, column) for column in self.command.wrench.T]
        return np.stack(columns, axis=-1)

    def temperature(self, t: np.ndarray) -> np.ndarray | None:
        """Return the arm's temperature, shape (len(t),) [degC]."""
        if self.command.temperature is None:
            return None
        return np.asarray(np.interp(t, self.command.t, self.command.temperature))
