# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What answers are worth on cases that nothing was learned from, beside the goals."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ..blind.judging import NOT_IN_LIBRARY
from ..blind.measures import Measure
from ..blind.statistics import Estimate, bootstrap, share

Kept = Mapping[str, Any]
SEEN, PLAIN = 1.0, 3.0
"""Effect RMS over noise from which a cause can be seen, and from which it is plain."""
ORACLE = 0.99
"""Probability from which the oracle is sure."""


def goal_measures(rows: Sequence[Kept]) -> list[Measure]:
    """
    Return the measures of verdicts and of levels.

    rows: as `judged.kept` gives them; none of them was learned from.
    """
    return [*_of_causes(rows), *_of_foreign(rows)]


def _of_causes(rows: Sequence[Kept]) -> list[Measure]:
    """Return the measures of causes that the library has."""
    single = [r for r in rows if r['kind'] == 'single' and min(r['sizes']) >= SEEN]
    lone = [r for r in rows if len(r['sizes']) == 1 and min(r['sizes']) >= SEEN]
    lone = [r for r in lone if r['kind'] not in NOT_IN_LIBRARY]
    known = [r for r in rows if r['kind'] in ('single', 'double', 'triple', 'several')]
    known = [r for r in known if min(r['sizes']) >= SEEN]
    return [
        _measure('sure_wrong', 'sure and wrong', rows, _sure_and_wrong, 0.002, least=False),
        _measure(
            'single_sure',
            'one cause in the library, 1 noise or more: right and sure',
            lone,
            lambda r: r['right'] and r['sure'],
            0.70,
        ),
        _measure('single_right', 'the same: right', lone, lambda r: r['right']),
        _measure(
            'oracle_sure',
            'one or two causes of which an oracle is sure: right and sure',
            [r for r in known if (r.get('oracle') or 0.0) >= ORACLE],
            lambda r: r['right'] and r['sure'],
            0.95,
        ),
        _measure('double_named', 'two causes, each 3 noise: both named', *_several(rows, 2, 0.90)),
        _measure(
            'triple_named', 'three causes, each 3 noise: all named', *_several(rows, 3, 0.85)
        ),
        _measure(
            'needless_unknown',
            'causes in the library, 1 noise or more: needlessly unknown',
            known,
            lambda r: r['status'] == 'unknown',
            0.03,
            least=False,
        ),
        Measure('fia', 'mean belief in the true family, one cause', _fia(single), 0.92),
        Measure('seconds', 'processor seconds of a diagnosis, median', _seconds(rows)),
    ]


def _of_foreign(rows: Sequence[Kept]) -> list[Measure]:
    """Return the measures of causes that the library does not have."""
    foreign = [r for r in rows if r['kind'] in NOT_IN_LIBRARY]
    return [
        _measure(
            'honest',
            'withheld or outside: unknown, a set that holds it, or as good on sealed data',
            foreign,
            lambda r: r['honest'] or r['status'] == 'unknown',
            0.95,
        ),
        _measure(
            'place', 'the same: place right, first answer', foreign, lambda r: r['place'], 0.90
        ),
        _measure(
            'dependence', 'the same: dependence right', foreign, lambda r: r['dependence'], 0.87
        ),
    ]


def _measure(
    key: str,
    title: str,
    rows: Sequence[Kept],
    hit: Callable[[Kept], bool],
    goal: float | None = None,
    *,
    least: bool = True,
) -> Measure:
    return Measure(key, title, share([bool(hit(row)) for row in rows]), goal, least)


def _sure_and_wrong(row: Kept) -> bool:
    return bool(row['sure'] and not row['right'])


def _several(
    rows: Sequence[Kept], count: int, goal: float
) -> tuple[list[Kept], Callable[[Kept], bool], float]:
    own = [r for r in rows if len(r['sizes']) == count and min(r['sizes']) >= PLAIN]
    own = [r for r in own if r['kind'] not in (*NOT_IN_LIBRARY, 'ambiguous')]
    return own, lambda row: row['named'], goal


def _fia(rows: Sequence[Kept]) -> Estimate:
    """Return the mean belief in the true family, as fault isolation benchmarks have it."""
    return bootstrap([float(r['family']) for r in rows if r['status'] != 'none'], np.mean)


def _seconds(rows: Sequence[Kept]) -> Estimate:
    return bootstrap([float(r['seconds']) for r in rows])
