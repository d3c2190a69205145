# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Robot programs in the languages of their makers, read, changed in some points, and written."""

from .build import Program, check_written, rewritten, to_moves
from .controllers import Context, Controller, controller_of
from .languages import LANGUAGES, read_program, read_sources

__all__ = [
    'LANGUAGES',
    'Context',
    'Controller',
    'Program',
    'check_written',
    'controller_of',
    'read_program',
    'read_sources',
    'rewritten',
    'to_moves',
]
