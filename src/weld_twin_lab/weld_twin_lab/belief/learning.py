# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Belief fitted to examples: weights of each level, judged on cases that took no part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.trust.model import (
    AS_LOGIT,
    FROM,
    LEVELS_BACK,
    PRESENT,
    SCHEMA,
    Trust,
    comes_back,
    taken,
    trust_from,
    with_products,
)

from ..blind.statistics import calibration_error
from .bound import Bound, at, bounded
from .judged import Example
from .logistic import Weights, fitted, log_loss
from .terms import BENT, BENT_LEVELS, RANGES, TERMS

RIDGES = (3.0, 10.0, 30.0, 100.0)
"""Ridges tried, in nats for weights one away from the prior: from as free as a few hundred cases
allow to hardly moved. The one that predicts unseen folds best is taken."""
FOLDS = 8
"""Parts of the cases that take turns in being unseen."""
NOTHING = Bound(1.0, 0, 0, 1.0, 1.0, 0.0)
"""What is known of a threshold before there is one."""
FEWEST = 20
"""Examples of a level from which on it is learned at all."""
FEWEST_NAMED = 5
"""Examples in which a family is named from which on its name is a sign at all."""
RISK = 0.01
"""Probability that an answer may be sure and wrong."""
LEVEL_RISK = 0.02
"""The same of a place, a dependence or a name, where the answer as a whole need not be sure. What
is told of them is to be as often right as it says; below 1 % most of them would be told as less
than they are, and above 2 % nothing more is gained."""
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
    """Examples of one level: probabilities unseen, what was right, told, may be sure; the bound."""

    unseen: Array
    right: NDArray[np.bool_]
    told: Array
    may: NDArray[np.bool_]
    bound: Bound

    @property
    def bounded(self) -> Array:
        """Return the probabilities that a threshold is asked of."""
        return np.where(self.may, self.unseen, np.minimum(self.unseen, TOLD_UNSURE))


class Table(NamedTuple):
    """Examples of one level as columns: signs as they enter, what was right, weights, folds."""

    names: list[str]
    values: Array
    right: Array
    weight: Array
    folds: Array


def learned(
    examples: Sequence[Example], card: Mapping[str, Any], risk: float = RISK
) -> dict[str, Any]:
    """
    Return the content of a belief file.

    Parameters
    ----------
    examples : sequence of Example
    card : mapping
        Seeds, engines and mix, to be kept with the weights.
    risk : float
        Probability that an answer may be sure and wrong.

    """
    levels: dict[str, Level] = {}
    parts: dict[str, Part] = {}
    for name in TERMS:
        own = [e for e in examples if e.level == name]
        if len(own) >= FEWEST:
            levels[name] = _level(own, name)
            told, right = (np.array([getattr(e, key) for e in own]) for key in ('told', 'right'))
            may = np.array([_may_be_sure(e) for e in own])
            parts[name] = Part(levels[name].unseen, right, told, may, NOTHING)
    parts = _together(parts, risk)
    return {
        'schema': SCHEMA,
        'card': {
            **card,
            'risk': risk,
            'bounds': {name: _told(part.bound, name, risk) for name, part in parts.items()},
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
    sure = np.concatenate([_sure(part) for part in parts])
    return {
        name: {
            'ece': round(
                float(calibration_error(list(p), list(map(bool, right))).value or 0.0), 4
            ),
            'sure_and_wrong': round(float((is_sure & ~right).mean()), 4),
            'sure': round(float(is_sure.mean()), 4),
        }
        for name, p, is_sure in (
            ('by hand', before, before > TOLD_UNSURE),
            ('learned', learned, sure),
        )
    }


def _sure(part: Part) -> NDArray[np.bool_]:
    """Return which examples are told as sure."""
    return np.asarray(part.may & (part.unseen >= part.bound.sure_from))


def _together(parts: Mapping[str, Part], risk: float) -> dict[str, Part]:
    """
    Return examples with their bounds: one threshold for all groups of a level.

    What counts is how often any answer is sure and wrong. As probabilities mean the same in every
    group, one threshold for all gives the most sure answers for that.
    """
    out = {}
    for level in dict.fromkeys(name.split()[0] for name in parts):
        own = {name: part for name, part in parts.items() if name.split()[0] == level}
        p, right = (
            np.concatenate([getattr(part, key) for part in own.values()])
            for key in ('bounded', 'right')
        )
        most = bounded(p, right, risk if level == 'answer' else max(risk, LEVEL_RISK))
        for name, part in own.items():
            here = at(most.sure_from, part.bounded, part.right)
            out[name] = part._replace(bound=here._replace(expected=most.expected))
    return out


def _may_be_sure(example: Example) -> bool:
    return example.level.split()[0] not in LEVELS_BACK or comes_back(example.signs)


def _told(bound: Bound, name: str, risk: float) -> dict[str, Any]:
    own = risk if name.startswith('answer ') else max(risk, LEVEL_RISK)
    return {**bound._asdict(), 'risk': own}


def _level(examples: Sequence[Example], name: str) -> Level:
    table = _table(examples, name)
    ways = np.array([TERMS[name][sign.partition(FROM)[0]] for sign in table.names], dtype=float)
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
            'low': round(float(np.nanmin(table.values[:, k])), 5),
            'high': round(float(np.nanmax(table.values[:, k])), 5),
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
    names = [
        sign
        for sign in names
        if sign.startswith(PRESENT) or sum(sign in s for s in signs) >= FEWEST
    ]
    columns = [np.array([entered(s, sign) for s in signs]) for sign in names]
    if name.split()[1] in BENT_LEVELS:
        pieces = [(n, c) for n, c in zip(names, columns, strict=True) if n in BENT]
        for sign, column in pieces:
            for low, high in _pieces(column):
                names.append(f'{sign}{FROM}{low:.3g}')
                columns.append(np.clip(column, low, high))
    values = np.array(columns).T
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
    Return a sign as it enters, cut to what can tell anything; not a number where it is missing.

    Parameters
    ----------
    signs : mapping from str to float
    sign : str

    """
    low, high = RANGES.get(sign, (-np.inf, np.inf))
    missing = 0.0 if sign.startswith(PRESENT) else np.nan
    return float(np.clip(taken(sign, signs[sign]), low, high)) if sign in signs else missing


def _pieces(column: Array) -> list[tuple[float, float]]:
    """Return the thirds of a sign's examples, from where to where; none where few values occur."""
    known = column[~np.isnan(column)]
    ends = np.quantile(known, (0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0)) if known.size else np.zeros(4)
    many = np.unique(known).size >= FEWEST
    return [(float(a), float(b)) for a, b in pairwise(ends) if many and b - a > 1e-3]


def _scattered(case: str) -> str:
    """Return a key that puts neighbouring cases into different folds."""
    return case[::-1]


def _scaling(values: Array) -> tuple[Array, Array]:
    """Return middle and spread of every sign where it is known."""
    spread = np.nanstd(values, axis=0)
    return np.nanmean(values, axis=0), np.where(spread > 1e-9, spread, 1.0)


def _weights(table: Table, ways: Array, ridge: float, middle: Array, spread: Array) -> Weights:
    # A sign that is missing counts as at its middle.
    columns = np.nan_to_num((table.values - middle) / spread)
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
        low, high = np.nanmin(rest.values, axis=0), np.nanmax(rest.values, axis=0)
        columns = np.nan_to_num((np.clip(table.values[here], low, high) - middle) / spread)
        out[here] = 1.0 / (1.0 + np.exp(-(weights.bias + columns @ weights.slopes)))
    return out


def _limits(table: Table) -> tuple[float, float]:
    """Return the probabilities that so many cases allow: one more case might be another."""
    count = float(table.weight.sum()) + 2.0
    return round(1.0 / count, 4), round(1.0 - 1.0 / count, 4)
