# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What to do next: mend what was found, or measure what would decide."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...effects.base import Effect
from ...robot import Robot
from ..problem import Model, Problem, Scale

__all__ = ['actions', 'next_experiment']


def actions(found: Sequence[Effect], robot: Robot) -> tuple[str, ...]:
    """Return one sentence for every effect found."""
    return ()


def next_experiment(
    problem: Problem, model: Model, alternatives: Sequence[tuple[Effect, ...]], scale: Scale
) -> dict[str, Any] | None:
    """Return the cheapest further measurement that would decide between alternatives."""
    return None
