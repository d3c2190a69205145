# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Features of statements: a few plain numbers that say how far each can be trusted.

Sizes, ratios and shares of what is left enter as decimal logarithms: a hundredth that something
regular explains says nearly as much as a tenth. Probabilities enter as log odds, evidence as the
logarithm of nats. Nothing here says which families were taken out of the library: how often that is
done is no property of a cell.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isnan

import numpy as np

from ...arrays import Array
from ..beliefs import Beliefs
from ..evidence import Evidence, Left, Row
from ..result import Cause, Family

Numbers = dict[str, float]
FAR = 1e3
"""Nothing beyond a thousand, or below a thousandth, says more."""
MOVES = 0.02
"""Travel [rad, m] from which on a joint shows something at all."""
REGULAR = -2.0
"""Decimal logarithm of the share of what is left from which on it counts as regular."""
LOW_GROWTH = 0.12
"""Growth of the error without a kind, as `log1`, below which it is hardly missed: by a third, between
the tenth from which on it is needed and the two thirds that most are missed by."""
WIDEST = 3
"""Members of a set of names up to which it still says what to do; a wider one is held to more."""
ONLY = 'only '
"""Before a family that is named alone: some stand in for causes that no library has."""
TOLD_AS = ('many', 'none', 'unknown')
"""What an answer may be told as that names no few effects: what is missing hangs on it above all."""
KINDS = {
    'name': 'one of the names of an effect found is right',
    'place': 'its place is right although its name is not',
    'dependence': 'what it depends on is right although its name is not',
    'name of many': 'at least half of what a kind of many small errors is said to do is there',
    'place of many': 'what is wrong at the places named does as much',
    'dependence of many': 'what depends on the same does as much',
    'place of the rest': 'the place of what has no name is right',
    'dependence of the rest': 'what it depends on is right',
    'nameless': 'a cause is at work that has no name in the library, and what is named is wrong',
    'complete': 'no cause above the noise and a tenth of the squared gap is missing',
    'answer, named': 'the whole answer is right, where it is identified or ambiguous',
    'answer, unknown': 'the whole answer is right, where it is unknown',
    'answer, none': 'there is no gap above the noise, where none is told',
    'answer, many': 'the whole answer is right, where it names many small errors',
}
"""Every kind of statement, and what it says."""


def of_situation(evidence: Evidence, beliefs: Beliefs) -> Numbers:
    """Return the features that all statements of a diagnosis share."""
    floor = evidence.noise
    # An instrument of another law, about an origin of its own, is near to a scale and a moved base.
    places = {candidate_set[0].place for candidate_set in evidence.candidate_sets}
    return plain(
        {
            'gap': log(evidence.gap / floor),
            'left': log(evidence.after / floor),
            'left unexplained': log(Left(evidence, beliefs).share),
            'structure': log(evidence.structure.gain),
            'hardly a gap': hardly_a_gap(log(evidence.gap / floor), log(evidence.structure.gain)),
            'rows': log(evidence.rows),
            'joints moving': float((np.array(evidence.travel) > MOVES).mean()),
            'lacking': float(bool(evidence.lacking)),
            # Effects that work with each other are no better news than those that are apart.
            'cancelling': log(max(sum(evidence.parts), 1.0)),
            'stations': float(evidence.stations),
            'instrument and base': float({'instrument', 'base'} <= places),
        }
    )


def hardly_a_gap(gap: float, structure: float) -> float:
    """
    Return how far the excess of the squared gap stays below the squared noise.

    Zero where it does not, and where something regular is left. gap: over the noise. All are decimal
    logarithms.
    """
    excess = log(10.0 ** (2.0 * gap) - 1.0)
    return max(-excess, 0.0) if structure < REGULAR else 0.0


def of_name(
    row: Row,
    size: float,
    wandered: float,
    missed: Sequence[float],
    beside: Sequence[Row] = (),
    left_at: Sequence[str] = (),
    travel: float = np.inf,
    shown: float = np.nan,
) -> Numbers:
    """
    Return the features of the name of an effect found, from its row of the table of answers.

    size: how far the effect moves the tool, RMS in units of noise.
    wandered: how far its values move from stretch to stretch, over what noise makes them.
    missed: by what share the error of every part left out grows without it.
    beside: rows of the other effects found.
    left_at: what the most of what is left depends on, in words.
    travel: of its joint [rad].
    shown: how many standard errors it is from nothing beside all small errors of an arm.
    """
    on = row.leader.dependence
    own = sum(one.leader.place == row.leader.place and of_curve(one) for one in beside)
    return plain(
        {
            'weight': odds(row.mass),
            'evidence': log1(row.leader.log_bayes),
            'behind': log1(row.leader.behind),
            'size': log(size),
            'wander': log(wandered),
            'wander over size': log(wandered) - log(size),
            # What is not missed at all says more than how much others are.
            'missed': log(float(np.median(missed))),
            'least missed': log(min(missed)),
            'shown beside others': log(shown),
            'members': len(row.listed),
            'faint beside others': faint(log(size), len(beside)),
            'others of its curve': own if of_curve(row) else 0.0,
            'part of a wave': part_of_a_wave(row.leader.orders, travel),
            'left at its joint': float(any(str(row.leader.site.joint) in w for w in left_at[:1])),
            'constant': float(on == 'constant'),
            'angle': float(on == 'angle'),
            f'{ONLY}{row.leader.site.effect}': float(len(row.listed) == 1),
        }
    )


def of_curve(row: Row) -> bool:
    """
    Return whether an effect is a constant of its joint, or a slope or wave over its angle.

    Several at one place are what a curve without a formula is taken to pieces by.
    """
    return row.leader.dependence in ('constant', 'angle')


def part_of_a_wave(orders: Array, travel: float) -> float:
    """
    Return by how much the travel of a joint falls short of the slowest of several waves.

    Decimal logarithm, 0 of a single wave. Waves of which one is seen in part are any smooth curve.

    orders: of the waves [1/rev], shape (K,).
    travel: of the joint [rad].
    """
    if orders.size < 2:
        return 0.0
    return max(-log(float(orders.min()) * travel / (2.0 * np.pi)), 0.0)


def of_level(row: Row, level: str) -> Numbers:
    """Return the features of the place, or of the dependence, of an effect found."""
    weights = row.places() if level == 'place' else row.dependences()
    return plain({f'weight of the {level}': odds(max(weights.values()))})


def of_form(groups: int, steady: float) -> Numbers:
    """Return how many groups without a formula stand for what has no name, and how surely."""
    return plain({'groups': groups, 'no group': float(groups == 0), 'steady': min(steady, 10.0)})


def of_rest(cause: Cause, level: str) -> Numbers:
    """
    Return the features of the place, or of the dependence, of what has no name.

    cause: with the weights of the groups that found it.
    level: 'place' or 'dependence'.
    """
    listed = [p for _, p in (cause.place if level == 'place' else cause.dependence)]
    first, second, *_ = (*listed, 0.0, 0.0)
    return plain(
        {
            'weight': odds(first),
            'second': second,
            'share': cause.share,
        }
    )


def of_kind(family: Family, names: int, kinds: int, floor: float, left: float) -> Numbers:
    """
    Return the features of a kind of many small errors.

    family: how unseen data get worse without it.
    names: in its set.
    kinds: how many are named: one or two alone stand in for a cause without a name more often.
    floor: noise [m].
    left: on unseen data, RMS [m]; of real arms it is far above the noise, however right a kind is.
    """
    return plain(
        {
            'growth': log1(family.growth),
            # What is hardly missed says more than how much others are.
            'low growth': min(log1(family.growth), LOW_GROWTH),
            'least growth': log1(min(family.growths, default=0.0)),
            'size': log(family.rms_m / floor),
            'size over left': log(family.rms_m / left),
            'members': names,
            'kinds': kinds,
        }
    )


def of_whole(
    probabilities: Sequence[float],
    names: Sequence[Mapping[str, float]],
    unnamed: Sequence[float] = (),
) -> Numbers:
    """
    Return the features of an answer as a whole, from what is reported of its names.

    probabilities: of every name reported.
    names: features of the same names.
    unnamed: probabilities of names that are not reported though an effect was found: the answer is
    right only if they are wrong.
    """
    held = [*probabilities, *(1.0 - p for p in unnamed)]
    alone = {
        key: 1.0
        for own in names
        for key, reported in own.items()
        if key.startswith(ONLY) and reported
    }
    least_size = min((own['size'] for own in names), default=0.0)
    widest = max((own['members'] for own in names), default=0.0)
    return plain(
        {
            'names': float(np.log(max(float(np.prod(held)), 1.0 / FAR))),
            'least name': odds(min(held, default=0.5)),
            'told': len(names),
            'least size': least_size,
            'widest set': widest,
            **of_outline(len(names), least_size, widest),
            **alone,
        }
    )


def of_outline(told: float, least_size: float, widest: float) -> Numbers:
    """
    Return whether a set is too wide to act on, and whether one of several effects is faint.

    told: effects.
    least_size: of the smallest of them, as a decimal logarithm in units of noise.
    widest: members of the widest set of names.
    """
    return {
        'a wide set': float(widest > WIDEST),
        'one faint beside others': faint(least_size, told - 1.0),
    }


def faint(size: float, others: float) -> float:
    """
    Return whether an effect moves the tool by less than the noise while others move it, too.

    One that is alone at work is seen in all that the noise leaves; beside others a small one is
    often what these leave where their form is not quite right.

    size: decimal logarithm, in units of noise.
    """
    return float(others >= 1.0 and size < 0.0)


def plain(numbers: Mapping[str, float]) -> Numbers:
    """Return finite numbers, cut where nothing beyond says more."""
    return {key: 0.0 if isnan(v) else float(min(max(v, -FAR), FAR)) for key, v in numbers.items()}


def odds(probability: float) -> float:
    """Return the log odds of a probability, as far as a thousand to one."""
    held = min(max(probability, 1.0 / FAR), 1.0 - 1.0 / FAR)
    return float(np.log(held / (1.0 - held)))


def log(value: float) -> float:
    """Return the decimal logarithm of what cannot be negative."""
    return float(np.log10(max(value, 1.0 / FAR)))


def log1(value: float) -> float:
    """Return a logarithm that is linear near zero, with the sign of the value."""
    return float(np.sign(value) * np.log10(1.0 + abs(value)))
