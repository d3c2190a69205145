# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Methods that take part: functions that say what they can of a case."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from ..case import ContestAnswer, ContestCase

ENTRANTS = {
    'weld_twin': 'weld_twin',
    'geometry': 'geometry',
    'zero_offset': 'geometry',
    'sparse_regression': 'sparse_regression',
    'gaussian_process': 'learners',
    'boosted_trees': 'learners',
    'never_knows': 'learners',
}
"""The module of every method, which has a function of its name."""


def entrant(name: str) -> Callable[[ContestCase], ContestAnswer]:
    """Return a method by its name; loading it may raise ImportError."""
    found: Callable[[ContestCase], ContestAnswer] = getattr(
        import_module(f'{__name__}.{ENTRANTS[name]}'), name
    )
    return found
