# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
An investigation: diagnose, ask for the measurement that would decide, take it in, go on.

What poor recordings show is easily misread, and then stands in the way of what better ones show. So
all recordings are diagnosed together, and the experiments without the first ones. Each knows how often
answers like it were right; the other speaks for it or against it.
"""

from collections.abc import Mapping, Sequence
from math import exp, log
from pathlib import Path
from typing import Any

from weld_twin_core.diagnosis.advice.chosen_pieces import LEAST, NOTHING
from weld_twin_core.diagnosis.result import NAMING
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.input_files import hashed
from weld_twin_msgs_py.files.whole_files import read_json, write_json

OWN, FOR, AGAINST, BEGIN = 0.36, 0.89, -0.84, 0.82
"""What the log odds of an answer count, those of the other where it names the same, those where it
names something else, and what is added. `weld-twin lab investigate --learn-from` learned them;
docs/investigate.md says from which cells."""
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
    Return which diagnosis to believe, and why it closes the question; empty where it does not.

    alone: that of the experiments without the recordings before them. If both name the same, it is
    that of all recordings, with the confidence of both, unless only the other closes the question.
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
    """Return why a diagnosis closes the question by itself; empty where it does not."""
    verdict = result['verdict']
    if not is_sure(verdict) or verdict['status'] not in STATED:
        return ''
    open_ = verdict['status'] == 'ambiguous' and not _inseparable(result)
    # Joints that hardly moved may have to move before anything is sure.
    confirms = (result.get('next_experiment') or {}).get('confirms')
    return '' if open_ or confirms else _words(result)


def is_sure(verdict: Mapping[str, Any]) -> bool:
    """Return whether an answer of diagnosis.json, of either schema, is reported as sure."""
    sure = verdict.get('sure')
    return float(verdict['confidence'] or 0.0) >= OLDER if sure is None else bool(sure)


def belief(result: Mapping[str, Any], other: Mapping[str, Any]) -> float:
    """Return how probable an answer is, with another of most of the same measurements."""
    own, same, against = signs(result, other)
    total = OWN * own + FOR * same + AGAINST * against + BEGIN
    return min(1.0 / (1.0 + exp(-total)), MOST)


def signs(result: Mapping[str, Any], other: Mapping[str, Any]) -> tuple[float, float, float]:
    """
    Return the log odds of an answer, and of another as far as it speaks for it, and against it.

    The other counts where it is likelier right than wrong. What it leaves unknown speaks for nothing:
    it may be what poor recordings hide.
    """
    stated = other['verdict']['status'] in STATED
    heard = max(_log_odds(other), 0.0) if stated else 0.0
    backed = _same(result, other, no_wider=True)
    return _log_odds(result), heard * backed, heard * (not _same(result, other))


def _log_odds(result: Mapping[str, Any]) -> float:
    verdict = result['verdict']
    learned = verdict.get('learned')
    probability = float((verdict['confidence'] if learned is None else learned) or 0.0)
    bounded = min(max(probability, EXTREME), 1.0 - EXTREME)
    return log(bounded / (1.0 - bounded))


def _with_belief(result: Mapping[str, Any], other: Mapping[str, Any]) -> Mapping[str, Any]:
    verdict = result['verdict']
    if verdict['status'] not in STATED:
        return result
    probability = belief(result, other)
    earned = {'confidence': probability, 'learned': probability, 'sure': probability >= CLOSED}
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
    """Return what each cause that is named may be: sets of effect and joint."""
    return [_sites_of(group) for group in result['verdict'].get('indistinguishable') or ()]


def _sites_of(entries: Sequence[Mapping[str, Any]]) -> set[tuple[str, str | None]]:
    return {(entry['effect'], entry.get('joint')) for entry in entries}


def _together(result: Mapping[str, Any], first: Any, second: Any) -> bool:
    """Return whether a set that is named has some of both explanations."""
    sides = _sites_of(first), _sites_of(second)
    return any(sides[0] & group and sides[1] & group for group in _sites(result))


def _words(result: Mapping[str, Any]) -> str:
    endings = {'identified': 'the causes are identified', 'ambiguous': ALIKE}
    return endings.get(result['verdict']['status'], 'nothing is left to explain above the noise')


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
    sides = wanted.get('between') or ()
    return len(sides) == 2 and _together(result, *sides) and not _inseparable(result)


def _inseparable(result: Mapping[str, Any]) -> bool:
    wanted = result.get('next_experiment')
    return wanted is not None and wanted['motion'] is None


STATE, PAGE = 'investigation.json', 'investigation.html'
SCHEMA = 'weld_twin/investigation/1'
SAID = 0.8
"""Probability from which an experiment says that it will decide; below it says that it may."""
IDENTIFIED = 0.7
"""Probability from which a place and a dependence count as found; below the rest, as not."""
WIDENED = 3
"""Experiments of one kind without a comparison: more of the same seldom shows anything new."""

State = dict[str, Any]


def begin(robot: str, options: Sequence[str], budget: float) -> State:
    """Return the state of an investigation without any recording yet; its budget is in minutes."""
    return {
        'schema': SCHEMA,
        'robot': robot,
        'options': list(options),
        'budget_min': budget,
        'spent_min': 0.0,
        'state': 'open',
        'why': '',
        'rounds': [],
    }


def read_state(directory: Path) -> State:
    content = read_json(directory / STATE)
    if content.get('schema') != SCHEMA:
        raise DataError(f"'{directory / STATE}' is no investigation")
    return content


def write_state(directory: Path, state: State) -> None:
    """Write the state; it is whole at any time."""
    write_json(directory / STATE, state, overwrite=True)


def recordings(state: State) -> tuple[list[str], list[str]]:
    """Return the recordings that it began with, and those of the experiments so far."""
    first: list[str] = []
    later: list[str] = []
    for k, step in enumerate(state['rounds']):
        for entry in step['recordings']:
            if hashed('recording', entry['path']).sha256 != entry['sha256']:
                raise DataError(
                    f"'{entry['path']}' has changed since the investigation took it in"
                )
            (later if k else first).append(str(entry['path']))
    return first, later


def changed(state: State) -> dict[str, str]:
    """Return by path for which recordings something was changed in the cell, and what."""
    taken = [entry for step in state['rounds'] for entry in step['recordings']]
    return {str(entry['path']): entry['changed'] for entry in taken if entry.get('changed')}


def take_in(
    state: State,
    bags: Sequence[str],  # the new recordings
    result: Mapping[str, Any],  # the content of diagnosis.json
    # Why it closes the question, as `weighed` tells it; left out, this diagnosis alone counts.
    why: str | None = None,
    # What was changed in the cell for the new recordings; every later diagnosis needs it.
    changes: str = '',
) -> State:
    """Return the state after a diagnosis of all recordings so far."""
    rounds = list(state['rounds'])
    spent = float(state['spent_min'])
    if rounds and rounds[-1].get('asked'):
        asked = rounds[-1]['asked']
        spent += float(asked['minutes'])
        rounds[-1] = {**rounds[-1], 'asked': {**asked, 'decided': decided(asked, result)}}
    # What was diagnosed counts, whatever has taken its place meanwhile.
    read = {each['path']: {'sha256': each['sha256']} for each in result.get('inputs') or ()}
    new = [
        hashed('recording', Path(bag).resolve())._asdict()
        | read.get(str(bag), {})
        | {'changed': changes}
        for bag in bags
    ]
    step: dict[str, Any] = {'recordings': new, 'believed': believed(result), 'asked': None}
    out = {**state, 'rounds': [*rounds, step], 'spent_min': spent}
    kinds = [r['asked']['kind'] for r in rounds if r.get('asked')]
    answer = question(result, float(state['budget_min']) - spent, kinds, why)
    if isinstance(answer, dict):
        step['asked'] = answer
        return out
    status, reason = answer
    return {**out, 'state': status, 'why': reason}


def believed(result: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a diagnosis says, in short."""
    verdict = result['verdict']
    return {
        'status': verdict['status'],
        'confidence': verdict['confidence'],
        'sure': verdict.get('sure'),
        'effects': [{'effect': e['effect'], 'joint': e.get('joint')} for e in verdict['effects']],
        'indistinguishable': verdict.get('indistinguishable') or [],
        'candidates': [
            {key: item.get(key) for key in ('effect', 'joint', 'probability')}
            for item in (result.get('candidates') or [])[:6]
        ],
        'causes': [
            {
                'at': cause['place'][0]['at'],
                'on': cause['dependence'][0]['on'],
                'share': cause['share'],
            }
            for cause in verdict.get('causes') or []
            if cause['place'] and cause['dependence']
        ],
    }


def question(
    result: Mapping[str, Any], remaining: float, asked: Sequence[str], why: str | None = None
) -> dict[str, Any] | tuple[str, str]:
    """
    Return the next experiment within the minutes that remain, or a word and a sentence why none.

    ``why``: why the question is closed, as `weighed` tells it; left out, this diagnosis counts.
    """
    if result['verdict']['status'] == 'unsound':
        return 'unsound', 'data or set-up are wrong; the page of the last round says what'
    why = closes(result) if why is None else why
    if why:
        return ('nothing would part them' if why == ALIKE else 'sure'), why
    wanted = result.get('next_experiment')
    by_hand = wanted and 'contact' in (wanted.get('motion') or {})
    sigma = wanted['expected_separation_sigma'] if wanted else None
    if (not wanted or (sigma is not None and 0.0 < sigma < NOTHING)) and short(remaining):
        return (
            'budget spent',
            f'{max(remaining, 0.0):.1f} min are left, and nothing that fits in would part what is left',
        )
    if not wanted or wanted.get('motion') is None or by_hand:
        instead = '' if not wanted else f': {wanted["sentence"]}'
        return 'nothing would part them', f'no motion decides between what is left{instead}'
    if sigma is not None and sigma < NOTHING:
        return (
            'nothing would part them',
            f'the best experiment would part them by {sigma:.1f} standard deviations only',
        )
    if sigma is None and list(asked).count(wanted['kind']) >= WIDENED:
        return (
            'nothing would part them',
            f'the data were widened {WIDENED} times and still nothing is sure',
        )
    if wanted['cost'] > remaining:
        return (
            'budget spent',
            f'the next experiment takes {wanted["cost"]:.1f} min and {max(remaining, 0.0):.1f} are left',
        )
    return _asked(wanted)


def short(remaining: float) -> bool:
    """Return whether fewer minutes are left than a usual experiment takes at the least."""
    return 60.0 * remaining < LEAST


def _asked(wanted: Mapping[str, Any]) -> dict[str, Any]:
    """Return an experiment as the state keeps it: what it says before it is made."""
    return {
        'kind': wanted['kind'],
        'sentence': str(wanted['sentence']),
        'reason': str(wanted['reason']),
        'minutes': wanted['cost'],
        'robot_minutes': wanted['robot_minutes'],
        'stations': wanted['stations'],
        'expected_sigma': wanted['expected_separation_sigma'],
        'between': wanted.get('between'),
        'promise': wanted.get('promise'),
        'changes': wanted.get('changes') or '',
        'motion': wanted['motion'],
        'decided': None,
    }


def foreseen(asked: Mapping[str, Any]) -> str:
    """Return in words what an experiment says of itself before it is made."""
    promise = asked.get('promise')
    if promise is None:
        return 'it compares nothing, and shows more of the arm'
    word = 'will decide' if promise >= SAID else 'may decide'
    return f'it {word}, with a probability of {promise:.0%}'


def decided(asked: Mapping[str, Any], result: Mapping[str, Any]) -> bool | None:
    """
    Return whether an experiment decided what it said it would; None where it said nothing.

    It did where causes are named now, or excluded, and at most one of its two explanations is
    among those that cannot be told apart. Where still no name fits, it did if the place and the
    dependence of one of the two are found, and those of the other are not.
    """
    if not asked.get('between'):
        return None
    verdict = result['verdict']
    if verdict['status'] == 'unknown':
        causes = verdict.get('causes') or []
        # What has nothing of its own holds where the other does not.
        known = [_support(side, causes) for side in asked['between'] if side]
        known += [1.0 - known[0]] if len(known) == 1 else []
        return max(known) >= IDENTIFIED and min(known) <= 1.0 - IDENTIFIED
    if verdict['status'] not in (*NAMING, 'none'):
        return False
    return not _together(result, *asked['between'])


def _support(side: Sequence[Mapping[str, Any]], causes: Sequence[Mapping[str, Any]]) -> float:
    """Return how far the places and dependences of a side are found."""
    each = []
    for item in side:
        pairs = [
            (_level(cause['place'], 'at', item), _level(cause['dependence'], 'on', item))
            for cause in causes
        ]
        each.append(max((min(pair) for pair in pairs), default=0.0))
    return min(each)


def _level(listed: Sequence[Mapping[str, Any]], key: str, item: Mapping[str, Any]) -> float:
    return max((float(e['probability']) for e in listed if e[key] == item.get(key)), default=0.0)
