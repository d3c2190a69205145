# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which effects joint commands can mend, and which act on the tool all the same."""

from __future__ import annotations

from ..effects.effect import Effect, Stage

_BEYOND_COMMANDS = frozenset(
    {
        'measurement_scale',
        'measurement_noise',
        'refraction',
        'time_delay',
        'drift',
        'setup_step',
        'setup_settling',
        'instrument_knock',
    }
)
"""Effects of the measurement, or new in every run: they do nothing to a motion to come."""
_ROUNDING = 'quantization'
"""A rounding of what is commanded, which is as near as it gets: no joint command mends it."""


def commandable(effect: Effect) -> bool:
    """Tell whether joint commands can mend an effect."""
    return acts(effect) and effect.name != _ROUNDING


def acts(effect: Effect) -> bool:
    """Tell whether an effect moves the tool on a motion to come, which nobody measures."""
    return effect.name not in _BEYOND_COMMANDS and effect.stage not in (Stage.CLOCK, Stage.NOISE)
