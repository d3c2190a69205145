# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The sim-to-real gap: where it lies, which effect causes it, how far it shrinks."""

from .beliefs import Beliefs
from .pipeline import diagnose
from .result import (
    Candidate,
    Check,
    Diagnosis,
    Found,
    Gap,
    Shrink,
    Site,
    Traces,
    Unexplained,
    Unsound,
    Where,
)

__all__ = [
    'Beliefs',
    'Candidate',
    'Check',
    'Diagnosis',
    'Found',
    'Gap',
    'Shrink',
    'Site',
    'Traces',
    'Unexplained',
    'Unsound',
    'Where',
    'diagnose',
]
