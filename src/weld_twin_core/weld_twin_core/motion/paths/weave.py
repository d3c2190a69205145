# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Weaving: the torch swings across a seam while it travels along it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...errors import PathError
from .seam_path import Path, SeamFrames, positive

FORMS = ('sine', 'zigzag', 'triangle')


@dataclass(frozen=True, eq=False)
class Weave(Path):
    """
    A swing laid over a seam.

    Arc length, tangent and normal stay those of the seam underneath: speed is travel speed, and
    the torch does not turn with the swing.
    """

    seam: Path
    amplitude: float
    """Largest distance from the seam, to either side [m]."""
    wavelength: float
    """Travel per full swing [m]."""
    form: str = 'sine'
    """'sine'; 'zigzag', straight from side to side; or 'triangle', which runs down the work to
    each side of the corner of a fillet: the torch also lifts by the distance from the seam."""

    def __post_init__(self) -> None:
        if self.form not in FORMS:
            raise PathError(f'weave form must be one of {", ".join(FORMS)}, got {self.form!r}')
        for name in ('amplitude', 'wavelength'):
            vars(self)[name] = positive(getattr(self, name), f'weave {name}')

    @property
    def length(self) -> float:
        """Return the length of the seam underneath [m]."""
        return self.seam.length

    @property
    def detail(self) -> float:
        """Return the travel over which the torch swings [m]."""
        return min(self.wavelength, self.seam.detail)

    def sample(self, s: Array) -> SeamFrames:
        """Return the woven position and the seam's own frame at arc lengths s, shape (N,) [m]."""
        frames = self.seam.sample(s)
        swing = self.amplitude * self._swing(np.asarray(s) / self.wavelength)
        position = frames.position + swing[:, None] * frames.across
        if self.form == 'triangle':
            position = position + np.abs(swing)[:, None] * frames.normal
        return frames._replace(position=position)

    def _swing(self, cycles: Array) -> Array:
        """Return the swing between -1 and 1; it starts on the seam, to the left."""
        if self.form == 'sine':
            return np.sin(2.0 * np.pi * cycles)
        return np.abs((4.0 * cycles - 1.0) % 4.0 - 2.0) - 1.0
