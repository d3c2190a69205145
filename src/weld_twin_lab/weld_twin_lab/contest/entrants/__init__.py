# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Methods that take part: each is a function of its name, which gives what it says of a case."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

ENTRANTS = {
    'weld_twin': 'weld_twin',
    'geometry': 'geometry',
    'zero_offset': 'geometry',
    'sparse_regression': 'sparse_regression',
    'gaussian_process': 'learners',
    'bayesian_linear': 'learners',
    'bootstrap': 'geometry',
    'boosted_trees': 'learners',
    'never_knows': 'geometry',
}
"""The file of each method; one is loaded where it is asked, for not all packages may be there."""


def entrant(name: str) -> Callable[..., Any]:
    """Return a method; raises ImportError where a package that it needs is not installed."""
    method: Callable[..., Any] = getattr(import_module(f'{__name__}.{ENTRANTS[name]}'), name)
    return method
