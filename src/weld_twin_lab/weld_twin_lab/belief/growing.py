# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a recording more of the same truth does to an answer, and what the order of recordings does.

More data never hurts: a cause that was sure and right stays so with another recording, and no
answer hangs on which recording was given first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from weld_twin_msgs_py.files import markdown

from ..blind.ambiguous import Site
from ..blind.blind_cell import take
from ..blind.making import MOTIONS_OF, truth_of
from ..blind.statistics import share
from ..study import tabled
from .levels_of_truth import alike_by_structure
from .mix import SEVERAL, SPANS, drawn
from .trial import diagnosed, recordings_of, said

MOST = 4
"""Recordings of a cell at the most."""
FALL = 0.1
"""Probability that a sure cause may lose by a recording more."""
SAME = 1e-6
"""Probability by which answers on the same recordings in another order may differ."""


def grown(seed: int, number: int) -> dict[str, Any]:
    """
    Return what is said of a cell with one recording, two, ..., and with all in reverse.

    seed, number: of the cell, as `mix.drawn` takes them.
    """
    name = f'{seed}/{number}'
    try:
        case = drawn(seed, number, SEVERAL).case
    except Exception as error:
        return {'name': name, 'error': f'not drawn: {error}'}
    rng = np.random.default_rng([seed, 7000 + number])
    kinds = MOTIONS_OF.get(case.lot.motion, (case.lot.motion,))
    first = 1 + len(case.also)
    more = [
        take(case.cell, kinds[k % len(kinds)], float(rng.uniform(*SPANS)), rng)
        for k in range(first, MOST)
    ]
    recordings = recordings_of(case, more)
    orders = [*(range(k + 1) for k in range(MOST)), range(MOST)[::-1]]
    try:
        answers = [said(diagnosed(case, [recordings[k] for k in order])) for order in orders]
    except Exception as error:
        return {'name': name, 'error': f'{type(error).__name__}: {error}'}
    kept = [{key: one[key] for key in ('verdict', 'model', 'unsound')} for one in answers]
    truth = truth_of(name, case)
    return {'name': name, 'error': None, 'truth': truth, 'told': kept[:-1], 'turned': kept[-1]}


class GrowingStep(NamedTuple):
    """
    A cause that was sure and right, before and after a recording more.

    ``after`` is 0 where no reported set holds the cause any more; ``sure`` tells whether it still is.
    """

    name: str
    recordings: int
    cause: Site
    before: float
    after: float
    sure: bool

    @property
    def fell(self) -> bool:
        """Return whether it lost much."""
        return self.after < self.before - FALL


def steps(row: Mapping[str, Any]) -> Iterator[GrowingStep]:
    """
    Yield every right cause that was sure, with what a recording more made of it.

    row: as `grown` gives it, without an error.
    """
    truth = row['truth']
    for effect, joint in truth['sites']:
        alike = alike_by_structure(truth['robot'], (effect, joint))
        beliefs = [_of(one['verdict'], alike) for one in row['told']]
        for k, ((before, sure), (after, still)) in enumerate(pairwise(beliefs)):
            if sure:
                yield GrowingStep(row['name'], k + 1, (effect, joint), before, after, still)


def _of(verdict: Mapping[str, Any], alike: frozenset[Site]) -> tuple[float, bool]:
    """Return how probable a cause is reported, by its whole set, and whether it is sure."""
    best = (0.0, False)
    for cause in verdict['causes']:
        names = {(item['effect'], item['joint']) for item in cause['name']}
        if names & alike:
            best = max(best, (float(cause['probability']), bool(cause['sure'])))
    return best


def apart(row: Mapping[str, Any]) -> float:
    """
    Return by how much probabilities differ where only the order does; 1 where names do.

    row: as `grown` gives it, without an error.
    """
    one, other = (
        {
            (
                frozenset((i['effect'], i['joint']) for i in cause['name']),
                bool(cause.get('rest')),
            ): (cause['probability'] or 0.0)
            for cause in answer['verdict']['causes']
        }
        for answer in (row['told'][-1], row['turned'])
    )
    if one.keys() != other.keys() or row['told'][-1]['unsound'] != row['turned']['unsound']:
        return 1.0
    return max((abs(p - other[key]) for key, p in one.items()), default=0.0)


def page(rows: Sequence[Mapping[str, Any]]) -> str:
    """
    Return the measures, and every sure cause that fell.

    rows: as `grown` gives them.
    """
    good = [row for row in rows if not row['error']]
    every = [step for row in good for step in steps(row)]
    measures = {
        'sure causes that fall by more than 0.1': share([step.fell for step in every]),
        'sure causes that lose their name': share([step.after == 0.0 for step in every]),
        'sure causes that are sure no longer': share([not step.sure for step in every]),
        'cells whose order changes a name': share([apart(row) == 1.0 for row in good]),
        'cells whose order moves a probability': share([apart(row) > SAME for row in good]),
    }
    lines = [(key, str(value)) for key, value in measures.items()]
    fallen = [step for step in every if step.fell]
    lost = '\n' + tabled(FALLEN, fallen) if fallen else ''
    return markdown.table(('measure', 'value'), *lines) + lost


FALLEN: dict[str, Callable[[GrowingStep], object]] = {
    'cell': attrgetter('name'),
    'recordings': attrgetter('recordings'),
    'cause': lambda step: f'{step.cause[0]} of {step.cause[1]}',
    'sure with': lambda step: f'{step.before:.2f}',
    'one more': lambda step: f'{step.after:.2f}',
}
"""Columns of the table of sure causes that fell."""
