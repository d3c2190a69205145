# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Tables of what effects say of themselves.

``{weld-twin-effects}``: what there is; ``weld-twin-effect-classes``: their classes, for a reference.
``{weld-twin-ranges}``: what a machine can have; ``sliding``: where joints slide.
``{weld-twin-causes}``: what is wrong with a machine that has them.
``{weld-twin-words}``: what sections of the sheet say of their own words.
"""

from __future__ import annotations

from docutils import nodes
from docutils.parsers.rst import Directive
from docutils.statemachine import StringList
from page_table import page_table
from range_rows import EFFECTS, HEADER, cause_rows, effect_rows, range_rows, word_rows
from sphinx.application import Sphinx

from weld_twin_core.effects import REGISTRY


class Effects(Directive):
    """The table of effects."""

    def run(self) -> list[nodes.Node]:
        """Return the table."""
        return [page_table(EFFECTS, effect_rows(), 'effects')]


class EffectClasses(Directive):
    """The class of every effect, as autodoc shows it."""

    def run(self) -> list[nodes.Node]:
        """Return what autodoc makes of them."""
        lines = []
        for name in sorted(kind.__name__ for kind in REGISTRY.values()):
            lines += [f'.. autoclass:: weld_twin_core.effects.{name}', '   :no-members:', '']
        out = nodes.container()
        self.state.nested_parse(StringList(lines, 'effects'), self.content_offset, out)
        return out.children


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


class Words(Directive):
    """The table of words that sections of the sheet explain; nothing where there are none."""

    def run(self) -> list[nodes.Node]:
        """Return the table."""
        rows = word_rows()
        return [page_table(('word', 'meaning'), rows, 'sentences')] if rows else []


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the directive."""
    app.add_directive('weld-twin-effects', Effects)
    app.add_directive('weld-twin-effect-classes', EffectClasses)
    app.add_directive('weld-twin-ranges', Ranges)
    app.add_directive('weld-twin-causes', Causes)
    app.add_directive('weld-twin-words', Words)
    return {'parallel_read_safe': True}
