# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""``{weld-twin-commands}``: what every subcommand says of itself, as ``--help-all`` prints it."""

from __future__ import annotations

import contextlib
import io
import os

from docutils import nodes
from docutils.parsers.rst import Directive
from sphinx.application import Sphinx

from weld_twin_nodes.cli import main

WIDTH = '100'
"""Columns that the help is folded at."""


def help_of(*words: str) -> str:
    """Return what ``weld-twin WORDS --help-all`` prints."""
    out = io.StringIO()
    columns = os.environ.get('COLUMNS')
    os.environ['COLUMNS'] = WIDTH
    try:
        with contextlib.redirect_stdout(out), contextlib.suppress(SystemExit):
            main([*words, '--help-all'])
    finally:
        os.environ.pop('COLUMNS') if columns is None else os.environ.update(COLUMNS=columns)
    return out.getvalue()


def command_names() -> list[str]:
    """Return the subcommands in the order of ``weld-twin --help``."""
    return listed(help_of(), 'commands')


def listed(text: str, title: str) -> list[str]:
    """Return the names that a help lists under a title."""
    rows = text.partition(f'\n{title}:\n')[2].partition('\n\n')[0].splitlines()
    return [row.split()[0] for row in rows if row[:2].isspace() and row[2:3].strip()]


class Commands(Directive):
    """One section for every subcommand."""

    def run(self) -> list[nodes.Node]:
        """Return the sections."""
        out: list[nodes.Node] = []
        for name in command_names():
            section = nodes.section(ids=[f'weld-twin-{name}'], names=[name])
            section += nodes.title(text=f'weld-twin {name}')
            jobs = [] if name == 'lab' else listed(help_of(name), 'jobs')
            for words in ((name,), *((name, job) for job in jobs)):
                text = help_of(*words)
                section += nodes.literal_block(text, text, language='text')
            out.append(section)
        return out


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the directive."""
    app.add_directive('weld-twin-commands', Commands)
    return {'parallel_read_safe': True}
