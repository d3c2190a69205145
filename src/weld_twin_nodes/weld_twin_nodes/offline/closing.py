# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Whether diagnoses close the question of an investigation, and how far what they name is believed.

What poor recordings show is easily misread, and then stands in the way of what better ones show. So
all recordings are diagnosed together, and the experiments without the first ones. Each knows how often
answers like it were right; the other speaks for it or against it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import exp, log
from typing import Any

from weld_twin_core.diagnosis.advice.chosen_pieces import NOTHING
from weld_twin_core.diagnosis.result import NAMING

OWN, FOR, AGAINST, BEGIN = 0.36, 0.89, -0.84, 0.82
"""What the log odds of an answer count, those of the other where it names the same, those where it
names something else, and what is added. `weld-twin lab closing` learned them; docs/investigate.md says
from which cells."""
CLOSED = 0.93
"""Probability from which an answer that two diagnoses were asked for closes the question. A judgement:
of the 202 cells that the weights were learned from, each judged by weights learned from the others, from
0.92 to 0.98 one was believed wrongly, and from 0.9 two to four."""
OLDER = 0.9
"""Confidence from which an answer of the first schema, which says no more of itself, counts as sure."""
MOST = 0.99
"""Probability that two diagnoses earn at the most: one of the 202 cells was believed wrongly, and the
next might be another."""
EXTREME = 1e-3
"""A probability is taken as no nearer to 0 and 1 than this: odds of a thousand."""
ALIKE = 'the causes are known as far as any motion can tell'
STATED = (*NAMING, 'none')
"""Statuses of answers that say what the causes are, if only that there is none."""


def weighed(
    together: Mapping[str, Any], alone: Mapping[str, Any] | None = None
) -> tuple[Mapping[str, Any], str]:
    """
    Return which diagnosis to believe, and whether and why it closes the question.

    together: the diagnosis of all recordings.
    alone: that of the experiments without the recordings before them.

    Returns
    -------
    found : mapping
        The one that is believed; where there were two, its confidence is that of both. If both name
        the same, it is that of all recordings, unless only the other closes the question.
    why : str
        In words why it closes the question; empty where it does not.

    """
    if alone is None:
        return together, closes(together)
    pairs = ((together, alone), (alone, together))
    heard = [_with_belief(result, other) for result, other in pairs]
    # What does not fit together, as after a knock between two recordings, may be sound by itself.
    heard = [one for one in heard if one['verdict']['status'] != 'unsound'] or heard
    if not _same(together, alone):
        heard.sort(key=lambda one: one['verdict']['confidence'] or 0.0, reverse=True)
    stated = [one for one in heard if one['verdict']['status'] in STATED]
    for one in stated:
        if one['verdict']['sure'] and not _open_ends(one):
            return one, _words(one)
    return _asking((stated or heard)[0], (together, alone)), ''


def _asking(result: Mapping[str, Any], heard: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """Return a diagnosis that leaves the question open, with the other's experiment if it has none."""
    plans = [one.get('next_experiment') for one in (result, *heard)]
    wanted = next((plan for plan in plans if plan and plan['motion'] is not None), plans[0])
    return {**result, 'next_experiment': wanted}


def closes(result: Mapping[str, Any]) -> str:
    """
    Return why a diagnosis closes the question by itself; empty where it does not.

    ``result``: the content of diagnosis.json.
    """
    verdict = result['verdict']
    if not is_sure(verdict) or verdict['status'] not in STATED:
        return ''
    open_ = verdict['status'] == 'ambiguous' and not _inseparable(result)
    return '' if open_ or _to_confirm(result) else _words(result)


def is_sure(verdict: Mapping[str, Any]) -> bool:
    """
    Return whether an answer is told as sure.

    ``verdict``: of diagnosis.json, of either schema.
    """
    reported = verdict.get('sure')
    return float(verdict['confidence'] or 0.0) >= OLDER if reported is None else bool(reported)


def belief(result: Mapping[str, Any], other: Mapping[str, Any]) -> float:
    """
    Return how probable it is that an answer is right, with another of most of the same measurements.

    ``found`` and ``other``: as `signs` takes them.
    """
    own, same, against = signs(result, other)
    total = OWN * own + FOR * same + AGAINST * against + BEGIN
    return min(1.0 / (1.0 + exp(-total)), MOST)


def signs(result: Mapping[str, Any], other: Mapping[str, Any]) -> tuple[float, float, float]:
    """
    Return the log odds of an answer, and of another as far as it speaks for it, and against it.

    The other counts where it is likelier right than wrong. What it leaves unknown speaks for nothing:
    it may be what poor recordings hide.

    ``result`` and ``other``: the contents of two diagnosis.json.
    """
    stated = other['verdict']['status'] in STATED
    heard = max(_log_odds(other), 0.0) if stated else 0.0
    backed = _same(result, other, no_wider=True)
    return _log_odds(result), heard * backed, heard * (not _same(result, other))


def _log_odds(result: Mapping[str, Any]) -> float:
    verdict = result['verdict']
    learned = verdict.get('learned')
    reported = float((verdict['confidence'] if learned is None else learned) or 0.0)
    held = min(max(reported, EXTREME), 1.0 - EXTREME)
    return log(held / (1.0 - held))


def _with_belief(result: Mapping[str, Any], other: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a diagnosis with the confidence that it has beside another."""
    verdict = result['verdict']
    if verdict['status'] not in STATED:
        return result
    reported = belief(result, other)
    earned = {'confidence': reported, 'learned': reported, 'sure': reported >= CLOSED}
    return {**result, 'verdict': {**verdict, **earned}}


def _same(result: Mapping[str, Any], other: Mapping[str, Any], *, no_wider: bool = False) -> bool:
    """
    Return whether two answers name as many causes, each of one among those of the other.

    With ``no_wider``, whether all that the other names beside each other is named by the first as
    well: an answer that leaves more open says nothing of what the first rules out.
    """
    if any(one['verdict']['status'] not in STATED for one in (result, other)):
        return False
    remaining = _sites(other)
    for group in _sites(result):
        match = next(
            (own for own in remaining if (own <= group if no_wider else own & group)), None
        )
        if match is None:
            return False
        remaining.remove(match)
    return not remaining


def _sites(result: Mapping[str, Any]) -> list[set[tuple[str, str | None]]]:
    return [{(e['effect'], e.get('joint')) for e in group} for group in sets_named(result)]


def sets_named(result: Mapping[str, Any]) -> Sequence[Sequence[Mapping[str, Any]]]:
    """Return what each cause that is named may be, one group a cause."""
    return result['verdict'].get('indistinguishable') or ()


def _words(result: Mapping[str, Any]) -> str:
    """Return why an answer closes the question, where it does."""
    reported = {'identified': 'the causes are identified', 'ambiguous': ALIKE}
    return reported.get(result['verdict']['status'], 'nothing is left to explain above the noise')


def _open_ends(result: Mapping[str, Any]) -> bool:
    """
    Return whether causes are named beside each other that some motion would part.

    What can be parted among those named is asked first. So an experiment that asks something else
    found no motion for it; nor did one that would part nothing.
    """
    wanted = result.get('next_experiment')
    if result['verdict']['status'] != 'ambiguous' or wanted is None:
        return bool(result['verdict']['status'] == 'ambiguous')
    sigma = wanted['expected_separation_sigma']
    if sigma is not None and sigma < NOTHING:
        return False
    sides = [{(e['effect'], e.get('joint')) for e in side} for side in wanted.get('between') or ()]
    open_ = len(sides) == 2 and any(
        sides[0] & group and sides[1] & group for group in _sites(result)
    )
    return open_ and not _inseparable(result)


def _to_confirm(result: Mapping[str, Any]) -> bool:
    """Return whether joints that hardly moved have to move before anything is sure."""
    return bool((result.get('next_experiment') or {}).get('confirms'))


def _inseparable(result: Mapping[str, Any]) -> bool:
    """Return whether no motion parts what is left."""
    wanted = result.get('next_experiment')
    return wanted is not None and wanted['motion'] is None
