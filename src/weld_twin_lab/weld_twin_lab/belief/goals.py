# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What answers are worth on cases that nothing was learned from, beside the goals."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from operator import itemgetter
from typing import Any

import numpy as np

from ..blind.judging import NOT_IN_LIBRARY
from ..blind.measures import Measure, Question, measured
from ..blind.statistics import bootstrap

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
    single = _of('single')
    named = [r for r in rows if single(r) and r['status'] != 'none']
    seconds = [float(r['seconds']) for r in rows]
    return [
        *measured(CAUSES, rows),
        # The mean belief in the true family, as fault isolation benchmarks have it.
        *(
            Measure(key, title, bootstrap([float(r[of]) for r in named if of in r], np.mean), goal)
            for key, title, of, goal in FAMILY
        ),
        Measure('seconds', 'processor seconds of a diagnosis, median', bootstrap(seconds)),
        *measured(FOREIGN, rows),
    ]


def _of(*kinds: str) -> Callable[[Kept], bool]:
    """Return what tells cases of some kinds whose causes can all be seen."""
    return lambda row: row['kind'] in kinds and min(row['sizes']) >= SEEN


_known = _of('single', 'double', 'triple', 'several')


def _causes(count: int, least: float, *but: str) -> Callable[[Kept], bool]:
    """Return what tells cases with so many causes of the library, each as large as the least."""
    others = {*NOT_IN_LIBRARY, *but}

    def asked(row: Kept) -> bool:
        sizes = row['sizes']
        return len(sizes) == count and min(sizes) >= least and row['kind'] not in others

    return asked


def _foreign(row: Kept) -> bool:
    return row['kind'] in NOT_IN_LIBRARY


CAUSES = (
    Question(
        'sure_wrong',
        'sure and wrong',
        lambda row: True,
        lambda row: row['sure'] and not row['right'],
        0.002,
        False,
    ),
    Question(
        'single_sure',
        'one cause in the library, 1 noise or more: right and sure',
        _causes(1, SEEN),
        lambda row: row['right'] and row['sure'],
        0.70,
    ),
    Question(
        'single_cause_sure',
        'the same: its cause named, right and sure',
        _causes(1, SEEN),
        lambda row: any(
            kind == 'name' and right and sure for kind, _, right, _, sure in row['examples']
        ),
        0.80,
    ),
    Question('single_right', 'the same: right', _causes(1, SEEN), itemgetter('right')),
    Question(
        'oracle_sure',
        'one or two causes of which an oracle is sure: right and sure',
        lambda row: _known(row) and (row.get('oracle') or 0.0) >= ORACLE,
        lambda row: row['right'] and row['sure'],
        0.95,
    ),
    Question(
        'double_named',
        'two causes, each 3 noise: both named',
        _causes(2, PLAIN, 'ambiguous'),
        itemgetter('named'),
        0.90,
    ),
    Question(
        'triple_named',
        'three causes, each 3 noise: all named',
        _causes(3, PLAIN, 'ambiguous'),
        itemgetter('named'),
        0.85,
    ),
    Question(
        'needless_unknown',
        'causes in the library, 1 noise or more: needlessly unknown',
        _known,
        lambda row: row['status'] == 'unknown',
        0.03,
        False,
    ),
)
"""What is asked of causes that the library has."""
FAMILY = (
    ('fia', 'mean belief in the true family, one cause; a set counts whole', 'family', 0.92),
    ('fia_shared', 'the same, a set shared among its members', 'family_shared', 0.85),
)
"""What is believed of the family of a single cause: key, title, what of a case, goal."""
FOREIGN = (
    Question(
        'honest',
        'withheld or outside: unknown, a set that holds it, or as good on sealed data',
        _foreign,
        lambda row: row['honest'] or row['status'] == 'unknown',
        0.95,
    ),
    Question('place', 'the same: place right, first answer', _foreign, itemgetter('place'), 0.90),
    Question('dependence', 'the same: dependence right', _foreign, itemgetter('dependence'), 0.87),
)
"""The same of causes that it does not have."""
