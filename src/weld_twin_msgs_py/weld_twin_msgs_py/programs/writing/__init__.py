# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""New programs in the languages of the makers, and the sheets that go with them."""

from .exported import Exported, ExportMove, move_count
from .sheets import sheet
from .writers import WRITERS, written

__all__ = ['WRITERS', 'ExportMove', 'Exported', 'move_count', 'sheet', 'written']
