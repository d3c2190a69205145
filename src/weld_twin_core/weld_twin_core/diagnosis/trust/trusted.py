# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""An answer with what was learned about answers like it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from ..result import NAMING, Cause
from ..verdict.decision import Verdict
from .model import Trust
from .signs import Signs

Key = TypeVar('Key')
PARTLY = 'partly'
"""Group of answers that name something beside what is left without a name."""


def group_of(status: str, signs: Mapping[str, float]) -> str:
    """
    Return which answers are learned from together.

    Those that name something are one group, those that name something beside what has no name
    another; many small errors are a third, as nothing in them has rivals.

    Parameters
    ----------
    status : str
    signs : mapping from str to float
        Of the answer.

    """
    if signs.get('families', 0.0) > 0.0:
        return 'families'
    if signs.get('partly', 0.0) > 0.0:
        return PARTLY
    return 'named' if status in NAMING else status


def level_group_of(status: str, signs: Mapping[str, float], *, named: bool) -> str:
    """
    Return which causes are learned from together: all without a name are placed by one means.

    Parameters
    ----------
    status : str
    signs : mapping from str to float
        Of the answer.
    named : bool
        Whether the cause is an effect that was found.

    """
    if signs.get('partly', 0.0) > 0.0:
        return PARTLY if named else 'unknown'
    if not named and status == 'unknown':
        return status
    return group_of(status, signs)


def trusted(
    verdict: Verdict, causes: Sequence[Cause], signs: Signs, trust: Trust
) -> tuple[Verdict, tuple[Cause, ...]]:
    """
    Return a verdict and its causes with the probabilities that they have earned.

    Parameters
    ----------
    verdict : Verdict
    causes : sequence of Cause
    signs : Signs
        Of the verdict and of its causes, in their order.
    trust : Trust

    """
    verdict = trusted_verdict(verdict, signs.answer, trust)
    told = tuple(
        trusted_cause(cause, verdict.status, {**signs.answer, **own}, trust)
        for cause, own in zip(causes, signs.causes, strict=True)
    )
    if group_of(verdict.status, signs.answer) == PARTLY and f'answer {PARTLY}' not in trust.levels:
        # Nothing was learned of the whole: it is right where something is left and each name holds.
        each = [cause.probability for cause in told if cause.slot is not None]
        verdict = replace(verdict, confidence=float(verdict.confidence * np.prod(each)))
    if verdict.status not in NAMING:
        return verdict, told
    # Who believes the whole answer believes each part of it.
    return verdict, tuple(
        replace(
            cause,
            probability=max(cause.probability, verdict.confidence),
            sure=cause.sure or verdict.sure,
        )
        for cause in told
    )


def trusted_verdict(verdict: Verdict, signs: Mapping[str, float], trust: Trust) -> Verdict:
    """
    Return the verdict with the confidence that such verdicts have earned.

    Parameters
    ----------
    verdict : Verdict
    signs : mapping from str to float
        Of the answer.
    trust : Trust

    """
    of = 'answer', group_of(verdict.status, signs), signs
    learned = trust.learned(*of)
    if learned is None:
        return verdict
    return replace(verdict, confidence=learned, sure=trust.sure(*of))


def trusted_cause(cause: Cause, status: str, signs: Mapping[str, float], trust: Trust) -> Cause:
    """
    Return a cause with the probabilities that its levels have earned.

    Parameters
    ----------
    cause : Cause
    status : str
        Of the verdict.
    signs : mapping from str to float
        Of the answer and of this cause.
    trust : Trust

    """
    # Of many small errors a cause is a kind, and none was found one by one.
    many = bool(cause.name) and signs.get('families', 0.0) > 0.0
    named = cause.slot is not None or many
    group = level_group_of(status, signs, named=named)
    place, dependence, name = (
        trust.learned(level, group, signs) for level in ('place', 'dependence', 'name')
    )
    if len(cause.name) == 1 and name is not None:
        # A name that is right is right about place and dependence as well.
        place, dependence = (None if p is None else max(p, name) for p in (place, dependence))
    out = replace(
        cause,
        place=_led(cause.place, place),
        dependence=_led(cause.dependence, dependence),
        name=_scaled(cause.name, name),
    )
    told = sum(p for _, p in out.name) if named else max((p for _, p in out.place), default=0.0)
    sure = trust.sure('name' if named else 'place', group, signs)
    return replace(out, probability=float(min(told, 1.0)), sure=sure)


def _led(
    listed: Sequence[tuple[Key, float]], first: float | None
) -> tuple[tuple[Key, float], ...]:
    """Return a list whose first has a probability, and the others the rest as they shared it."""
    if first is None or not listed:
        return tuple(listed)
    (leader, own), *others = listed
    room = (1.0 - first) / max(1.0 - own, 1e-9)
    rest = [(key, min(p * room, first)) for key, p in others]
    return ((leader, first), *rest)


def _scaled(
    listed: Sequence[tuple[Key, float]], total: float | None
) -> tuple[tuple[Key, float], ...]:
    """Return a list whose probabilities add up to a total, shared as they were."""
    whole = sum(p for _, p in listed)
    if total is None or whole <= 0.0:
        return tuple(listed)
    return tuple((key, p * total / whole) for key, p in listed)
