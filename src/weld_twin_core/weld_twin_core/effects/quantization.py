# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Quantization: the joint is known only to the nearest step of its encoder.

The stairs are counted from the joint's zero, or, as an encoder is mounted anyhow and one that drops
digits rounds down, from a ``phase`` beside it, in steps.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .effect import Effect, FitHooks, Hooked, SearchHooks, Traits, TwinHooks, register
from .view import Array, Parameter, Robot, Shift, Stage, Value, View

_FINEST, _COARSEST = 1e-4, 2e-2
"""Steps that a search considers [rad]."""
_PEAKS = 3
"""Steps that a search starts from; beside the right one stand its half and its double."""
_PHASE = 1.0 / 16.0
"""Periods by which neighbours on the first grid of steps differ at the far end of the travel."""
_QUICK = (5, 9, 15, 25, 27, 45)
"""Lengths, doubled often enough, whose spectrum is quick: that of a power of two, a million, lies so
in memory that it takes three times as long, a good part of a diagnosis of some stations."""
_ZOOM, _ZOOMS = 16, 3
"""Steps tried to either side at each closer look, and how many looks there are."""
_CELLS = 2**21
"""Cells of a joint's travel at most, which bounds memory, too: after some ten turns the finest steps are
not looked for."""
_MOST = 2000
"""Steps tried at once at most, which bounds memory."""
_PHASES = 16
"""Phases that a search tells apart."""


class _Search(SearchHooks):
    def trials(self, view: View, joint: str | None) -> float:
        """Return how many steps and phases the spectrum tells apart."""
        travel = float(np.ptp(view.joint(view.robot.index(str(joint)))))
        return _PHASES * max(1.0, travel / _FINEST)


class _Fit(FitHooks):
    effect: Quantization

    def starts(self, view: View, zoom: int) -> tuple[list[Effect], Array] | None:
        """
        Return steps so close that the staircase stays in phase up to the largest position.

        A spectrum tells a step only as finely as one period over the travel; stairs are counted
        from zero, so at position q a step off by ds shifts them by q ds / step of a period. Where the
        phase is free, the stairs turn about the middle of the travel, with all phases there at first.
        """
        q = view.joint(view.robot.index(self.effect.joint))
        travel, middle = float(np.ptp(q)), 0.5 * float(q.min() + q.max())
        if zoom == _ZOOMS or self.effect.step <= 0.0 or travel <= 0.0:
            return None
        free, closer = self.effect.phase != 0.0, (0.5 * _ZOOM) ** zoom
        far = 0.5 * travel if free else float(np.abs(q).max())
        fine = _PHASE / far
        half = 1.0 / (travel * fine) if zoom == 0 else float(_ZOOM)
        offset = np.arange(-min(int(half) + 1, _MOST // 2), min(int(half) + 1, _MOST // 2) + 1)
        around = np.arange(_PHASES) if zoom == 0 else np.arange(-4, 5)
        turns = around / (_PHASES * closer) if free else np.zeros(1)
        counts, turns = (grid.ravel() for grid in np.meshgrid(offset * fine / closer, turns))
        steps = 1.0 / (1.0 / self.effect.step + counts)
        phases = self.effect.phase + middle * counts + turns if free else np.zeros(steps.size)
        phases = phases[steps > 0.0] - np.rint(phases[steps > 0.0])
        steps = steps[steps > 0.0]
        many = Quantization(self.effect.joint, steps, phases)
        displaced = many.displace(view)[('q', view.robot.index(self.effect.joint))]
        pairs = zip(steps.tolist(), phases.tolist(), strict=True)
        return [Quantization(self.effect.joint, *pair) for pair in pairs], displaced


class _Twin(TwinHooks):
    effect: Quantization

    def jump(self, view: View) -> Shift:
        """Return a step wherever a stair is climbed: between, its joint goes on and jumps nowhere."""
        joint, step = view.robot.index(self.effect.joint), float(self.effect.step)
        stairs = np.rint(view.joint(joint) / (step or np.inf) - float(self.effect.phase))
        return {('q', joint): step * np.sign(np.diff(stairs))}


@register
class Quantization(Effect):
    """Rounding to stairs of ``step``, ``phase`` steps beside zero; a step of zero rounds nothing."""

    joint: str
    step: Value = 0.0
    phase: Value = 0.0

    traits = Traits(
        title='encoder resolution',
        meaning='a joint is read in steps',
        formula='θ → step · (round(θ / step − phase) + phase)',
        entered='the encoder',
        depends_on='angle',
        jumps=True,
        common=False,
        by_motion=True,
    )
    of = 'joint'
    stage = Stage.JOINT
    parameters = (
        Parameter('step', 'rad', typical=2e-4, lower=0.0, differentiable=False, linear=False)
        .plausible(
            (1e-3, 0.0, 1e-2), 'derived: 12 bits a turn are 1.5 mrad; a centiradian is no encoder'
        )
        .plausible_sliding((1e-5, 0.0, 1e-3), 'derived: a millimetre is no scale'),
        Parameter(
            'phase', '-', typical=0.1, lower=-0.5, upper=0.5, differentiable=False, linear=False
        ).plausible((np.inf, -0.5, 0.5), 'derived: half a step to either side is all there is'),
    )
    search = Hooked(_Search)
    fit = Hooked(_Fit)
    twin = Hooked(_Twin)

    def displace(self, view: View) -> Shift:
        step = self.number('step')
        safe = np.where(step > 0.0, step, 1.0)
        phase = self.number('phase')
        error = safe * (np.rint(self._theta(view) / safe - phase) + phase) - self._theta(view)
        return self._moves(view, np.where(step > 0.0, error, 0.0))

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """
        Yield the steps whose staircase the residual follows best.

        A staircase of step s is a wave of 1/s cycles per radian: the spectrum of the residual's
        pull over joint position shows every step at once. A grid of steps would need tens of
        thousands, for a small error of the step runs out of phase over the joint's travel.
        """
        if pull is None:
            return
        q = view.joint(view.robot.index(str(joint)))
        travel = float(np.ptp(q))
        if travel < 4.0 * _FINEST:
            return
        cell = max(0.25 * _FINEST, travel / _CELLS)
        finest = 4.0 * cell
        bins = np.rint((q - q.min()) / cell).astype(int)
        least = 4 * (int(bins.max()) + 1)
        lengths = _QUICK if view.static else (1,)
        size = min(odd << (-(-least // odd) - 1).bit_length() for odd in lengths)
        spectrum = np.fft.rfft(np.bincount(bins, pull, minlength=size))
        power = np.abs(spectrum[: int(size * cell / finest) + 2]) ** 2
        step = size * cell / np.maximum(np.arange(power.size), 1)
        power[(step < finest) | (step > min(_COARSEST, 0.5 * travel))] = 0.0
        for _ in range(_PEAKS):
            k = int(np.argmax(power))
            if power[k] <= 0.0:
                return
            best = size * cell / _parabola(power, k)
            # Stairs of phase p are minus the sine of 2 pi (q / step - p), and finer waves.
            wave = np.angle((pull * np.exp(-2j * np.pi * q / best)).sum())
            phase = 0.25 - float(wave) / (2.0 * np.pi)
            yield cls(str(joint), best)
            yield cls(str(joint), best, phase - round(phase))
            power[max(k - 6, 0) : k + 7] = 0.0

    def atoms(self, view: View) -> list[Shift]:
        """Return the rounding error itself; its right coefficient is one."""
        return [self.displace(view)]

    def from_atoms(self, coefficients: Array) -> Quantization:
        """Return the same staircase: its height is its step."""
        return self

    def remedy(self, robot: Robot) -> str:
        return (
            f'Read {self.site} with a finer encoder or more digits: it is rounded to '
            f'{self._travelled(robot, self._plain("step"))}.'
        )


def _parabola(power: Array, k: int) -> float:
    """Return the place of a peak between bins, from its neighbours' logarithms."""
    if not 0 < k < power.size - 1 or min(power[k - 1], power[k + 1]) <= 0.0:
        return float(k)
    low, mid, high = np.log(power[k - 1 : k + 2])
    bend = low - 2.0 * mid + high
    return float(k) if bend >= 0.0 else k + 0.5 * float(low - high) / float(bend)
