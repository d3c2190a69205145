# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Belief fitted to examples: weights of each level, judged on cases that took no part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.trust.model import (
    AS_LOGIT,
    PRESENT,
    SCHEMA,
    Trust,
    taken,
    trust_from,
    with_products,
)

from ..blind.statistics import calibration_error
from .bound import Bound, bounded
from .judged import Example
from .logistic import Weights, fitted, log_loss
from .terms import RANGES, TERMS

RIDGES = (3.0, 10.0, 30.0, 100.0, 300.0)
"""Ridges tried, in nats for weights one away from the prior: from as free as a few hundred cases
allow to hardly moved. The one that predicts unseen folds best is taken."""
FOLDS = 8
"""Parts of the cases that take turns in being unseen."""
FEWEST = 20
"""Examples of a level from which on it is learned at all."""
FEWEST_NAMED = 5
"""Examples in which a family is named from which on its name is a sign at all."""
RISK = 0.01
"""Probability that a case may be sure and wrong."""
TOLD_UNSURE = 0.8
"""What is not sure by the bound is told as this at the most; above it counts as sure."""
BEFORE = frozenset({'belief', 'place', 'dependence', 'name'})
"""Signs that are what was believed before: the ridge pulls towards taking them as they are."""


class Level(NamedTuple):
    """
    What was learned of one level.

    Attributes
    ----------
    content : dict
        Its entry of the belief file.
    unseen : array, shape (N,)
        Probability of each example by weights fitted without its case.

    """

    content: dict[str, Any]
    unseen: Array


class Part(NamedTuple):
    """Examples of one level: probabilities unseen, what was right, what was told, the bound."""

    unseen: Array
    right: Array
    told: Array
    bound: Bound


class Table(NamedTuple):
    """Examples of one level as columns: signs as they enter, what was right, weights, folds."""

    names: list[str]
    values: Array
    right: Array
    weight: Array
    folds: Array


def learned(examples: Sequence[Example], card: Mapping[str, Any]) -> dict[str, Any]:
    """
    Return the content of a belief file.

    Parameters
    ----------
    examples : sequence of Example
    card : mapping
        Seeds, engines and mix, to be kept with the weights.

    """
    levels: dict[str, Level] = {}
    parts: dict[str, Part] = {}
    for name in TERMS:
        own = [e for e in examples if e.level == name]
        if len(own) >= FEWEST:
            levels[name] = _level(own, name)
            told, right = (np.array([getattr(e, key) for e in own]) for key in ('told', 'right'))
            bound = bounded(levels[name].unseen, right, RISK)
            parts[name] = Part(levels[name].unseen, right, told, bound)
    return {
        'schema': SCHEMA,
        'card': {
            **card,
            'bounds': {name: _told(part.bound) for name, part in parts.items()},
            'unseen': {
                level: _unseen_worth([p for n, p in parts.items() if n.startswith(f'{level} ')])
                for level in dict.fromkeys(name.split()[0] for name in parts)
            },
        },
        'sure_from': {name: part.bound.sure_from for name, part in parts.items()},
        'told_unsure': TOLD_UNSURE,
        'levels': {name: level.content for name, level in levels.items()},
    }


def trust_of(examples: Sequence[Example]) -> Trust:
    """Return what examples teach, ready to be asked."""
    return trust_from(learned(examples, {}))


def _unseen_worth(parts: Sequence[Part]) -> dict[str, Any]:
    """Return what beliefs are worth, each by weights that had not seen its case."""
    learned, right, before = (np.concatenate([part[k] for part in parts]) for k in range(3))
    told = np.concatenate([_capped(part) for part in parts])
    return {
        name: {
            'ece': round(
                float(calibration_error(list(p), list(map(bool, right))).value or 0.0), 4
            ),
            'sure_and_wrong': round(float(((p > TOLD_UNSURE) & ~right).mean()), 4),
            'sure': round(float((p > TOLD_UNSURE).mean()), 4),
        }
        for name, p in (('by hand', before), ('learned', learned), ('told', told))
    }


def _capped(part: Part) -> Array:
    """Return what is told: no more than `TOLD_UNSURE` where it is not sure."""
    return np.where(
        part.unseen >= part.bound.sure_from, part.unseen, np.minimum(part.unseen, TOLD_UNSURE)
    )


def _told(bound: Bound) -> dict[str, Any]:
    return {**bound._asdict(), 'risk': RISK}


def _level(examples: Sequence[Example], name: str) -> Level:
    table = _table(examples, name)
    ways = np.array([TERMS[name][sign] for sign in table.names], dtype=float)
    tried = [(_unseen(table, ways, ridge), ridge) for ridge in RIDGES]
    unseen, ridge = min(tried, key=lambda item: log_loss(item[0], table.right, table.weight))
    middle, spread = _scaling(table.values)
    weights = _weights(table, ways, ridge, middle, spread)
    least, most = _limits(table)
    terms = {
        sign: {
            'weight': round(float(slope), 5),
            'middle': round(float(middle[k]), 5),
            'spread': round(float(spread[k]), 5),
            'low': round(float(table.values[:, k].min()), 5),
            'high': round(float(table.values[:, k].max()), 5),
        }
        for k, (sign, slope) in enumerate(zip(table.names, weights.slopes, strict=True))
        if abs(slope) > 1e-4
    }
    content = {
        'bias': round(weights.bias, 5),
        'least': least,
        'most': most,
        'cases': len({e.case for e in examples}),
        'examples': len(examples),
        'right': int(table.right.sum()),
        'ridge': ridge,
        'terms': terms,
    }
    return Level(content, np.clip(unseen, least, most))


def _table(examples: Sequence[Example], name: str) -> Table:
    signs = [with_products(e.signs) for e in examples]
    names = [
        sign
        for sign in TERMS[name]
        if not sign.startswith(PRESENT) or sum(sign in s for s in signs) >= FEWEST_NAMED
    ]
    values = np.array([[entered(s, sign) for sign in names] for s in signs])
    cases = [e.case for e in examples]
    counts = {case: cases.count(case) for case in set(cases)}
    places = {case: k for k, case in enumerate(sorted(counts, key=_scattered))}
    return Table(
        names,
        values,
        np.array([e.right for e in examples]),
        np.array([1.0 / counts[case] for case in cases]),
        np.array([places[case] % FOLDS for case in cases]),
    )


def entered(signs: Mapping[str, float], sign: str) -> float:
    """
    Return a sign as it enters, cut to what can tell anything.

    Parameters
    ----------
    signs : mapping from str to float
    sign : str

    """
    low, high = RANGES.get(sign, (-np.inf, np.inf))
    return float(np.clip(taken(sign, signs.get(sign, 0.0)), low, high))


def _scattered(case: str) -> str:
    """Return a key that puts neighbouring cases into different folds."""
    return case[::-1]


def _scaling(values: Array) -> tuple[Array, Array]:
    spread = values.std(axis=0)
    return values.mean(axis=0), np.where(spread > 1e-9, spread, 1.0)


def _weights(table: Table, ways: Array, ridge: float, middle: Array, spread: Array) -> Weights:
    columns = (table.values - middle) / spread
    prior = np.array(
        [
            spread[k] if name in BEFORE and name in AS_LOGIT else 0.0
            for k, name in enumerate(table.names)
        ]
    )
    return fitted(columns, table.right, ways, prior, ridge, table.weight)


def _unseen(table: Table, ways: Array, ridge: float) -> Array:
    """Return the probability of each example by weights fitted on the other folds."""
    out = np.zeros(len(table.right))
    for fold in range(FOLDS):
        here = table.folds == fold
        rest = Table(table.names, *(column[~here] for column in table[1:]))
        middle, spread = _scaling(rest.values)
        weights = _weights(rest, ways, ridge, middle, spread)
        low, high = rest.values.min(axis=0), rest.values.max(axis=0)
        columns = (np.clip(table.values[here], low, high) - middle) / spread
        out[here] = 1.0 / (1.0 + np.exp(-(weights.bias + columns @ weights.slopes)))
    return out


def _limits(table: Table) -> tuple[float, float]:
    """Return the probabilities that so many cases allow: one more case might be another."""
    count = float(table.weight.sum()) + 2.0
    return round(1.0 / count, 4), round(1.0 - 1.0 / count, 4)
