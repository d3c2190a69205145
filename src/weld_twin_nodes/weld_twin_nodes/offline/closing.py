# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Whether diagnoses close the question of an investigation: one that is sure, or several that agree.

All recordings, the experiments without the first ones, and the newest experiment by itself are
diagnosed. What they name, and how surely, decides which is believed and whether more is asked.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from weld_twin_core.diagnosis.advice.chosen_pieces import NOTHING
from weld_twin_core.diagnosis.advice.next_step import SURE
from weld_twin_core.diagnosis.result import NAMING

AGREED = 0.7
"""Confidence that two diagnoses of different recordings each need where only both together are sure:
two that are wrong seldom name the same."""
REPEATED = 0.8
"""Confidence that what was believed before an experiment, and what the experiment shows by itself, each
need to close a question where neither is sure: the most that an answer is told as that is not. In 23
cells that this was developed on, all 16 answers of a round with it were right; of four between it and
`AGREED` two were. Two recordings without a measurement in common seldom err alike."""
REPEAT = 'the newest experiment shows by itself what was believed before it was made'
ALIKE = 'the causes are known as far as any motion can tell'


def weighed(
    together: Mapping[str, Any],
    alone: Mapping[str, Any] | None = None,
    free: Mapping[str, Any] | None = None,
    before: Mapping[str, Any] | None = None,
    newest: Mapping[str, Any] | None = None,
) -> tuple[Mapping[str, Any], str]:
    """
    Return which diagnosis to believe, and whether and why it closes the question.

    What poor recordings show is easily misread, and then stands in the way of what better ones
    show. So the experiments are also diagnosed alone, with the first recordings held out. What was
    held out may be too poor to be foretold, as where a joint comes from when it hardly moves. So
    where all recordings name a cause and only the held-out ones are against it, the experiments
    are heard a third time, without them.

    Parameters
    ----------
    together : mapping
        The diagnosis of all recordings.
    alone : mapping, optional
        That of the experiments, with the recordings before them held out.
    free : mapping, optional
        That of the experiments with nothing held out; see `third_wanted`.
    before : mapping, optional
        What was believed before the newest experiment was made.
    newest : mapping, optional
        The diagnosis of the newest experiment by itself; see `repeat_wanted`.

    Returns
    -------
    found : mapping
        The one that is believed.
    why : str
        In words why it closes the question; empty where it does not.

    """
    found, why = _of_all(together, alone, free, before)
    same = repeat_wanted(together, alone, free, before)
    if newest is None or same is None or not _stated(newest, same, REPEATED):
        return found, why
    return same, REPEAT


def _of_all(
    together: Mapping[str, Any],
    alone: Mapping[str, Any] | None,
    free: Mapping[str, Any] | None,
    before: Mapping[str, Any] | None,
) -> tuple[Mapping[str, Any], str]:
    """Return which diagnosis of several recordings to believe, and why it closes the question."""
    if alone is None:
        return together, closes(together)
    closed = [closes(found) for found in (together, alone)]
    same = _named(together) == _named(alone)
    sure = [found['verdict']['confidence'] or 0.0 for found in (together, alone)]
    naming = [found['verdict']['status'] in NAMING for found in (together, alone)]
    agreed = min(sure) >= AGREED and not _overturned(before, together)
    if same and all(naming) and (any(closed) or agreed):
        found, why = (together, closed[0]) if sure[0] >= sure[1] else (alone, closed[1])
        alike = 'all recordings, and the experiments alone, show the same causes'
        return found, '' if _open_ends(found) else (why or alike)
    for k, (found, other) in enumerate(((together, alone), (alone, together))):
        against = naming[1 - k] and (other['verdict']['confidence'] or 0.0) >= AGREED
        if closed[k] and not against:
            return found, closed[k]
    if free is not None and _named(free) == _named(together):
        return (free, closes(free)) if closes(free) else (together, '')
    # What does not fit together, as after a knock between two recordings, may be sound by itself.
    torn = _unsound(together) and not _unsound(alone)
    better = alone if torn or (naming[1] and not naming[0]) else together
    return better, ''


def _unsound(found: Mapping[str, Any]) -> bool:
    return bool(found['verdict']['status'] == 'unsound')


def _open_ends(found: Mapping[str, Any]) -> bool:
    """
    Return whether causes are named beside each other that some motion would part.

    What can be parted among those named is asked first. So an experiment that asks something else
    found no motion for it; nor did one that would part nothing.
    """
    wanted = found.get('next_experiment')
    if found['verdict']['status'] != 'ambiguous' or wanted is None:
        return bool(found['verdict']['status'] == 'ambiguous')
    sigma = wanted['expected_separation_sigma']
    if sigma is not None and sigma < NOTHING:
        return False
    sides = [{(e['effect'], e.get('joint')) for e in side} for side in wanted.get('between') or ()]
    groups = [{(e['effect'], e.get('joint')) for e in group} for group in sets_named(found)]
    open_ = len(sides) == 2 and any(sides[0] & group and sides[1] & group for group in groups)
    return open_ and not _inseparable(found)


def third_wanted(together: Mapping[str, Any], alone: Mapping[str, Any] | None) -> bool:
    """
    Return whether the experiments should be heard without anything held out.

    Parameters
    ----------
    together, alone : mapping
        As `weighed` takes them.

    """
    if alone is None or closes(together):
        return False
    likely = (together['verdict']['confidence'] or 0.0) >= AGREED
    against = alone['verdict']['status'] not in NAMING
    return together['verdict']['status'] in NAMING and likely and against


def repeat_wanted(
    together: Mapping[str, Any],
    alone: Mapping[str, Any] | None,
    free: Mapping[str, Any] | None,
    before: Mapping[str, Any] | None,
) -> Mapping[str, Any] | None:
    """
    Return the diagnosis that holds if the newest experiment shows the same by itself; None if none.

    What was believed before an experiment was made, and what the experiment shows by itself, have no
    measurement in common. Where all experiments name the same too, and no diagnosis names anything else,
    that is the same answer twice. What all recordings leave unknown is then what the poor
    ones hide. This takes for granted that the two err apart: what the formula of a cause misses on
    every motion, both miss.

    Parameters
    ----------
    together, alone, free, before
        As `weighed` takes them.

    """
    if before is None or alone is None or _of_all(together, alone, free, before)[1]:
        return None
    against = together['verdict']['status'] in NAMING and _named(together) != _named(before)
    held = [found for found in (alone, free) if found and _stated(found, before, AGREED)]
    sure = (before['verdict']['confidence'] or 0.0) >= REPEATED
    if not sure or against or not held or _open_ends(held[0]):
        return None
    return held[0]


def _overturned(before: Mapping[str, Any] | None, found: Mapping[str, Any]) -> bool:
    """
    Return whether other causes are named than were as likely before, or one more.

    A diagnosis of all recordings and one of most of them err alike, as where what a formula misses is
    given a name of its own. To name fewer candidates for the same causes overturns nothing.
    """
    if before is None or not _stated(before, before, REPEATED):
        return False
    then, now = _named(before), _named(found)
    kept = all(any(set(group) & set(other) for other in then) for group in now)
    return not kept or len(then) != len(now)


def _stated(found: Mapping[str, Any], same: Mapping[str, Any], least: float) -> bool:
    """Return whether a diagnosis names the same causes as another, with so much confidence."""
    naming = all(one['verdict']['status'] in NAMING for one in (found, same))
    likely = (found['verdict']['confidence'] or 0.0) >= least
    return naming and likely and _named(found) == _named(same)


def closes(found: Mapping[str, Any]) -> str:
    """
    Return why a diagnosis closes the question by itself; empty where it does not.

    Parameters
    ----------
    found : mapping
        The content of diagnosis.json.

    """
    verdict = found['verdict']
    if (verdict['confidence'] or 0.0) < SURE:
        return ''
    if verdict['status'] == 'identified':
        return 'the causes are identified'
    if verdict['status'] == 'none':
        return 'nothing is left to explain above the noise'
    return ALIKE if verdict['status'] == 'ambiguous' and _inseparable(found) else ''


def _inseparable(found: Mapping[str, Any]) -> bool:
    """Return whether no motion parts what is left."""
    wanted = found.get('next_experiment')
    return wanted is not None and wanted['motion'] is None


def _named(found: Mapping[str, Any]) -> list[list[tuple[str, str]]]:
    """Return the sites of every cause, in an order of their own."""
    groups = sets_named(found)
    return sorted(sorted((e['effect'], e.get('joint') or '') for e in group) for group in groups)


def sets_named(found: Mapping[str, Any]) -> Sequence[Sequence[Mapping[str, Any]]]:
    return found['verdict'].get('indistinguishable') or ()
