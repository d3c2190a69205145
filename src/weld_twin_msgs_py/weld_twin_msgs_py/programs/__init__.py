# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Robot programs in the languages of their makers, read, changed in some points, and written."""

from .build import Program, to_moves
from .context import Context
from .controllers import Controller, controller_of
from .languages import LANGUAGES, read_program, read_sources
from .rewrite import check_written, rewritten

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
