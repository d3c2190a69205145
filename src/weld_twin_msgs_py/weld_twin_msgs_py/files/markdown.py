# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables for pages in Markdown."""

from collections.abc import Sequence


def table(*rows: Sequence[object]) -> str:
    """Return a table; the first row is its head."""
    lines = ['| ' + ' | '.join(map(str, row)) + ' |' for row in rows]
    lines.insert(1, '|' + '---|' * len(rows[0]))
    return '\n'.join(lines) + '\n'
