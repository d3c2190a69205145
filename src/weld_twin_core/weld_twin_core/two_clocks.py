# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Stamps of two clocks: when they have nothing in common, and what to do about it."""

from __future__ import annotations

ONE_CLOCK = 'Stamp both streams with one clock, or synchronise the two (PTP, NTP)'
"""The remedy, in the imperative, wherever two clocks are told of."""


def apart(joints: tuple[float, float], measured: tuple[float, float]) -> str | None:
    """
    Return that measurements and joint states have no time in common; None where they have.

    joints, measured: first and last stamp of either [s].
    """
    gap = max(measured[0] - joints[1], joints[0] - measured[1])
    if gap <= 0.0:
        return None
    return (
        f'measurements and joint states do not overlap in time, they are {gap:.3f} s apart: their '
        'stamps come from two clocks'
    )
