# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cells over time: what changed, which one is worst.

'add', 'show' and 'changed' keep the history of one cell. 'run' diagnoses the recordings of many cells
side by side into one database, and 'page' ranks them.
"""

JOBS = ('add', 'show', 'changed', 'run', 'page')
EXAMPLE = 'weld-twin history changed --cell line3'
