# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What cases with known truths taught about how often an answer is right.

`belief.json` holds the weights: for each level of an answer and each status a logistic function of
a few signs. `weld-twin lab belief` fits and writes it.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import Any

import numpy as np

from ...effects.registry import REGISTRY

SCHEMA = 'weld_twin/belief/1'
FILE = 'belief.json'
LEAST_LOGIT = 1e-3
"""A probability that is taken as a sign is kept so far from 0 and 1: odds of a thousand."""
AS_LOGIT = frozenset({'belief', 'place', 'dependence', 'name', 'leader', 'mass', 'complete'})
"""Signs that are probabilities; their log odds add up, they do not."""


SIZES = ('gap', 'strongest', 'cause_size')
"""Signs that say how large something is against the noise. Where one lies beyond all cases learned
from, the others mean something else too: of a gap of ten thousand times the noise, a rest of thirty
times the noise is nothing, of a gap of sixty it was half."""
BEFORE = {'answer': 'belief', 'place': 'place', 'dependence': 'dependence', 'name': 'name'}
"""The sign that is the probability of a level before anything was learned."""
PRODUCTS = {
    'constant_at_rest': ('constants', 'moving'),
    'constant_in_narrow': ('constants', 'wide'),
}
"""Signs that are made of two: a constant was named, times the share of joints that do not move,
or not widely. What depends on the angle of a joint at rest looks like a constant."""


PRESENT = ('named_', 'alone_', 'cause_is_', 'cause_only_')
"""Beginnings of signs that say which families are named; one that is not there is not named."""
ON = 'on_'
"""After such a beginning: a family is named that depends on this. What is learned of all families
of a kind holds for one that was seldom seen."""
OF_KIND = ('own_wander', 'own_left_sure')
"""Signs of a formula that tell more of some kinds: friction that imitates play wants another size on
every stretch."""
FROM = ' from '
"""Between a sign and where a piece of its curve begins: log odds bend there."""
LEVELS_BACK = frozenset({'answer', 'name'})
"""Levels that are sure only where every name comes back on all halves of the data."""


@dataclass(frozen=True)
class Term:
    """
    What one sign adds to the log odds.

    Attributes
    ----------
    weight : float
        Nats per ``spread``.
    middle, spread : float
        Mean and standard deviation of the sign over the cases it was learned from.
    low, high : float
        Least and greatest value among those cases; beyond, nothing was learned.

    """

    weight: float
    middle: float
    spread: float
    low: float
    high: float

    def nats(self, value: float) -> float:
        """Return what it adds to the log odds."""
        held = min(max(value, self.low), self.high)
        return self.weight * (held - self.middle) / self.spread


@dataclass(frozen=True)
class Learned:
    """
    How often one level of an answer is right, as a function of signs.

    Attributes
    ----------
    bias : float
        Log odds where every sign is at its middle.
    least, most : float
        Probabilities beyond which so few cases allow no statement.
    terms : mapping from str to Term
        By the name of the sign.

    """

    bias: float
    least: float
    most: float
    terms: Mapping[str, Term]

    def probability(self, signs: Mapping[str, float]) -> float:
        """
        Return the probability of being right.

        Parameters
        ----------
        signs : mapping from str to float
            A sign that is missing counts as at its middle, a family that is missing as not named.

        """
        total = self.bias
        for name, term in self.terms.items():
            sign = name.partition(FROM)[0]
            if sign in signs:
                total += term.nats(taken(sign, signs[sign]))
            elif sign.startswith(PRESENT):
                total += term.nats(0.0)
        return float(np.clip(1.0 / (1.0 + np.exp(-total)), self.least, self.most))

    def larger(self, signs: Mapping[str, float]) -> bool:
        """
        Return whether something is larger against the noise than in any case learned from.

        Parameters
        ----------
        signs : mapping from str to float

        """
        return any(
            name in signs and name in self.terms and signs[name] > self.terms[name].high
            for name in SIZES
        )


def taken(name: str, value: float) -> float:
    """
    Return a sign as it enters the log odds.

    Parameters
    ----------
    name : str
        Of the sign; a probability, or the second of a list of them, enters as log odds.
    value : float

    """
    if name not in AS_LOGIT:
        return value
    held = min(max(value, LEAST_LOGIT), 1.0 - LEAST_LOGIT)
    return float(np.log(held / (1.0 - held)))


def with_products(signs: Mapping[str, float]) -> dict[str, float]:
    """
    Return signs with those that are made of two of them, and with the kinds of the families named.

    Parameters
    ----------
    signs : mapping from str to float
        Where one of the two is missing, so is what they make.

    """
    made = {
        name: float(signs[named] > 0.0) * (1.0 - signs[share])
        for name, (named, share) in PRODUCTS.items()
        if named in signs and share in signs
    }
    kinds = _kinds(signs)
    return {**signs, **made, **kinds, **_of_kinds(signs, kinds)}


def _kinds(signs: Mapping[str, float]) -> dict[str, float]:
    """Return what the families named depend on, as signs."""
    out = {}
    for start in PRESENT:
        named = [REGISTRY.get(sign[len(start) :]) for sign in signs if sign.startswith(start)]
        out.update({f'{start}{ON}{kind.depends_on}': 1.0 for kind in named if kind is not None})
    return out


def _of_kinds(signs: Mapping[str, float], kinds: Iterable[str]) -> dict[str, float]:
    """Return the signs of a formula once more for each kind named: some kinds imitate others."""
    each = [name for name in OF_KIND if name in signs]
    return {f'{name}_{kind}': signs[name] for kind in kinds for name in each}


def comes_back(signs: Mapping[str, float]) -> bool:
    """
    Return whether everything named came back on all halves of the data, as far as any can tell.

    Parameters
    ----------
    signs : mapping from str to float

    """
    return signs.get('own_back', 1.0) >= 1.0


@dataclass(frozen=True)
class Trust:
    """
    All that was learned.

    Attributes
    ----------
    sure_from : mapping from str to float
        By level and group of status, as in 'answer named': the probability from which on it is
        told as sure.
    told_unsure : float
        What is believed at the most of what is larger than all that was learned from.
    levels : mapping from str to Learned
        By level and group of status, as in 'answer named'.
    card : mapping
        Cases, seeds, engines, mix and bounds, to read.

    """

    sure_from: Mapping[str, float]
    told_unsure: float
    levels: Mapping[str, Learned]
    card: Mapping[str, Any]

    def learned(self, level: str, group: str, signs: Mapping[str, float]) -> float | None:
        """
        Return how often such a level of such answers was right.

        Beyond the sizes that were learned from, nothing speaks against what the evidence alone says;
        so it is at least that, as far as it is not sure.

        Parameters
        ----------
        level : str
        group : str
            Of the status, as `trusted.group_of` gives it.
        signs : mapping from str to float

        Returns
        -------
        float or None
            None where nothing was learned of such answers.

        """
        learned = self.levels.get(f'{level} {group}')
        if learned is None:
            return None
        probability = learned.probability(with_products(signs))
        before = signs.get(BEFORE[level], 0.0)
        if learned.larger(signs):
            probability = max(probability, min(before, self.told_unsure))
        return probability

    def sure(self, level: str, group: str, signs: Mapping[str, float]) -> bool:
        """
        Return whether a level is told as sure: hardly ever were such levels wrong.

        Parameters
        ----------
        level, group, signs
            As `learned` takes them.

        """
        probability = self.learned(level, group, signs)
        if probability is None or probability < self.sure_from.get(f'{level} {group}', 1.0):
            return False
        return level not in LEVELS_BACK or comes_back(signs)


def trust_from(content: Mapping[str, Any]) -> Trust:
    """
    Return what was learned, from the content of a belief file.

    Parameters
    ----------
    content : mapping
        As ``weld-twin lab belief`` writes it.

    """
    levels = {
        name: Learned(
            level['bias'],
            level['least'],
            level['most'],
            {sign: Term(**term) for sign, term in level['terms'].items()},
        )
        for name, level in content['levels'].items()
    }
    return Trust(content['sure_from'], content['told_unsure'], levels, content['card'])


@lru_cache(maxsize=1)
def usual_trust() -> Trust:
    """Return what this package has learned."""
    text = files(__package__).joinpath(FILE).read_text(encoding='utf-8')
    return trust_from(json.loads(text))
