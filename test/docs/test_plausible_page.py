# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page on what a machine can have lists every figure that the program goes by."""

import sys
from pathlib import Path

from weld_twin_core.effects.plausible import table

DOCS = Path(__file__).parents[2] / 'docs'
sys.path.append(str(DOCS / '_ext'))

from range_rows import range_rows  # noqa: E402


def test_the_page_lists_every_figure():
    text = (DOCS / 'plausible.md').read_text(encoding='utf-8')
    assert text.count('{weld-twin-ranges}') == 2
    assert {row[:2] for row in range_rows(sliding=False)} == set(table())


def test_a_row_says_unit_spread_range_and_source():
    rows = {row[:2]: row[2:] for row in range_rows(sliding=True)}
    assert rows['backlash', 'width'][:4] == ('m', '5e-05', '0', '0.005')
    turning = {row[:2]: row[2:] for row in range_rows(sliding=False)}
    assert turning['payload', 'mass'][:4] == ('kg', '2', 'by robot', 'by robot')
    assert turning['vibration', 'frequency'][:4] == ('Hz', 'any', '1', '100')
    assert 'industrialmonitordirect.com' in turning['joint_offset', 'offset'][4]
