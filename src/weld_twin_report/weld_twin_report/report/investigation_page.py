# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of an investigation: the way from what was believed to what came back, as a tree."""

from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any

from weld_twin_core.diagnosis.result import Site
from weld_twin_nodes.offline.investigation import foreseen
from weld_twin_nodes.wording.quantities import odds
from weld_twin_nodes.wording.words import cause, in_words, listed, place_name

from .html import Child, Figure, Html, bars, document, figures, main, section, tag

SHOWN = 5
"""Hypotheses that a round shows at most; further ones have little probability left."""
LEAST = 0.005
"""Probability below which a hypothesis is not shown: it would read as 0 %."""
WITHOUT_NAME = ('joint_curve', 'frame_curve')
"""Curves that stand for causes without a formula."""
CHANGES = {
    'load': 'a weight hung from the tool point',
    'tool': 'another tool',
    'instrument': 'the instrument at another place',
}
"""What may be changed in the cell, in words."""

Round = Mapping[str, Any]


def investigation_page(state: Mapping[str, Any]) -> str:
    rounds = state['rounds']
    nodes: list[Html] = []
    for k, step in enumerate(rounds):
        after = rounds[k + 1] if k + 1 < len(rounds) else None
        nodes.append(_believed(k, step))
        if step['asked']:
            nodes.append(_asked(step, after))
    if state['state'] != 'open':
        end = tag('p', tag('b', str(state['state'])), f': {state["why"]}')
        nodes.append(tag('li.end', tag('h3', 'Ended'), end))
    body = main(
        ('Investigation ', str(state['state'])),
        str(state['robot']),
        headline(state),
        _figures(state),
        section(
            'The way there',
            tag('ol.way', *nodes),
            id_='way',
            lead='From top to bottom: what was believed, what was asked, and what came back. '
            'A fork shows the two explanations that a measurement was to part.',
        ),
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
    foreseen = [a['promise'] for a in judged if a.get('promise') is not None]
    words = 'experiments decided what they were to decide'
    if foreseen:
        words += f'; {sum(foreseen):.1f} were foreseen'
    cells: list[Figure] = [
        ('Belief', str(last['status']), '' if sure is None else f'{odds(sure)} sure'),
        (
            'Minutes',
            f'{state["spent_min"]:.1f}',
            f'of {state["budget_min"]:g} that may be spent on experiments',
        ),
        ('Decided', f'{sum(bool(a["decided"]) for a in judged)} of {len(judged)}', words),
    ]
    return figures(cells)


def _believed(number: int, step: Round) -> Html:
    """Return a node of the tree: what came back, and what is believed with it."""
    belief, names = step['believed'], [_file(item) for item in step['recordings']]
    came = 'Recorded' if number == 0 else 'Came back'
    sure = '' if belief['confidence'] is None else f', {odds(belief["confidence"])} sure'
    named = listed([_name(effect) for effect in belief['effects']]) or _without_name(belief)
    alike = [
        tag('p.note', f'Not told apart: {listed([_name(item) for item in group])}.')
        for group in belief['indistinguishable']
        if len(group) > 1
    ]
    rows = [
        (_name(item), float(item['probability']), odds(float(item['probability'])))
        for item in belief['candidates']
        if (item['probability'] or 0.0) >= LEAST
    ]
    return tag(
        'li.believed',
        tag('h3', f'{came}: {listed(names)}'),
        tag('p', tag('b', f'Believed, {belief["status"]}: '), f'{named}{sure}.'),
        *alike,
        bars(rows[:SHOWN], 'wide') if rows else None,
        id_=f'round-{number}',
    )


def _file(item: Mapping[str, Any]) -> str:
    path = PurePath(str(item['path']))
    name = path.name if path.name != 'recording' else f'{path.parent.name}/{path.name}'
    kind = str(item.get('changed') or '').partition('=')[0]
    return f'{name} (with {CHANGES[kind]})' if kind in CHANGES else name


def _without_name(belief: Mapping[str, Any]) -> str:
    sides = [
        f'{item["share"]:.0%} of the gap at {place_name(item["at"])}, by {item["on"]}'
        for item in belief.get('causes') or []
    ]
    return f'no name fits; {listed(sides)}' if sides else 'nothing named'


def _asked(step: Round, after: Round | None) -> Html:
    """Return a node of the tree: the measurement, what it said beforehand, and its fork."""
    asked = step['asked']
    text = tag('p', _in_words(asked['sentence'], step), ' ', _in_words(asked['reason'], step))
    verdicts = {
        None: 'It promised to show more, not to decide.',
        True: 'It decided that.',
        False: 'It did not decide that.',
    }
    answer = 'Not back yet.' if after is None else verdicts[asked['decided']]
    parts = []
    if asked['stations']:
        parts.append(f'{asked["stations"]} stations')
    if asked['expected_sigma'] is not None:
        parts.append(f'expected to part them by {asked["expected_sigma"]:.0f} standard deviations')
    parts.append(foreseen(asked))
    kind = str(asked.get('changes') or '').partition('=')[0]
    if kind in CHANGES:
        parts.append(f'with {CHANGES[kind]}')
    return tag(
        'li.asked',
        tag('h3', f'Asked, {asked["minutes"]:.1f} minutes'),
        text,
        tag('p.note', f'Said before: {"; ".join(parts)}.'),
        _fork(asked, after) if asked['between'] else None,
        tag('p', tag('b', answer)),
    )


def _fork(asked: Mapping[str, Any], after: Round | None) -> Html:
    """Return the two explanations, and which of them is left."""
    sides = []
    one, other = asked['between']
    for side, against in ((one, other), (other, one)):
        stays = None if after is None else _left(side, against, after['believed'])
        name = ' with '.join(_name(item, against) for item in side) or 'neither of that'
        word: Child = {None: None, True: 'left', False: 'ruled out'}[stays]
        mark = tag('span.level', word) if word else None
        class_ = {None: None, True: 'stays', False: 'gone'}[stays]
        sides.append(tag('li', tag('span', name), mark, class_=class_))
    return tag('ul.fork', *sides)


Side = Sequence[Mapping[str, Any]]


def _left(side: Side, against: Side, belief: Mapping[str, Any]) -> bool:
    """
    Return whether an explanation is among what is believed.

    What has nothing of its own is where the other is not; a curve is not where its formula is.
    """
    if not side:
        return not _stands(against, belief)
    nameless = all(item['effect'] in WITHOUT_NAME for item in side)
    formula = against and not any(item['effect'] in WITHOUT_NAME for item in against)
    if nameless and formula and belief['status'] != 'unknown' and _stands(against, belief):
        return False
    return _stands(side, belief)


def _stands(side: Side, belief: Mapping[str, Any]) -> bool:
    kinds = {(c['at'], c['on']) for c in belief.get('causes') or []}
    sites = {(e['effect'], e.get('joint')) for group in belief['indistinguishable'] for e in group}
    sites |= {(e['effect'], e.get('joint')) for e in belief['effects']}
    nameless = belief['status'] == 'unknown'
    return all(
        (item.get('at'), item.get('on')) in kinds
        if nameless or item['effect'] in WITHOUT_NAME
        else (item['effect'], item.get('joint')) in sites
        for item in side
    )


def _in_words(text: str, step: Round) -> str:
    """Return a sentence with causes as people say them."""
    items = [item for side in step['asked']['between'] or () for item in side]
    items += step['believed']['candidates']
    return in_words(text, {Site(item['effect'], item.get('joint')) for item in items})


def _name(item: Mapping[str, Any], against: Side = ()) -> str:
    if item['effect'] not in WITHOUT_NAME or not item.get('at'):
        return cause(str(item['effect']), item.get('joint'))
    alike = any((i.get('at'), i.get('on')) == (item['at'], item['on']) for i in against)
    what, where = 'something else' if alike else 'something', place_name(str(item['at']))
    if item['on'] == 'constant':
        return f'{what} constant at {where}'
    return f'{what} at {where} that depends on {item["on"]}'
