# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How often the interval of a share holds the true share, on cases that tell what that is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from weld_twin_core.diagnosis.levels.causes import covering
from weld_twin_core.diagnosis.result import Cause

ADD_UP = 0.05
"""Part by which the squares of several causes and of the noise may miss the squared gap: causes that
overlap more than that have no share of their own."""


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
        As `rows.read_rows` gives them.

    """
    for row in rows:
        truth = row['truth'] if not row.get('error') else {}
        ratios = truth.get('ratios')
        if not ratios or row['poor'] or truth['align']:
            continue
        # A ratio is that of the cause to the noise, as RMS of the whole deviation.
        whole = sum(ratio**2 for ratio in ratios) + 1.0
        if len(ratios) > 1 and not _adds_up(row, whole):
            continue
        true = {
            tuple(site): ratio**2 / whole
            for site, ratio in zip(truth['sites'], ratios, strict=False)
        }
        for cause in row['verdict']['causes']:
            first = [(n['effect'], n['joint']) for n in cause['name']][:1]
            if first and first[0] in true:
                yield Held(len(ratios), _holds(cause['share_ci90'], true[first[0]]))


def _adds_up(row: Mapping[str, Any], whole: float) -> bool:
    gap = row['signs'].get('gap')
    return gap is not None and abs(10.0 ** (2.0 * gap) / whole - 1.0) <= ADD_UP


def _holds(interval: Iterable[float], true: float) -> bool:
    # Tables have what stretches tell; the answer adds what they share.
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
