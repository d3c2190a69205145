# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page on what a machine can have lists every figure that the program goes by."""

from pathlib import Path

from weld_twin_core.effects.plausible import TABLE

PAGE = (Path(__file__).parents[2] / 'docs' / 'plausible.md').read_text(encoding='utf-8')


def test_the_page_lists_every_figure():
    for effect, parameter in TABLE:
        assert f'| `{effect}` | `{parameter}` |' in PAGE
