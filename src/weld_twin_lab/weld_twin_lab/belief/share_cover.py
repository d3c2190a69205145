# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How often the interval of a share holds the true share, on cases that tell what that is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from weld_twin_core.diagnosis.levels.causes import covering
from weld_twin_core.diagnosis.result import Cause


class Held(NamedTuple):
    """How many causes the case has, and whether the interval of one of them holds its share."""

    causes: int
    held: bool


def told_and_true(rows: Iterable[Mapping[str, Any]]) -> Iterator[Held]:
    """
    Yield every cause that was named, in sound and rich cases whose frames are known.

    Parameters
    ----------
    rows : iterable of mapping
        As `rows.read_rows` gives them: of `share_trial`, or of belief. The latter say how large
        each cause is alone, which is its share where it is the only one.

    """
    for row in rows:
        if row.get('error'):
            continue
        if 'shares' in row:
            yield from _of_several(row)
        else:
            yield from _of_one(row)


def _of_several(row: Mapping[str, Any]) -> Iterator[Held]:
    true = row['shares']
    for cause in row['told']:
        if cause['site'] in true:
            low, high = cause['share_ci90']
            yield Held(len(true), low <= true[cause['site']] <= high)


def _of_one(row: Mapping[str, Any]) -> Iterator[Held]:
    truth = row['truth']
    ratios = truth.get('ratios')
    if not ratios or len(ratios) > 1 or row['poor'] or truth['align']:
        return
    # A ratio is that of the cause to the noise, as RMS of the whole deviation.
    true = ratios[0] ** 2 / (ratios[0] ** 2 + 1.0)
    for cause in row['verdict']['causes']:
        first = [(n['effect'], n['joint']) for n in cause['name']][:1]
        if first == [tuple(truth['sites'][0])]:
            yield Held(1, _holds(cause['share_ci90'], true))


def _holds(interval: Iterable[float], true: float) -> bool:
    # Tables of belief have what stretches tell; the answer adds what they share.
    low, high = covering(Cause((), (), (), true, tuple(interval))).share_ci90  # type: ignore[arg-type]
    return low <= true <= high


def cover_table(held: Iterable[Held]) -> str:
    """Return a row for each number of causes, and one for all."""
    every = list(held)
    lines = ['| causes | shares | held by the 90 % interval |', '|---|---|---|']
    for count in [*sorted({item.causes for item in every}), None]:
        own = [item.held for item in every if count in (None, item.causes)]
        part = f'{100.0 * sum(own) / len(own):.0f} %' if own else '-'
        lines.append(f'| {"all" if count is None else count} | {len(own)} | {part} |')
    return '\n'.join(lines) + '\n'
