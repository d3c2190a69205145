# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Results in words: lines for the terminal, a table for a page."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from weld_twin_msgs_py.files import markdown

from .kinematics import OWN
from .race import REFERENCE, Outcome

UNITS = ((1.0, 's'), (1e-3, 'ms'), (1e-6, 'us'), (1e-9, 'ns'))
"""Units of time, the largest that a figure reaches is used."""
LEFT_OUT = 'N = 1,000'
"""End of the titles that the brief table goes without."""


def lines(outcome: Outcome) -> Iterator[str]:
    """Yield a line for the workload and one for each contender."""
    load = outcome.workload
    yield f'{load.title} (per {load.item}; times: {REFERENCE} / contender)'
    for contender in load.contenders:
        seconds = float(np.median(outcome.seconds[contender.name]))
        yield f'  {contender.name:<26} {duration(seconds):>10}  {times(outcome, contender.name)}'
    if load.note:
        yield f'  {load.note}'


def page(outcomes: list[Outcome]) -> str:
    """Return a table in Markdown: own time, and times as fast as the reference and the others."""
    rows = [('workload', 'time', 'times as fast as', 'and as the others')]
    for outcome in outcomes:
        load = outcome.workload
        own = outcome.seconds[OWN]
        others = [
            f'{c.name} {short(np.median(outcome.seconds[c.name]) / np.median(own))}'
            for c in load.contenders
            if c.name not in (OWN, REFERENCE)
        ]
        rows.append(
            (
                load.title,
                f'{duration(float(np.median(own)))} per {load.item}',
                f'{REFERENCE}: **{times(outcome, OWN)}**',
                ', '.join(others),
            )
        )
    return markdown.table(*rows)


def brief(outcomes: list[Outcome]) -> str:
    """Return a shorter table, without ranges and small batches."""
    rows = [('one thread, in one run', 'times as fast')]
    for outcome in outcomes:
        load, ratio = outcome.workload, outcome.ratio(OWN)
        if ratio is not None and not load.title.endswith(LEFT_OUT):
            rows.append((load.title, f'{short(float(np.median(ratio)))} ({REFERENCE})'))
    return markdown.table(*rows)


def times(outcome: Outcome, name: str) -> str:
    """Return the median ratio and its range over the rounds."""
    ratio = outcome.ratio(name)
    if ratio is None:
        return '-'
    return f'{short(np.median(ratio))} ({short(ratio.min())} to {short(ratio.max())})'


def short(ratio: float) -> str:
    """Return a ratio with three digits, or all before the point."""
    return f'{ratio:,.0f}' if ratio >= 100.0 else f'{ratio:.3g}'


def duration(seconds: float) -> str:
    """Return seconds with a fitting unit."""
    scale, unit = next((u for u in UNITS if seconds >= u[0]), UNITS[-1])
    return f'{seconds / scale:.3g} {unit}'
