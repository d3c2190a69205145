# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A diagnosis on the terminal: the verdict, what was found, what to do."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.markup import escape
from rich.padding import Padding
from rich.table import Table

from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_nodes.offline.where_it_holds import elsewhere, left_open, which_file
from weld_twin_nodes.wording.mending import correctable
from weld_twin_nodes.wording.quantities import change, millimetres, parameter_rows
from weld_twin_nodes.wording.verdict import verdict
from weld_twin_nodes.wording.words import (
    found_name,
    listed,
    mended,
    open_sets,
    site_name,
    status_word,
)

from .acceptance import Demand, rule_of
from .cause_levels import LEVEL_HEADS, level_row
from .cause_list import rivalry, slots
from .changed_section import CHANGED_HEADS, changed_rows, nothing_changed
from .contact_clouds import contacts_told
from .family_table import FAMILY_HEADS, RIPPLE_HEADS, family_rows, ripple_rows
from .to_do import worth_doing
from .untried import weighed

_COLOURS = {
    'identified': 'green',
    'ambiguous': 'yellow',
    'unknown': 'red',
    'none': 'cyan',
    'unsound': 'red',
}
_MOST = 8
"""Rows of a table; the files have all."""
_BETWEEN = '  '
"""Between the columns of a table."""


def print_summary(diagnosis: Diagnosis, console: Console, demand: Demand | None = None) -> None:
    """Print the verdict in two sentences, then tables as far as there is something in them."""
    first, second = verdict(diagnosis)
    colour = _COLOURS[diagnosis.status]
    console.print(f'[bold {colour}]{status_word(diagnosis)}[/]  {escape(first)}')
    console.print(Padding(escape(second), (0, 0, 1, 0)))
    for sentence in mended(diagnosis):
        console.print(f'[bold yellow]mended before the diagnosis:[/] {escape(sentence)}')
    if diagnosis.status == 'unsound':
        return
    if diagnosis.families:
        _print_families(diagnosis, console)
    elif diagnosis.effects:
        _print_effects(diagnosis, console)
    if diagnosis.status == 'unknown' and diagnosis.causes:
        _print_levels(diagnosis, console)
    elif len(weighed(diagnosis)) > 1:
        _print_candidates(diagnosis, console)
    _print_sets(diagnosis, console)
    _print_changed(diagnosis, console)
    _print_data(diagnosis, console)
    _print_holds(diagnosis, console)
    rule = rule_of(diagnosis, demand) if demand is not None else None
    for action in worth_doing(diagnosis, rule):
        console.print(f'[bold]do:[/] {escape(action)}')


def _print_data(diagnosis: Diagnosis, console: Console) -> None:
    """Print what is to be said of the data."""
    for check in diagnosis.checks:
        if check.level == 'warning':
            console.print(f'[yellow]data:[/] {escape(check.sentence)}')
    for recording in diagnosis.recordings:
        for note in () if recording.contacts is not None else recording.notes:
            console.print(f'[dim]note:[/] {escape(recording.name)}: {escape(note)}')
    if diagnosis.contacts is not None:
        console.print(escape(contacts_told(diagnosis.contacts)))


def _print_changed(diagnosis: Diagnosis, console: Console) -> None:
    """Print what changed between the recordings, where that was asked."""
    if not diagnosis.may_change or len(diagnosis.recordings) < 2:
        return
    if not diagnosis.changed:
        console.print(escape(nothing_changed(diagnosis)))
        return
    title = f'changed since {diagnosis.recordings[0].name}'
    _print_table(console, title, CHANGED_HEADS, changed_rows(diagnosis))


def _print_holds(diagnosis: Diagnosis, console: Console) -> None:
    """Print where what is said holds, how wide it is beyond, and what the data left open."""
    if diagnosis.posterior is None:
        return
    console.print(escape(elsewhere(diagnosis.posterior, correctable(diagnosis))))
    if file := which_file(diagnosis.model.alone):
        console.print(f'[yellow]files:[/] {escape(file)}')
    for sentence in left_open(diagnosis.posterior):
        console.print(f'[yellow]open:[/] {escape(sentence)}')


def _print_families(diagnosis: Diagnosis, console: Console) -> None:
    parts = [
        ('errors found, by kind', FAMILY_HEADS, family_rows(diagnosis.families)),
        ('transmission ripple by joint', RIPPLE_HEADS, ripple_rows(diagnosis)),
    ]
    for title, heads, rows in parts:
        if rows:
            _print_table(console, title, [head.lower() for head in heads], rows)


def _print_effects(diagnosis: Diagnosis, console: Console) -> None:
    rows = []
    for found in diagnosis.effects[:_MOST]:
        for k, (name, value) in enumerate(
            parameter_rows(found.effect, found.std, diagnosis.model.robot)
        ):
            rows.append([found_name(found) if k == 0 else '', name, value])
    _print_table(console, 'effects found', ('effect', 'parameter', 'value ± standard error'), rows)
    more = len(diagnosis.effects) - _MOST
    if more > 0:
        console.print(f'and {more} more in effects.yaml')


def _print_levels(diagnosis: Diagnosis, console: Console) -> None:
    """Print what is certain of each cause although it has no name."""
    rows = [level_row(cause) for cause in diagnosis.causes[:_MOST]]
    _print_table(console, 'what is certain', [head.lower() for head in LEVEL_HEADS], rows)


def _print_candidates(diagnosis: Diagnosis, console: Console) -> None:
    rows = []
    for slot in slots(weighed(diagnosis)):
        rows += [
            [
                site_name(item.site),
                rivalry(item, slot[0].probability),
                millimetres(item.rms_after_m),
                change(item.shrink),
            ]
            for item in slot
        ]
    heads = ('effect', 'against the likeliest', 'gap left', 'change')
    _print_table(console, 'candidates', heads, rows[:_MOST])


def _print_table(
    console: Console, title: str, heads: Sequence[str], rows: Sequence[Sequence[str]]
) -> None:
    """Print a table; where its longest words do not fit side by side, a paragraph for each row."""
    columns = list(zip(heads, *rows, strict=True))
    longest = [max(len(word) for cell in column for word in cell.split()) for column in columns]
    if sum(longest) + len(_BETWEEN) * (len(heads) - 1) <= console.width:
        table = Table(box=None, title=escape(title), title_justify='left', pad_edge=False)
        for head, width in zip(heads, longest, strict=True):
            table.add_column(head, header_style='dim', min_width=width)
        for row in rows:
            table.add_row(*(escape(cell) for cell in row))
        console.print(table)
        return
    console.print(f'[italic]{escape(title)}[/]')
    for first, *rest in rows:
        if first:
            console.print(escape(first))
        for head, cell in zip(heads[1:], rest, strict=True):
            console.print(Padding(f'[dim]{escape(head)}:[/] {escape(cell)}', (0, 0, 0, 2)))


def _print_sets(diagnosis: Diagnosis, console: Console) -> None:
    for group in open_sets(diagnosis):
        names = listed([site_name(site) for site in group], 'or')
        console.print(f'[yellow]cannot tell apart:[/] {escape(names)}')
