# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Before any cause: are data and set-up sound?

Each check is one function of a `Case` in one table (`checks`); it finds and names. What it finds
wrong with the set-up carries its own correction, and `gate` decides what comes of it.
"""

from __future__ import annotations

from .checks import CHECKS
from .gate import Examined, examine
from .mending import Given
from .repeats import refuse_reused

__all__ = [
    'CHECKS',
    'Examined',
    'Given',
    'examine',
    'refuse_reused',
]
