# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects that are nothing before an instant and constant from then on."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import numpy as np

from ..arm.channels import Shift
from ..arrays import Array
from .constant import ChannelError, FrameError
from .effect import Effect
from .view import View

S = TypeVar('S', bound='Sudden')


class Sudden(Effect):
    """
    What sets in at ``time`` [s], counted from the recording's epoch.

    A search takes it in only where the checks of the data found the instant: a step fits any
    slow change halfway.
    """

    depends_on = 'time'
    dated = True
    common = False
    options = ('time',)
    needs = frozenset({'time'})

    @property
    def instant(self) -> float:
        """Return when it sets in [s]."""
        return float(self.time)  # type: ignore[attr-defined]

    def recounted(self: S, later: float) -> S:
        """Return the same with its instant counted from an epoch that is later by so much [s]."""
        return replace(self, time=self.instant - later)  # type: ignore[call-arg]

    def after(self, view: View) -> Array:
        """Return one from the instant on and zero before, shape as the view's stamps."""
        return (view.t >= self.instant).astype(np.float64)

    def displace(self, view: View) -> Shift:
        """Return the constant displacement from the instant on."""
        after = self.after(view)
        whole = super().displace(view)  # type: ignore[safe-super]
        return {channel: value * after for channel, value in whole.items()}

    def gradient(self, view: View) -> list[Shift | None]:
        """Return the constant derivatives from the instant on."""
        after = self.after(view)
        return [
            None if shift is None else {channel: value * after for channel, value in shift.items()}
            for shift in super().gradient(view)
        ]


class SuddenChannel(Sudden, ChannelError):
    """A channel of a joint that is off from an instant on."""


class SuddenFrame(Sudden, FrameError):
    """A frame that stands elsewhere from an instant on."""
