# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of an investigation: what was believed, what was asked, what came back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from weld_twin_core.diagnosis.result import Site

from .html import Html, document, section, table, tag
from .words import cause, in_words


def investigation_page(state: Mapping[str, Any]) -> str:
    """
    Return the page.

    Parameters
    ----------
    state : mapping
        The content of investigation.json.

    """
    rounds = state['rounds']
    body = tag(
        'main',
        tag(
            'header',
            tag('p', 'Investigation ', tag('b', str(state['state'])), class_='kind'),
            tag('p', str(state['robot']), class_='subject'),
        ),
        tag('section', tag('h1', headline(state)), _figures(state), id_='verdict'),
        *(_round(k, step) for k, step in enumerate(rounds)),
    )
    return document(f'Investigation · {state["robot"]}', body)


def headline(state: Mapping[str, Any]) -> str:
    """Return in one sentence where the investigation stands."""
    asked = state['rounds'][-1]['asked'] if state['rounds'] else None
    if state['state'] == 'open' and asked:
        return f'Asked: {asked["sentence"]} It takes {asked["minutes"]:.1f} minutes.'
    word, why = str(state['state']), str(state['why'])
    return f'Ended, {word}: {why}.'


def _figures(state: Mapping[str, Any]) -> Html:
    last = state['rounds'][-1]['believed']
    sure = last['confidence']
    judged = [
        r['asked'] for r in state['rounds'] if r['asked'] and r['asked']['decided'] is not None
    ]
    cells = [
        ('Belief', str(last['status']), '' if sure is None else f'{sure:.0%} sure'),
        (
            'Minutes',
            f'{state["spent_min"]:.1f}',
            f'of {state["budget_min"]:g} that may be spent on experiments',
        ),
        (
            'Decided',
            f'{sum(bool(a["decided"]) for a in judged)} of {len(judged)}',
            'experiments decided what they said they would',
        ),
    ]
    return tag(
        'dl',
        *(
            tag('div', tag('dt', name), tag('dd', value), tag('dd', note, class_='note'))
            for name, value, note in cells
        ),
        class_='figures',
    )


def _round(number: int, step: Mapping[str, Any]) -> Html:
    names = ', '.join(str(item['path']).rpartition('/')[2] for item in step['recordings'])
    return section(
        f'Round {number}',
        tag('h3', 'Believed'),
        _believed(step['believed']),
        *_asked(step),
        id_=f'round-{number}',
        lead=f'With {names}.',
    )


def _believed(belief: Mapping[str, Any]) -> Html:
    sure = '' if belief['confidence'] is None else f', {belief["confidence"]:.0%} sure'
    named = ' and '.join(_name(effect) for effect in belief['effects']) or 'nothing named'
    parts = [tag('p', f'{belief["status"]}: {named}{sure}.')]
    groups = [group for group in belief['indistinguishable'] if len(group) > 1]
    for group in groups:
        alike = ', '.join(_name(item) for item in group)
        parts.append(tag('p', f'Not told apart: {alike}.', class_='lead'))
    rows = [
        (_name(item), f'{item["probability"]:.0%}')
        for item in belief['candidates']
        if item['probability'] is not None
    ]
    return tag('div', *parts, table(('hypothesis', 'probability'), rows) if rows else None)


def _asked(step: Mapping[str, Any]) -> Sequence[Html]:
    asked = step['asked']
    if not asked:
        return []
    sigma = asked['expected_sigma']
    rows = [('minutes', f'{asked["minutes"]:.1f}')]
    if asked['stations']:
        rows.append(('stations', str(asked['stations'])))
    if asked['between']:
        sides = (' with '.join(_name(e) for e in side) or 'the rest' for side in asked['between'])
        rows.append(('to decide between', ' and '.join(sides)))
    if sigma is not None:
        rows.append(('expected to part them by', f'{sigma:.0f} standard deviations'))
    answers = {None: 'not back yet', True: 'it decided that', False: 'it did not decide that'}
    rows.append(('came back', answers[asked['decided']]))
    text = tag('p', _told(asked['sentence'], step), ' ', _told(asked['reason'], step))
    return [tag('h3', 'Asked'), text, table(('', ''), rows)]


def _told(text: str, step: Mapping[str, Any]) -> str:
    """Return a sentence with causes as people say them."""
    items = [item for side in step['asked']['between'] or () for item in side]
    items += step['believed']['candidates']
    return in_words(text, {Site(item['effect'], item.get('joint')) for item in items})


def _name(item: Mapping[str, Any]) -> str:
    return cause(str(item['effect']), item.get('joint'))
