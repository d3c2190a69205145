# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How sure the twin is, one joint state at a time, at a cost that a control cycle can bear."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..recording import JointMotion, JointSignal, Recording, Signal
from .features import Features
from .posterior import Expected, Posterior
from .twin import Twin

_EVERY = 0.1
"""Shortest time between two looks [s]. One takes some milliseconds, so that this costs some
per cent of a core at any rate of joint states; in between the covariance is held, while a tool at
1 m/s goes on by 100 mm and its covariance changes by some per cent."""
_MOVED = 0.005
"""Least motion of a joint [rad or m] that is worth another look."""
_LEAD = np.linspace(-0.5, 0.0, 6)
"""Motion at constant speed before the sample [s], so that lag and play are as in the middle of a
motion. No joint gives, as none is accelerated: a look is held for longer than that lasts."""


class LivePosterior:
    """Where the models allowed have the tool, and how sure that is, while joint states come in."""

    def __init__(self, posterior: Posterior) -> None:
        self.posterior = posterior
        self._time = -np.inf
        self._q: Array | None = None
        self._moving = False
        self._expected = Expected(np.zeros(6), np.zeros((6, 6)))
        self._outside: tuple[str, ...] = ()

    @property
    def outside(self) -> tuple[str, ...]:
        """Return why the latest posture looked at lies outside what was recorded."""
        return self._outside

    def expected(
        self,
        twin: Twin,
        t: float,
        q: Array,
        wrench: Array | None = None,
        wrench_frame: str = 'tool',
        temperature: float | None = None,
        effort: Array | None = None,
    ) -> Expected:
        """
        Return what `Posterior.expected` does, of one pose at steady speed, held between two looks.

        t: stamp of the joint state [s].
        q: shape (n,).
        wrench: shape (6,) [N, N m].
        temperature: [degC]
        effort: shape (n,) [N m, or N of a slide].
        """
        since = t - self._time
        if self._q is None or since < 0.0:
            speed = np.zeros_like(q)
        elif since >= _EVERY and (self._moving or np.abs(q - self._q).max() > _MOVED):
            speed = (q - self._q) / since
            self._moving = bool(np.abs(q - self._q).max() > _MOVED)
        else:
            return self._expected
        self._time, self._q = t, np.array(q)
        now = _LEAD[-1:]
        pull = None if wrench is None else wrench[None]
        warm = None if temperature is None else np.array([temperature])
        recording = Recording(
            'live',
            JointMotion(_LEAD, q + _LEAD[:, None] * speed, np.tile(speed, (_LEAD.size, 1))),
            None,
            None if pull is None else Signal(now, pull),
            wrench_frame,
            None if warm is None else Signal(now, warm),
            effort=None if effort is None else JointSignal(now, effort[None]),
        )
        shift, covariance = self.posterior.expected(Features(twin, recording, now))
        self._expected = Expected(shift[0], covariance[0])
        outside = self.posterior.domain.outside(q[None], speed[None], pull, warm)
        self._outside = tuple(item.why for item in outside)
        return self._expected
