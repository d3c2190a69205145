# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Tables of what effects say of themselves.

``{weld-twin-ranges}``: what a machine can have; ``sliding``: where joints slide.
``{weld-twin-causes}``: what is wrong with a machine that has them.
"""

from __future__ import annotations

from docutils import nodes
from docutils.parsers.rst import Directive
from page_table import page_table
from range_rows import HEADER, cause_rows, range_rows
from sphinx.application import Sphinx


class Ranges(Directive):
    """The table of what a machine can have."""

    optional_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the table."""
        return [page_table(HEADER, range_rows(sliding=self.arguments == ['sliding']))]


class Causes(Directive):
    """The table of causes."""

    def run(self) -> list[nodes.Node]:
        """Return the table."""
        return [page_table(('cause', 'what is wrong'), cause_rows(), 'sentences')]


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the directive."""
    app.add_directive('weld-twin-ranges', Ranges)
    app.add_directive('weld-twin-causes', Causes)
    return {'parallel_read_safe': True}
