# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Lengths in the sentences of the checks."""


def length(value: float) -> str:
    """Return a length [m] as people read it."""
    if value >= 1.0:
        return f'{value:.3g} m'
    return f'{value * 1e3:.3g} mm' if value >= 1e-4 else f'{value * 1e6:.3g} um'
