# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Before any cause: is the data sound?"""

from __future__ import annotations

from ..problem import Model, Problem
from ..result import Check

__all__ = ['check']


def check(problem: Problem, model: Model) -> tuple[Check, ...]:
    """Return what was found in the data."""
    return ()
