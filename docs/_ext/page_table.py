# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A table of plain cells for the directives of this folder."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from docutils import nodes


def page_table(header: Sequence[str], rows: Iterable[Sequence[str]], *classes: str) -> nodes.table:
    """
    Return a table.

    Parameters
    ----------
    header : sequence of str
    rows : iterable of sequence of str
        As many cells each as the header has.
    classes : str
        Classes for the style sheet; 'sentences' gives the second column room.

    """
    group = nodes.tgroup(cols=len(header))
    group += [nodes.colspec(colwidth=1) for _ in header]
    head, body = nodes.thead(), nodes.tbody()
    head += _row(header)
    body += [_row(row) for row in rows]
    group += [head, body]
    table = nodes.table(classes=list(classes))
    table += group
    return table


def _row(cells: Sequence[str]) -> nodes.row:
    row = nodes.row()
    for cell in cells:
        entry = nodes.entry()
        entry += nodes.paragraph('', '', *_marked(cell))
        row += entry
    return row


def _marked(cell: str) -> list[nodes.Node]:
    """Return the text of a cell, with what stands between backticks as code."""
    parts = cell.split('`')
    if len(parts) % 2 == 0:  # a backtick that is none of a pair
        return [nodes.Text(cell)]
    return [nodes.literal(text=p) if k % 2 else nodes.Text(p) for k, p in enumerate(parts) if p]
