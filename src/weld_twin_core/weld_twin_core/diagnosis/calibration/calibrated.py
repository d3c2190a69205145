# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Statements of a diagnosis with the probabilities that such statements have earned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from ..beliefs import Beliefs
from ..evidence import LIKELIER, Evidence, Row, Verdict, marginal
from ..negligible import ROUNDING
from ..result import NAMING, Cause, Family
from .features import (
    TOLD_AS,
    Numbers,
    of_kind,
    of_level,
    of_name,
    of_rest,
    of_situation,
    of_whole,
)
from .weights import Calibration, Features, usual_calibration

Key = TypeVar('Key')
_DOUBTED = (
    'each kind is likelier wrong than right by itself: these data do not tell which of them it is'
)


@dataclass(frozen=True)
class Statement:
    """One statement of a diagnosis: what it says, on what evidence, and how probable that makes it."""

    kind: str
    """One of `features.KINDS`."""
    cause: int | None
    """Which of the causes it is about; of a name before causes are put together, which effect
    found; None of the answer as a whole."""
    features: Features
    probability: float
    """Of what `features.KINDS` says."""


@dataclass(frozen=True)
class Stated:
    """What is said of the names before a verdict is drawn, and what all statements share."""

    table: tuple[Row, ...]
    names: tuple[Statement, ...]
    """Of every effect found; none of many small errors."""
    nameless: Statement | None
    """That a cause without a name is at work; None of many small errors, and where nothing was
    found."""
    situation: Features
    """Features of the diagnosis as a whole."""
    errors: tuple[float, float]
    """RMS [m] of the noise, and of what is left on unseen data."""

    def put_to(self, evidence: Evidence) -> Evidence:
        """Return evidence with what is believed of the names, and that a cause has none."""
        believed = tuple(one.probability for one in self.names)
        nameless = 0.0 if self.nameless is None else self.nameless.probability
        return replace(evidence, believed=believed, nameless=nameless)

    def believed(self, family: Family, kinds: int) -> float:
        """Return how probable it is that a kind of many small errors is right, of so many named."""
        names = len(family.needed) + len(family.like)
        return usual_calibration().probability('name of many', self.of_kind(family, names, kinds))

    def of_kind(self, family: Family, names: int, kinds: int) -> Numbers:
        """Return the features of a kind with so many names in its set, of so many kinds named."""
        return {**self.situation, **of_kind(family, names, kinds, *self.errors)}


def stated(evidence: Evidence, table: tuple[Row, ...], beliefs: Beliefs) -> Stated:
    """Return how probable it is of every effect found that a name is right, or that none can be."""
    learned = usual_calibration()
    situation = of_situation(evidence, beliefs)
    errors = evidence.noise, max(evidence.after, ROUNDING)
    if evidence.families is not None:
        return Stated(table, (), None, situation, errors)
    sizes = [size / evidence.noise for size in evidence.sizes]
    each = list(
        zip(table, sizes, evidence.wandered, evidence.missed, evidence.shown, strict=False)
    )
    on = evidence.structure.depends_on
    every = []
    for row, size, wandered, missed, shown in each:
        beside = [one for one, *_ in each if one is not row]
        travel = _travel(evidence, row)
        every.append(of_name(row, size, wandered, missed, beside, on, travel, shown))
    names = tuple(_told('name', k, {**situation, **own}, learned) for k, own in enumerate(every))
    if not names:
        return Stated(table, (), None, situation, errors)
    whole = of_whole([one.probability for one in names], [one.features for one in names])
    nameless = _told('nameless', None, {**situation, **whole}, learned)
    return Stated(table, names, nameless, situation, errors)


def _travel(evidence: Evidence, row: Row) -> float:
    """Return how far the joint of an effect moves [rad, m]; without end where it has none."""
    joint = row.leader.site.joint
    if joint is None or not evidence.travel:
        return float('inf')
    return evidence.travel[row.leader.fit.model.robot.index(joint)]


def calibrated(
    verdict: Verdict,
    causes: Sequence[Cause],
    before: Stated,
    form: Numbers,
) -> tuple[Verdict, tuple[Cause, ...], tuple[Statement, ...]]:
    """
    Return a verdict and its causes with probabilities, and the statements that these come from.

    causes: with the weights of the table of answers.
    before: what was said of the names.
    form: of what places what has no name, as `features.of_form` has it.
    """
    learned = usual_calibration()
    families = {family.effect: family for family in verdict.families if family.named}
    reported, said = list[Cause](), list[Statement]()
    for k, cause in enumerate(causes):
        told, levels = _stated_of(k, cause, families, before, form, learned)
        reported.append(replace(told, sure=learned.sure('cause', told.probability)))
        said += levels
    kinds = [one for one in said if one.kind == 'name of many']
    of_rows = [cause for cause in reported if cause.row is not None]
    names = [before.names[cause.row].features for cause in of_rows if cause.row is not None]
    few = verdict.status in NAMING and not verdict.families
    named = {cause.row for cause in of_rows}
    doubted = [one.probability for k, one in enumerate(before.names) if few and k not in named]
    whole = (
        of_whole([one.probability for one in kinds], [one.features for one in kinds])
        if kinds
        else of_whole([cause.probability for cause in of_rows], names, doubted)
    )
    whole = {**before.situation, **whole, **form}
    verdict, more = _of_answer(verdict, whole, learned)
    if (
        kinds
        and verdict.status == 'identified'
        and all(p <= LIKELIER for p in _probabilities(kinds))
    ):
        verdict = replace(verdict, status='ambiguous', reasons=(*verdict.reasons, _DOUBTED))
    if verdict.sure and verdict.status in NAMING:
        # Who is sure of the whole answer is sure of each part of it.
        reported = [replace(cause, sure=True) for cause in reported]
    first = () if before.nameless is None else (before.nameless,)
    return verdict, tuple(reported), (*said, *first, *more)


def _stated_of(
    k: int,
    cause: Cause,
    families: Mapping[str, Family],
    before: Stated,
    form: Numbers,
    learned: Calibration,
) -> tuple[Cause, list[Statement]]:
    """Return a cause with its probabilities, and what is said of its levels: place, dependence, name."""
    situation, both = before.situation, ('place', 'dependence')
    if cause.row is not None:
        row, name = before.table[cause.row], before.names[cause.row]
        own = [{**name.features, **of_level(row, level)} for level in both]
        levels = [_told(one, k, more, learned) for one, more in zip(both, own, strict=True)]
        levels.append(replace(name, cause=k))
        return _of_row(cause, row, *_probabilities(levels)), levels
    if families and cause.effect is not None:
        family = families[cause.name[0][0].effect]
        kind = before.of_kind(family, len(cause.name), sum(one.kinds for one in families.values()))
        each = (*both, 'name')
        levels = [_told(f'{level} of many', k, kind, learned) for level in each]
        return _of_kind(cause, *_probabilities(levels)), levels
    own = [{**situation, **form, **of_rest(cause, level)} for level in both]
    levels = [
        _told(f'{level} of the rest', k, more, learned)
        for level, more in zip(both, own, strict=True)
    ]
    return _of_rest(cause, *_probabilities(levels)), levels


def _probabilities(levels: Sequence[Statement]) -> list[float]:
    return [one.probability for one in levels]


def _of_answer(
    verdict: Verdict, features: Numbers, calibration: Calibration
) -> tuple[Verdict, list[Statement]]:
    """Return the verdict with how probable it is, and that nothing is missing."""
    group = 'many' if verdict.families else 'named' if verdict.status in NAMING else verdict.status
    told_as = {**features, **{f'told as {one}': float(group == one) for one in TOLD_AS}}
    complete = _told('complete', None, told_as, calibration)
    answer = _told(f'answer, {group}', None, features, calibration)
    out = replace(
        verdict,
        confidence=answer.probability,
        complete=complete.probability,
        sure=calibration.sure('answer', answer.probability),
    )
    return out, [complete, answer]


def _of_row(cause: Cause, row: Row, place: float, dependence: float, name: float) -> Cause:
    """
    Return the cause of an effect found with the probabilities of its place, dependence and name.

    What is learned of place and dependence holds where no name of the set is right; where one is,
    each name brings its own along.
    """
    named = _scaled(cause.name, name)
    own = {one.site: one for one in row.candidate_set}
    places = marginal((own[site].place, p) for site, p in named)
    dependences = marginal((own[site].dependence, p) for site, p in named)
    return replace(
        cause,
        place=_mixed(places, _led(cause.place, place), 1.0 - name),
        dependence=_mixed(dependences, _led(cause.dependence, dependence), 1.0 - name),
        name=named,
        probability=name,
    )


def _of_kind(cause: Cause, place: float, dependence: float, name: float) -> Cause:
    """Return a kind of many with its probabilities, which its joints and its likes share."""
    return replace(
        cause,
        place=_scaled(cause.place, place),
        dependence=_scaled(cause.dependence, dependence),
        name=_scaled(cause.name, name),
        probability=name,
    )


def _of_rest(cause: Cause, place: float, dependence: float) -> Cause:
    """Return what has no name with the probabilities of its place and dependence."""
    return replace(
        cause,
        place=_led(cause.place, place),
        dependence=_led(cause.dependence, dependence),
        probability=place if cause.place else 0.0,
    )


def _told(
    kind: str, cause: int | None, features: Mapping[str, float], calibration: Calibration
) -> Statement:
    return Statement(kind, cause, dict(features), calibration.probability(kind, features))


def _led(listed: Sequence[tuple[Key, float]], first: float) -> tuple[tuple[Key, float], ...]:
    """Return a list whose first has a probability, and the others the rest as they shared it."""
    if not listed:
        return ()
    (leader, own), *others = listed
    room = (1.0 - first) / (1.0 - own) if own < 1.0 else 0.0
    rest = [(key, min(p * room, first)) for key, p in others]
    return ((leader, first), *rest)


def _mixed(
    right: Mapping[str, float], otherwise: Sequence[tuple[str, float]], wrong: float
) -> tuple[tuple[str, float], ...]:
    """Return what is believed where a name is right and where none is, most probable first."""
    out = marginal([*right.items(), *((key, wrong * p) for key, p in otherwise)])
    return tuple(sorted(out.items(), key=lambda item: -item[1]))


def _scaled(listed: Sequence[tuple[Key, float]], total: float) -> tuple[tuple[Key, float], ...]:
    """Return a list whose probabilities add up to a total, shared as they were."""
    whole = sum(p for _, p in listed)
    return tuple((key, p * total / whole) for key, p in listed) if whole > 0.0 else ()
