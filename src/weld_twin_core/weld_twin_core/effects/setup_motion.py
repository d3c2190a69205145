# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A set-up's own motion seen from another recording: carried along in time, or left behind."""

from __future__ import annotations

from collections.abc import Sequence

from ..recording import Recording
from .dated import Timed
from .effect import Effect


def of_the_robot(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """Return what is left of the effects for the robot ever after, without those of one set-up."""
    return tuple(e for e in (effect.twin.lasting() for effect in effects) if e is not None)


def seen_from(
    effects: Sequence[Effect], epoch_ns: int, span_ns: tuple[int, int], other: Recording
) -> tuple[Effect, ...]:
    """
    Return effects for another recording: the set-up's motion at its right time, or left out.

    epoch_ns, span_ns: what the stamps of the recording whose set-up moved count from; its first
    and last stamp.
    other: where it does not overlap in time it is taken for another set-up.
    """
    first, last = other.span_ns
    if last < span_ns[0] or first > span_ns[1]:
        return of_the_robot(effects)
    later = (other.epoch_ns - epoch_ns) * 1e-9
    return tuple(e.recounted(later) if isinstance(e, Timed) else e for e in effects)
