# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A diagnosis on the terminal: the verdict, what was found, what to do."""

from __future__ import annotations

from rich.console import Console
from rich.markup import escape
from rich.padding import Padding
from rich.table import Table

from weld_twin_core.diagnosis.result import Diagnosis

from ..offline.where_it_holds import where_it_holds
from .cause_levels import LEVEL_HEADS, level_row
from .changed_section import CHANGED_HEADS, changed_rows, nothing_changed
from .family_table import FAMILY_HEADS, RIPPLE_HEADS, family_rows, ripple_rows, worth_doing
from .quantities import change, millimetres, odds, parameter_rows
from .words import STATUS, found_name, listed, mended, site_name, verdict

_COLOURS = {
    'identified': 'green',
    'ambiguous': 'yellow',
    'unknown': 'red',
    'none': 'cyan',
    'unsound': 'red',
}
_MOST = 8
"""Rows of a table; the files have all."""


def print_summary(diagnosis: Diagnosis, console: Console) -> None:
    """Print the verdict in two sentences, then tables as far as there is something in them."""
    first, second = verdict(diagnosis)
    colour = _COLOURS[diagnosis.status]
    console.print(f'[bold {colour}]{STATUS[diagnosis.status]}[/]  {escape(first)}')
    console.print(Padding(escape(second), (0, 0, 1, 0)))
    for sentence in mended(diagnosis):
        console.print(f'[bold yellow]mended before the diagnosis:[/] {escape(sentence)}')
    if diagnosis.status == 'unsound':
        return
    if diagnosis.families:
        _print_families(diagnosis, console)
    elif diagnosis.effects:
        console.print(_effects(diagnosis))
    if diagnosis.status == 'unknown' and diagnosis.causes:
        console.print(_levels(diagnosis))
    elif len(diagnosis.candidates) > 1:
        console.print(_candidates(diagnosis))
    _print_sets(diagnosis, console)
    _print_changed(diagnosis, console)
    for check in diagnosis.checks:
        if check.level == 'warning':
            console.print(f'[yellow]data:[/] {escape(check.sentence)}')
    for recording in diagnosis.recordings:
        for note in recording.notes:
            console.print(f'[dim]note:[/] {escape(recording.name)}: {escape(note)}')
    _print_holds(diagnosis, console)
    for action in worth_doing(diagnosis):
        console.print(f'[bold]do:[/] {escape(action)}')


def _print_changed(diagnosis: Diagnosis, console: Console) -> None:
    """Print what changed between the recordings, where that was asked."""
    if not diagnosis.may_change or len(diagnosis.recordings) < 2:
        return
    if not diagnosis.changed:
        console.print(escape(nothing_changed(diagnosis)))
        return
    title = f'changed since {diagnosis.recordings[0].name}'
    table = Table(box=None, title=escape(title), title_justify='left', pad_edge=False)
    for head in CHANGED_HEADS:
        table.add_column(head, header_style='dim', overflow='fold')
    for row in changed_rows(diagnosis):
        table.add_row(*(escape(cell) for cell in row))
    console.print(table)


def _print_holds(diagnosis: Diagnosis, console: Console) -> None:
    """Print how far the corrected robot can be relied on, and what the data left open."""
    if diagnosis.posterior is None:
        return
    first, *left = where_it_holds(diagnosis.posterior)[:-1]
    console.print(escape(first))
    for sentence in left:
        console.print(f'[yellow]open:[/] {escape(sentence)}')


def _print_families(diagnosis: Diagnosis, console: Console) -> None:
    parts = [
        ('errors found, by kind', FAMILY_HEADS, family_rows(diagnosis.families)),
        ('transmission ripple by joint', RIPPLE_HEADS, ripple_rows(diagnosis)),
    ]
    for title, heads, rows in parts:
        if rows:
            table = Table(box=None, title=title, title_justify='left', pad_edge=False)
            for head in heads:
                table.add_column(head.lower(), header_style='dim', overflow='fold')
            for row in rows:
                table.add_row(*(escape(cell) for cell in row))
            console.print(table)


def _effects(diagnosis: Diagnosis) -> Table:
    table = Table(box=None, title='effects found', title_justify='left', pad_edge=False)
    for head in ('effect', 'parameter', 'value ± standard error'):
        table.add_column(head, header_style='dim', overflow='fold')
    for found in diagnosis.effects[:_MOST]:
        for k, (name, value) in enumerate(parameter_rows(found.effect, found.std)):
            table.add_row(escape(found_name(found)) if k == 0 else '', name, value)
    more = len(diagnosis.effects) - _MOST
    if more > 0:
        table.add_row(f'and {more} more in effects.yaml')
    return table


def _levels(diagnosis: Diagnosis) -> Table:
    """Return what is certain of each cause although it has no name."""
    table = Table(box=None, title='what is certain', title_justify='left', pad_edge=False)
    for head in LEVEL_HEADS:
        table.add_column(head.lower(), header_style='dim', overflow='fold')
    for cause in diagnosis.causes[:_MOST]:
        table.add_row(*(escape(cell) for cell in level_row(cause)))
    return table


def _candidates(diagnosis: Diagnosis) -> Table:
    table = Table(box=None, title='candidates', title_justify='left', pad_edge=False)
    for head in ('effect', 'probability', 'gap left', 'change'):
        table.add_column(head, header_style='dim', overflow='fold')
    for item in diagnosis.candidates[:_MOST]:
        table.add_row(
            escape(site_name(item.site)),
            odds(item.probability),
            millimetres(item.rms_after_m),
            change(item.shrink),
        )
    return table


def _print_sets(diagnosis: Diagnosis, console: Console) -> None:
    for group in diagnosis.indistinguishable:
        if len(group) > 1:
            names = listed([site_name(site) for site in group], 'or')
            console.print(f'[yellow]cannot tell apart:[/] {escape(names)}')
