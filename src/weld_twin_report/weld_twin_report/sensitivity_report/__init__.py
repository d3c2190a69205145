# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The sensitivity study as files: results, figures with their data, claims table, a page."""

from .setting import Effort, Setting
from .study_files import make_figures, make_study

__all__ = ['Effort', 'Setting', 'make_figures', 'make_study']
