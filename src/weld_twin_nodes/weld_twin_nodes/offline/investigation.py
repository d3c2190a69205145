# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
An investigation: diagnose, ask for the measurement that would decide, take it in, go on.

Everything that it knows is in one file, so that days may pass between a question and its answer. Every
question says what it will decide and how long it takes before it is put, and is judged by that
when the recording has come in.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from weld_twin_core.diagnosis.advice.chosen_pieces import LEAST, NOTHING
from weld_twin_core.diagnosis.result import NAMING
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.input_files import hashed
from weld_twin_msgs_py.files.whole_files import read_json, write_json

from .closing import ALIKE, closes

STATE, PAGE = 'investigation.json', 'investigation.html'
SCHEMA = 'weld_twin/investigation/1'
SAID = 0.8
"""Probability from which an experiment says that it will decide; below it says that it may."""
FOUND = 0.7
"""Probability from which a place and a dependence count as found; below the rest, as not."""
WIDENED = 3
"""Experiments of one kind without a comparison: more of the same seldom shows anything new."""

State = dict[str, Any]


def begin(robot: str, options: Sequence[str], budget: float) -> State:
    """
    Return the state of an investigation without any recording yet.

    ``robot``: as the user named it. ``options``: further words for every diagnosis. ``budget``
    ([min]): that all experiments together may take.
    """
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
    """
    Return the state of an investigation.

    Raises DataError: there is none, or it cannot be read.
    """
    content = read_json(directory / STATE)
    if content.get('schema') != SCHEMA:
        raise DataError(f"'{directory / STATE}' is no investigation")
    return content


def write_state(directory: Path, state: State) -> None:
    """Write the state; it is whole at any time."""
    write_json(directory / STATE, state, overwrite=True)


def recordings(state: State) -> tuple[list[str], list[str]]:
    """
    Return the recordings that it began with, and those of the experiments so far.

    Raises DataError: one of them is gone, or has changed since.
    """
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
    # What was changed in the cell for the new recordings; every later diagnosis is told.
    changes: str = '',
) -> State:
    """Return the state after a diagnosis of all recordings so far."""
    rounds = list(state['rounds'])
    spent = float(state['spent_min'])
    if rounds and rounds[-1].get('asked'):
        asked = rounds[-1]['asked']
        spent += float(asked['minutes'])
        rounds[-1] = {**rounds[-1], 'asked': {**asked, 'decided': decided(asked, result)}}
    new = [
        {**hashed('recording', Path(bag).resolve())._asdict(), 'changed': changes} for bag in bags
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
    Return the next experiment, or why there is none: a word for the state, and a sentence.

    ``result``: the content of diagnosis.json. ``remaining`` [min]: of the budget. ``asked``:
    kinds of experiment that were made already. ``why``: why the question is closed, as `weighed`
    tells it; left out, this diagnosis alone counts.
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
        reported = '' if not wanted else f': {wanted["sentence"]}'
        return 'nothing would part them', f'no motion decides between what is left{reported}'
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

    ``asked``: as `question` returned it. ``result``: the content of the diagnosis.json with the
    new recording.
    """
    if not asked.get('between'):
        return None
    verdict = result['verdict']
    if verdict['status'] == 'unknown':
        found_causes = verdict.get('causes') or []
        # What has nothing of its own holds where the other does not.
        known = [_held(side, found_causes) for side in asked['between'] if side]
        known += [1.0 - known[0]] if len(known) == 1 else []
        return max(known) >= FOUND and min(known) <= 1.0 - FOUND
    if verdict['status'] not in (*NAMING, 'none'):
        return False
    groups = [
        {(item['effect'], item.get('joint')) for item in group}
        for group in verdict.get('indistinguishable') or []
    ]
    first, second = ({(e['effect'], e.get('joint')) for e in side} for side in asked['between'])
    return not any(first & group and second & group for group in groups)


def _held(side: Sequence[Mapping[str, Any]], causes: Sequence[Mapping[str, Any]]) -> float:
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
