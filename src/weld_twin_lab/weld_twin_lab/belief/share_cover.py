# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How often the interval of a share holds the true share, on cases that tell what that is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from statistics import median
from typing import Any, NamedTuple


class Held(NamedTuple):
    """
    A cause that was named rightly.

    Attributes
    ----------
    causes : int
        How many the case has.
    held : bool
        Whether the interval holds the true share.
    complete : bool
        Whether all causes of the case were named, and nothing else. Where one is missed or made
        up, the others hold what belongs to it.
    width : float
        Of the interval.

    """

    causes: int
    held: bool
    complete: bool
    width: float


def told_and_true(rows: Iterable[Mapping[str, Any]]) -> Iterator[Held]:
    """
    Yield every cause that was named rightly, in sound and rich cases whose frames are known.

    Parameters
    ----------
    rows : iterable of mapping
        Of `share_trial`, as `rows.read_rows` gives them.

    """
    for row in rows:
        if row.get('error'):
            continue
        true = row['shares']
        complete = {cause['site'] for cause in row['told']} == set(true)
        for cause in row['told']:
            if cause['site'] in true:
                low, high = cause['share_ci90']
                inside = low <= true[cause['site']] <= high
                yield Held(len(true), inside, complete, high - low)


def cover_table(held: Iterable[Held]) -> str:
    """Return a row for each number of causes, and one for all."""
    every = list(held)
    lines = [
        '| causes | shares | held by the 90 % interval | usual interval '
        '| all causes named, no other | held |',
        '|---|---|---|---|---|---|',
    ]
    for count in [*sorted({item.causes for item in every}), None]:
        own = [item for item in every if count in (None, item.causes)]
        complete = [item for item in own if item.complete]
        name = 'all' if count is None else count
        lines.append(
            f'| {name} | {len(own)} | {_part(own)} | {_usual(own)} '
            f'| {len(complete)} | {_part(complete)} |'
        )
    return '\n'.join(lines) + '\n'


def _part(held: list[Held]) -> str:
    return f'{100.0 * sum(item.held for item in held) / len(held):.0f} %' if held else '-'


def _usual(held: list[Held]) -> str:
    """Return half the median width."""
    return f'± {50.0 * median(item.width for item in held):.1f} %' if held else '-'
