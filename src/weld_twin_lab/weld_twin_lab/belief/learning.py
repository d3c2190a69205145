# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Weights of the calibration fitted to examples, and from where on a statement is sure.

Weights are logistic regression with a ridge, bounded on one side of zero where a sign is good or bad
news: chance in a few hundred cases may not turn it round.

What is sure is told by conformal risk control [1]_: of N cases that took no part in the fit, the lowest
threshold is taken at which (wrong and sure + 1) / (N + 1) stays below the risk. One more case,
exchangeable with these, is then sure and wrong with at most that probability. How far the share itself
may be off is told by the exact binomial limit [2]_.

References
----------
.. [1] A. Angelopoulos, S. Bates, A. Fisch, L. Lei, T. Schuster, "Conformal risk control", ICLR
   2024.
.. [2] C. Clopper, E. Pearson, "The use of confidence or fiducial limits illustrated in the case
   of the binomial", Biometrika 26, 1934.

"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.stats import beta

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.calibration.features import ONLY, TOLD_AS, of_whole
from weld_twin_core.diagnosis.calibration.weights import SCHEMA
from weld_twin_core.errors import DataError

from .judged import Example

RISK, CAUSE_RISK = 0.003, 0.01
"""Probability that an answer is sure and wrong, and that a cause told as sure is wrong."""


def _terms(text: str) -> dict[str, int]:
    """Return features by which way each counts: + for a statement, - against it, 0 either way."""
    pairs = (part.split(' ', 1) for part in text.split(', '))
    return {name: {'+': 1, '-': -1, '0': 0}[sign] for sign, name in pairs}


SUMMED = _terms('+ names, + least name, 0 told, 0 least size, 0 widest set')
"""What the names told add up to."""
NAMED = {
    **{name: way for name, way in SUMMED.items() if name != 'least size'},
    **_terms(
        '0 gap, - structure, 0 rows, 0 stations, - lacking, - cancelling, - left, '
        '- left unexplained, - instrument and base'
    ),
}
"""What speaks for an answer that names causes; against it speaks that one of them has no name."""
MANY = _terms(
    '+ growth, + least growth, + size over left, 0 rows, - structure, + kinds, - lacking'
)
"""What speaks for a kind of many small errors."""
REST = _terms('+ weight, - second, + share, + steady, 0 groups, 0 gap, 0 rows, 0 stations')
TERMS: dict[str, dict[str, int]] = {
    'name': _terms(
        '+ gap, - instrument and base, - left unexplained, - structure, 0 rows, + joints moving, '
        '0 stations, - lacking, - behind, - cancelling, + weight, + evidence, + size, '
        '- faint beside others, - others of its curve, - part of a wave, - wander over size, '
        '+ missed, + least missed, + shown beside others, - left at its joint, 0 constant, 0 angle'
    ),
    'place': _terms('+ weight of the place, + size, 0 gap, 0 wander'),
    'dependence': _terms('+ weight of the dependence, 0 rows, 0 constant, 0 angle, 0 wander'),
    # A set with more names is likelier to hold the right one.
    'name of many': {**MANY, **_terms('+ low growth, + members')},
    'place of many': MANY,
    'dependence of many': MANY,
    'place of the rest': REST,
    'dependence of the rest': REST,
    'complete': {
        **_terms('- left, - left unexplained, - structure, 0 gap, 0 hardly a gap'),
        **{f'told as {one}': 0 for one in TOLD_AS},
        **SUMMED,
    },
    'nameless': {name: -way for name, way in NAMED.items()},
    'answer, named': {**NAMED, **_terms('- a wide set, - one faint beside others')},
    'answer, unknown': {
        **_terms(
            '0 gap, 0 left unexplained, 0 hardly a gap, 0 groups, 0 no group, + steady, 0 rows, '
            '0 stations, + structure, + lacking'
        ),
        **SUMMED,
    },
    'answer, none': _terms('- structure, 0 rows, - left'),
    'answer, many': _terms('- structure, - lacking, 0 gap, + least name, 0 told'),
}
"""By kind of statement, as `weld_twin_core.diagnosis.calibration.features.KINDS` lists them."""
OF_FAMILIES = frozenset({'name', 'nameless'})
"""Kinds of statements that each family named alone is a feature of: some imitate others often."""


class Weights(NamedTuple):
    """Bias and weights, on columns of mean zero and spread one."""

    bias: float
    slopes: Array


def fitted(
    columns: Array,
    right: Array | NDArray[np.bool_],
    signs: Array,
    ridge: float,
    weight: Array,
    prior: Array | None = None,
    near: Weights | None = None,
) -> Weights:
    """
    Return the weights of least penalised log loss.

    columns: standardised, shape (N, P).
    signs: 1 where a weight may not be negative, -1 where it may not be positive, 0 where it is free.
    ridge: of half the squared distance from the prior, else zeros, against log loss in nats.
    near: weights to begin with, where those of nearly the same examples are known.
    """
    prior = np.zeros(columns.shape[1]) if prior is None else prior
    # One more case of each outcome, with every sign at its middle: few cases are never certain.
    columns = np.concatenate([columns, np.zeros((2, columns.shape[1]))])
    target = np.concatenate([np.asarray(right, dtype=float), [0.0, 1.0]])
    weight = np.concatenate([weight, [1.0, 1.0]])
    share = float(np.clip((weight * target).sum() / weight.sum(), 0.02, 0.98))

    def loss(x: Array) -> tuple[float, Array]:
        odds = x[0] + columns @ x[1:]
        off = x[1:] - prior
        value = (weight * (np.logaddexp(0.0, odds) - target * odds)).sum()
        error = weight * (1.0 / (1.0 + np.exp(-odds)) - target)
        slope = np.concatenate([[error.sum()], columns.T @ error + ridge * off])
        return float(value + 0.5 * ridge * off @ off), slope

    bounds = [(None, None)] + [
        (0.0 if sign > 0 else None, 0.0 if sign < 0 else None) for sign in signs
    ]
    near = near or Weights(float(np.log(share / (1.0 - share))), prior)
    start = np.concatenate([[near.bias], near.slopes])
    solution = minimize(loss, start, jac=True, bounds=bounds, method='L-BFGS-B')
    return Weights(float(solution.x[0]), np.asarray(solution.x[1:]))


def log_loss(probability: Array, right: Array | NDArray[np.bool_], weight: Array) -> float:
    """Return the mean log loss in nats; all of shape (N,)."""
    clipped = np.clip(probability, 1e-4, 1.0 - 1e-4)
    loss = -np.where(np.asarray(right, dtype=bool), np.log(clipped), np.log(1.0 - clipped))
    return float((weight * loss).sum() / weight.sum())


class Bound(NamedTuple):
    sure_from: float
    """Above 1 where no threshold keeps the risk: then nothing is told as sure."""
    wrong: int
    cases: int
    """Sure and wrong at this threshold, of how many cases."""
    expected: float
    """Bound on the probability that one more such case is sure and wrong."""
    most: float
    """Upper limit of the share that is sure and wrong, with 90 % confidence."""
    sure: float
    """Share of the cases that are sure."""


NEVER = 1.01
"""A threshold that no probability reaches."""
GRID = np.linspace(0.998, 0.5, 250)
"""Thresholds tried, chosen before any data: two in a thousand apart."""
ERROR = 0.1
"""How often the upper limit of the share may fail to hold."""


def bounded(probability: Array, right: Array, risk: float) -> Bound:
    """Return the lowest threshold at which one more case is sure and wrong with less than a risk."""
    p, good = np.asarray(probability, dtype=float), np.asarray(right, dtype=bool)
    best = NEVER
    for threshold in GRID:
        wrong = int(((p >= threshold) & ~good).sum())
        if (wrong + 1) / (p.size + 1) > risk:
            break
        best = float(threshold)
    return at(best, p, good)


def precise(probability: Array, right: Array, risk: float) -> Bound:
    """Return the lowest threshold at which one more sure case is wrong with less than a risk."""
    p, good = np.asarray(probability, dtype=float), np.asarray(right, dtype=bool)
    best = NEVER
    for threshold in GRID:
        sure = p >= threshold
        if int((sure & ~good).sum()) + 1 <= risk * (int(sure.sum()) + 1):
            best = float(threshold)
    return at(best, p, good)


def at(threshold: float, probability: Array, right: NDArray[np.bool_]) -> Bound:
    """Return what is known of a threshold on probabilities (N,)."""
    sure = probability >= threshold
    wrong, cases = int((sure & ~right).sum()), probability.size
    expected = (wrong + 1) / (cases + 1)
    return Bound(
        threshold, wrong, cases, expected, upper_limit(wrong, cases, ERROR), float(sure.mean())
    )


def upper_limit(wrong: int, cases: int, error: float) -> float:
    """Return the exact upper limit of a share, which may be larger with the probability of the error."""
    if wrong >= cases:
        return 1.0
    return float(beta.ppf(1.0 - error, wrong + 1, cases - wrong))


RIDGE = 10.0
"""Of half the squared weights, against log loss in nats: each weight moves as far as some tens of
examples ask it to. On seeds left out it lost less than 30 and 100, and as little as 3."""
FOLDS = 8
"""Parts of the cases that take turns in being unseen."""
PARTITIONS = 4
"""
Ways in which cases are parted. What is sure hangs on the few wrong answers that are told with the
most; where their probabilities are those of one partition, luck decides by thousandths.
"""
ENDS = (0.005, 0.995)
"""Quantiles of a feature between which it counts: beyond, single cases would decide."""
OF_TODAY = 1.0
"""
Weight of a case from which on an engine like that at hand diagnosed it. What is sure is read off these
alone: a promise holds for answers like those it was read off, and older engines answered otherwise.
"""
CAUSES = ('name', 'name of many', 'place of the rest')
"""Kinds of statements by which a cause is sure."""
NAMES = ('name', 'name of many')
"""Kinds of statements that an answer as a whole is put together from."""
NEAR = 0.02
"""Of the logarithm of a product of probabilities: how near tables of four digits keep it."""
FEWEST_NAMED = 30
"""Examples in which a family is named alone from which on that is a feature."""
DIGITS = 4
"""Significant digits of a weight."""
LEAST = 0.2
"""
Nats that a feature adds at the most over all its range, up to which it is left out: it moves no
probability by more than a twentieth, and each weight that is left is one more to read.
"""


class Table(NamedTuple):
    """Examples of one kind as columns: features, what was right, weights, folds."""

    values: Array
    right: NDArray[np.bool_]
    weight: Array
    folds: Array
    """Of every partition, shape (PARTITIONS, N)."""


def learned(
    examples: Sequence[Example], card: Mapping[str, Any], risk: float = RISK
) -> dict[str, Any]:
    """Return the content of a file of weights; raises DataError where examples of a kind are too few."""
    statements, parts = {}, {}
    numbers = Counter(example.kind for example in examples)
    for kind in TERMS:
        if (number := numbers[kind]) < FOLDS:
            raise DataError(
                f'{number} examples of {kind!r} are too few to learn from; draw some hundreds of '
                'cases'
            )
    examples = restated(examples)
    for kind in TERMS:
        own = [example for example in examples if example.kind == kind]
        terms, table, signs = _of_kind(own, kind)
        statements[kind] = _content(table, terms, signs)
        counts = table.weight >= OF_TODAY
        parts[kind] = _unseen(table, signs)[counts], table.right[counts]
    answers, causes = (
        [np.concatenate(both) for both in zip(*(parts[kind] for kind in kinds), strict=True)]
        for kinds in ([kind for kind in TERMS if kind.startswith('answer')], CAUSES)
    )
    bounds = {
        'answer': bounded(answers[0], answers[1], risk),
        'cause': precise(causes[0], causes[1], CAUSE_RISK),
    }
    return {
        'schema': SCHEMA,
        'card': {
            **card,
            'risk': {'answer': risk, 'cause': CAUSE_RISK},
            'bounds': {
                what: {key: round(float(value), 5) for key, value in bound._asdict().items()}
                for what, bound in bounds.items()
            },
        },
        'sure_from': {what: bound.sure_from for what, bound in bounds.items()},
        'statements': statements,
    }


def unseen(examples: Sequence[Example], content: Mapping[str, Any]) -> list[Example]:
    """Return examples as they are reported by weights that had not seen their cases."""
    examples, out = restated(examples), []
    for kind in TERMS:
        own = [e for e in examples if e.kind == kind]
        table, signs = _of_kind(own, kind)[1:]
        what = 'answer' if kind.startswith('answer') else 'cause' if kind in CAUSES else ''
        bound = content['sure_from'].get(what, 2.0)
        out += [
            e._replace(reported=float(p), sure=bool(p >= bound))
            for e, p in zip(own, _unseen(table, signs), strict=True)
        ]
    return out


def restated(examples: Sequence[Example]) -> list[Example]:
    """
    Return examples in which answers are put together from names as new weights report them.

    Those in a table were reported by the weights of their time. An answer learned from them would
    take names of other weights for surer, or less sure, than they are. Each name is reported by
    weights that had not seen its case. An answer that is not the product of its names stays.
    """
    names = defaultdict[str, list[tuple[float, float]]](list)
    for kind in NAMES:
        own = [e for e in examples if e.kind == kind]
        for e, p in zip(own, _unseen(*_of_kind(own, kind)[1:]), strict=True):
            names[e.case].append((e.reported, float(p)))

    def again(example: Example) -> Example:
        features, both = example.features, names[example.case]
        if not both or 'names' not in features or len(both) != features['told']:
            return example
        before, now = (of_whole(own, []) for own in zip(*both, strict=True))
        if not abs(before['names'] - features['names']) < NEAR:
            return example
        return example._replace(
            features={**features, **{key: now[key] for key in ('names', 'least name')}}
        )

    return [again(example) for example in examples]


def _of_kind(own: Sequence[Example], kind: str) -> tuple[dict[str, int], Table, Array]:
    """Return the features of a kind of statement, its examples, and which way each may count."""
    terms = dict(TERMS[kind])
    if kind in OF_FAMILIES:
        named = Counter(
            name for e in own for name in e.features if name.startswith(ONLY) and e.features[name]
        )
        terms |= {name: 0 for name in sorted(named) if named[name] >= FEWEST_NAMED}
    return terms, _table(own, list(terms)), np.array(list(terms.values()), float)


def count_of(content: Mapping[str, Any]) -> int:
    return sum(1 + len(own['weights']) for own in content['statements'].values())


def _table(examples: Sequence[Example], names: Sequence[str]) -> Table:
    # Unseen together are a sealed case, or all rows of one real arm.
    together = [e.case if '/' in e.case else e.case.split()[0] for e in examples]
    each, of = np.unique(np.array(together), return_inverse=True)
    orders = [np.random.default_rng(k).permutation(len(each)) for k in range(PARTITIONS)]
    values = [
        [e.features.get(name, 0.0 if name.startswith(ONLY) else np.nan) for name in names]
        for e in examples
    ]
    return Table(
        np.array(values, float).reshape(len(examples), len(names)),
        np.array([e.right for e in examples], bool),
        np.array([e.weight for e in examples], float),
        np.array([order[of] % FOLDS for order in orders]),
    )


class Scaled(NamedTuple):
    """How features enter: cut to what was seen, with mean zero and spread one."""

    low: Array
    high: Array
    middle: Array
    spread: Array

    @classmethod
    def of(cls, values: Array) -> Scaled:
        """Return the scaling of examples; what an older example lacks counts as usual."""
        # A feature that no example has yet is left out.
        values = np.where(np.isnan(values).all(axis=0), 0.0, values)
        low, high = np.nanquantile(values, ENDS, axis=0)
        # A family that is named seldom is named all the same.
        rare = low == high
        low, high = (
            np.where(rare, end(values, axis=0), own)
            for end, own in ((np.nanmin, low), (np.nanmax, high))
        )
        cut = np.clip(values, low, high)
        spread = np.nanstd(cut, axis=0)
        return cls(low, high, np.nanmean(cut, axis=0), np.where(spread > 1e-9, spread, 1.0))

    def __call__(self, values: Array) -> Array:
        cut = np.clip(values, self.low, self.high)
        return np.nan_to_num((cut - self.middle) / self.spread)


def _content(table: Table, names: Mapping[str, int], signs: Array) -> dict[str, Any]:
    scaled, fit = _fitted(table, signs)
    slopes = fit.slopes / scaled.spread
    # What is left out counts as usual: it is at its mean in the constant.
    slopes = np.where(np.abs(slopes) * (scaled.high - scaled.low) > LEAST, slopes, 0.0)
    return {
        'examples': len(table.right),
        'right': int(table.right.sum()),
        'constant': _short(fit.bias - float(slopes @ scaled.middle)),
        'weights': {
            name: {'weight': _short(slope), 'low': _short(low), 'high': _short(high)}
            for name, slope, low, high in zip(names, slopes, scaled.low, scaled.high, strict=True)
            if slope
        },
    }


def _short(value: float) -> float:
    return float(f'{value:.{DIGITS}g}')


def _unseen(table: Table, signs: Array) -> Array:
    """Return the probability of each example by weights fitted on the other folds."""
    odds = np.zeros(table.folds.shape)
    near = _fitted(table, signs)[1]
    for partition, fold in np.ndindex(PARTITIONS, FOLDS):
        here = table.folds[partition] == fold
        scaled, fit = _fitted(table, signs, ~here, near)
        odds[partition, here] = fit.bias + scaled(table.values[here]) @ fit.slopes
    return np.asarray(1.0 / (1.0 + np.exp(-odds.mean(axis=0))))


def _fitted(
    table: Table,
    signs: Array,
    which: NDArray[np.bool_] | slice = slice(None),
    near: Weights | None = None,
) -> tuple[Scaled, Weights]:
    scaled = Scaled.of(table.values[which])
    columns = scaled(table.values[which])
    fit = fitted(columns, table.right[which], signs, RIDGE, table.weight[which], near=near)
    return scaled, fit
