# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A diagnosis on the terminal: the verdict, what was found, what to do."""

from collections.abc import Sequence

from rich.console import Console
from rich.markup import escape
from rich.padding import Padding
from rich.table import Table

from weld_twin_core.diagnosis.result import Diagnosis

from .acceptance import rule_of
from .answer import Answer
from .cause_answer import LEVEL_HEADS
from .contact_clouds import contacts_sentence
from .sections import Demand

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
    answer = Answer(diagnosis, None if demand is None else rule_of(diagnosis, demand))
    first, second = answer.verdict
    colour = _COLOURS[diagnosis.status]
    console.print(f'[bold {colour}]{answer.status}[/]  {escape(first)}')
    console.print(Padding(escape(second), (0, 0, 1, 0)))
    for sentence in answer.mended:
        console.print(f'[bold yellow]mended before the diagnosis:[/] {escape(sentence)}')
    if not answer.sound:
        return
    _print_found(answer, console)
    if diagnosis.status == 'unknown' and diagnosis.causes:
        rows = [item.row for item in answer.causes[:_MOST]]
        _print_table(console, 'what is certain', LEVEL_HEADS, rows)
    elif sum(map(len, answer.alternatives)) > 1:
        rows = [list(other[:4]) for group in answer.alternatives for other in group]
        heads = ('effect', 'against the likeliest', 'gap left', 'change')
        _print_table(console, 'candidates', heads, rows[:_MOST])
    for names in answer.open:
        console.print(f'[yellow]cannot tell apart:[/] {escape(names)}')
    if answer.changed is not None and answer.changed.rows:
        _print_table(console, *answer.changed)
    elif answer.changed is not None:
        console.print(escape(answer.nothing_changed))
    _print_data(diagnosis, console)
    _print_holds(answer, console)
    for action in answer.to_do:
        console.print(f'[bold]do:[/] {escape(action)}')


def _print_data(diagnosis: Diagnosis, console: Console) -> None:
    for check in diagnosis.checks:
        if check.level == 'warning':
            console.print(f'[yellow]data:[/] {escape(check.sentence)}')
    for recording in diagnosis.recordings:
        for note in () if recording.contacts is not None else recording.notes:
            console.print(f'[dim]note:[/] {escape(recording.name)}: {escape(note)}')
    if diagnosis.contacts is not None:
        console.print(escape(contacts_sentence(diagnosis.contacts)))


def _print_holds(answer: Answer, console: Console) -> None:
    """Print where what is said holds, how wide it is beyond, and what the data left open."""
    holds = answer.holds
    if holds is None:
        return
    console.print(escape(holds.elsewhere))
    if holds.file:
        console.print(f'[yellow]files:[/] {escape(holds.file)}')
    for sentence in holds.open:
        console.print(f'[yellow]open:[/] {escape(sentence)}')


def _print_found(answer: Answer, console: Console) -> None:
    effects = answer.diagnosis.effects
    for title, heads, rows in answer.found:
        shown, more = rows, len(effects) - _MOST
        if not answer.diagnosis.families and more > 0:
            # Each effect begins with a row that has its name.
            begins = [k for k, (name, *_) in enumerate(rows) if name]
            shown = rows[: next(iter(begins[_MOST:]), None)]
        _print_table(console, title.lower(), heads, shown)
        if shown is not rows:
            console.print(f'and {more} more in effects.yaml')


def _print_table(
    console: Console, title: str, heads: Sequence[str], rows: Sequence[Sequence[str]]
) -> None:
    """Print a table; where its longest words do not fit side by side, a paragraph for each row."""
    heads = [head.lower() for head in heads]
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
