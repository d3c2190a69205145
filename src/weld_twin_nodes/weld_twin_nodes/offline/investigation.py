# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
An investigation: diagnose, ask for the measurement that would decide, take it in, go on.

Everything that it knows is in one file, so that days may pass between a question and its answer. Every
question says what it will decide and how long it takes before it is put, and is judged by that
when the recording has come in.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from weld_twin_core.diagnosis.advice.experiment import DECIDES, NOTHING
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.input_files import hashed
from weld_twin_msgs_py.files.whole_files import write_text

STATE, PAGE = 'investigation.json', 'investigation.html'
SCHEMA = 'weld_twin/investigation/1'
MARGIN = 1.5
"""An experiment is made so long that it parts its explanations by this factor more than a decision
needs: how far they will part is foreseen with the effects as they are believed to be."""
FEWEST = 12
"""Stations of an experiment at least: frames and outliers need some."""
STAY = 15.0
"""Time [s] that a station takes with the way to it, as experiments are planned."""
GROUP = {'bidirectional': 4, 'warm_up': 0}
"""Stations that belong together; 0 where none may be left out."""

State = dict[str, Any]


def begin(robot: str, options: Sequence[str], budget: float) -> State:
    """
    Return the state of an investigation without any recording yet.

    Parameters
    ----------
    robot : str
        As the user named it.
    options : sequence of str
        Further words for every diagnosis.
    budget : float [min]
        That all experiments together may take.

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

    Raises
    ------
    DataError
        There is none, or it cannot be read.

    """
    path = directory / STATE
    try:
        content = json.loads(path.read_text(encoding='utf-8'))
    except OSError as error:
        raise DataError(f"'{path}' cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise DataError(f"'{path}' is not JSON: {error}") from None
    if not isinstance(content, dict) or content.get('schema') != SCHEMA:
        raise DataError(f"'{path}' is no investigation")
    return content


def write_state(directory: Path, state: State) -> None:
    """Write the state; it is whole at any time."""
    text = json.dumps(state, indent=1, allow_nan=False)
    write_text(directory / STATE, text + '\n', overwrite=True)


def recordings(state: State) -> list[str]:
    """
    Return the recordings so far.

    Raises
    ------
    DataError
        One of them is gone, or has changed since.

    """
    out = []
    for entry in (item for step in state['rounds'] for item in step['recordings']):
        if hashed('recording', entry['path']).sha256 != entry['sha256']:
            raise DataError(f"'{entry['path']}' has changed since the investigation took it in")
        out.append(str(entry['path']))
    return out


def take_in(state: State, bags: Sequence[str], found: Mapping[str, Any]) -> State:
    """
    Return the state after a diagnosis of all recordings so far.

    Parameters
    ----------
    state : State
    bags : sequence of str
        The new recordings.
    found : mapping
        The content of diagnosis.json.

    """
    rounds = list(state['rounds'])
    spent = float(state['spent_min'])
    if rounds and rounds[-1].get('asked'):
        asked = rounds[-1]['asked']
        spent += float(asked['minutes'])
        rounds[-1] = {**rounds[-1], 'asked': {**asked, 'decided': decided(asked, found)}}
    new = [hashed('recording', Path(bag).resolve())._asdict() for bag in bags]
    step: dict[str, Any] = {'recordings': new, 'believed': believed(found), 'asked': None}
    out = {**state, 'rounds': [*rounds, step], 'spent_min': spent}
    kinds = [r['asked']['kind'] for r in rounds if r.get('asked')]
    answer = question(found, float(state['budget_min']) - spent, kinds)
    if isinstance(answer, dict):
        step['asked'] = answer
        return out
    status, why = answer
    return {**out, 'state': status, 'why': why}


def believed(found: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a diagnosis says, in short."""
    verdict = found['verdict']
    return {
        'status': verdict['status'],
        'confidence': verdict['confidence'],
        'effects': [{'effect': e['effect'], 'joint': e.get('joint')} for e in verdict['effects']],
        'indistinguishable': verdict.get('indistinguishable') or [],
        'candidates': [
            {key: item.get(key) for key in ('effect', 'joint', 'probability')}
            for item in (found.get('candidates') or [])[:6]
        ],
    }


def question(
    found: Mapping[str, Any], left: float, asked: Sequence[str]
) -> dict[str, Any] | tuple[str, str]:
    """
    Return the next experiment, or why there is none: a word for the state, and a sentence.

    Parameters
    ----------
    found : mapping
        The content of diagnosis.json.
    left : float [min]
        Of the budget.
    asked : sequence of str
        Kinds of experiment that were made already.

    """
    status = found['verdict']['status']
    if status in ('identified', 'none', 'unsound'):
        return _ended(status)
    wanted = found.get('next_experiment')
    by_hand = wanted and 'contact' in (wanted.get('motion') or {})
    if not wanted or wanted.get('motion') is None or by_hand:
        told = '' if not wanted else f': {wanted["sentence"]}'
        return 'nothing would part them', f'no motion decides between what is left{told}'
    sigma = wanted['expected_separation_sigma']
    if sigma is not None and sigma < NOTHING:
        return (
            'nothing would part them',
            f'the best experiment would part them by {sigma:.1f} standard deviations only',
        )
    if sigma is None and wanted['kind'] in asked:
        return (
            'nothing would part them',
            'the data were widened once and still no effect of the library explains them',
        )
    made = shortened(wanted)
    if made['minutes'] > left:
        return (
            'budget spent',
            f'the next experiment takes {made["minutes"]:.1f} min and {max(left, 0.0):.1f} are left',
        )
    return made


def _ended(status: str) -> tuple[str, str]:
    if status == 'unsound':
        return 'unsound', 'data or set-up are wrong; the page of the last round says what'
    if status == 'none':
        return 'sure', 'nothing is left to explain above the noise'
    return 'sure', 'the causes are identified'


def shortened(wanted: Mapping[str, Any]) -> dict[str, Any]:
    """
    Return an experiment with no more stations than its decision needs, and its minutes.

    Stations fill the space evenly in their order, so that the first of them do as well; the
    squares of separations add.
    """
    motion, sigma = wanted['motion'], wanted['expected_separation_sigma']
    count = len(motion['t'])
    keep = count
    if motion['static'] and sigma:
        group = GROUP.get(wanted['kind'], 1)
        needed = count * (MARGIN * DECIDES / float(sigma)) ** 2
        if group:
            keep = min(max(-int(-needed // group) * group, FEWEST), count)
    stays = STAY if motion['static'] else 0.0
    whole, part = ((float(motion['t'][k - 1]) + stays) / 60.0 for k in (count, keep))
    # What the experiment costs beyond its motion, such as another tool, stays.
    minutes = max(float(wanted['cost']) - whole, 0.0) + part
    reached = None if sigma is None else float(sigma) * (keep / count) ** 0.5
    sentence, reason = str(wanted['sentence']), str(wanted['reason'])
    if keep < count and reached is not None:
        told = keep // GROUP.get(wanted['kind'], 1)
        sentence = re.sub(r'\b\d+ stations', f'{told} stations', sentence, count=1)
        reason += f' With {told} stations it adds {reached:.0f}, which is enough.'
    return {
        'kind': wanted['kind'],
        'sentence': sentence,
        'reason': reason,
        'minutes': round(minutes, 2),
        'robot_minutes': round(part, 2),
        'stations': keep if motion['static'] else None,
        'expected_sigma': reached,
        'between': wanted.get('between'),
        'motion': {**motion, 't': motion['t'][:keep], 'q': motion['q'][:keep]},
        'decided': None,
    }


def decided(asked: Mapping[str, Any], found: Mapping[str, Any]) -> bool:
    """
    Return whether an experiment decided what it said it would.

    It did where at most one of its two explanations is still among those that cannot be told
    apart; where nothing was compared, where the answer is no longer unknown.

    Parameters
    ----------
    asked : mapping
        As `question` returned it.
    found : mapping
        The content of the diagnosis.json with the new recording.

    """
    verdict = found['verdict']
    if verdict['status'] in ('identified', 'none'):
        return True
    if not asked.get('between'):
        return str(verdict['status']) == 'ambiguous'
    groups = [
        {(item['effect'], item.get('joint')) for item in group}
        for group in verdict.get('indistinguishable') or []
    ]
    one, other = ({(e['effect'], e.get('joint')) for e in side} for side in asked['between'])
    return not any(one & group and other & group for group in groups)
