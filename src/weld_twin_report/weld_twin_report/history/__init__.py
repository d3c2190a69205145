# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The history of cells: verdicts and values in a database, and what changed between them."""

from .database import Database
from .entry import Entry, entry_of
from .schema import Unavailable
from .words import observations

__all__ = ['Database', 'Entry', 'Unavailable', 'entry_of', 'observations']
