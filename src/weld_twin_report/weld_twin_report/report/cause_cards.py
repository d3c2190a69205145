# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The causes, largest share of the gap first, each on a card: what, how much, what to do."""

from __future__ import annotations

import numpy as np

from weld_twin_core.metrics.conformity import Rule
from weld_twin_nodes.wording.quantities import counted
from weld_twin_nodes.wording.switches import MOST, cause_name, switches

from .acceptance import mark
from .answer import Answer
from .cause_answer import LEVEL_HEADS, CauseAnswer
from .charts import Axis, Line, chart
from .curve_plot import curve_figure, furthest_off
from .html import Child, Html, joined, lines, pairs, section, table, tag
from .page_data import along, drawn, static
from .seam_view import at_rest
from .to_do import warned

_TRIVIAL = 1e-4
"""Share of the squared gap below which a cause has no card: it moves nothing anybody sees."""
_APART = 0.03
"""Share of the squared gap by which a cause moves the tool beyond its share, to be told."""
_VALUES = 4
"""Parameters told on a card; effects.yaml has all."""
_EFFECT = ('Effect on the seam', 'Effect at the stations')
"""What a cause does, along a motion and at stations at rest."""


def causes_cards(answer: Answer) -> Html | None:
    """Return the shares of the gap and a card for every cause; None without any."""
    # A cause matters that holds a share, or at least moves the tool so that mending it shows.
    big = [c for c in answer.causes if max(c.cause.share, c.own_square) >= _TRIVIAL]
    shown = big[:MOST]
    if not shown:
        return None
    rest = [reported for reported in answer.causes if reported not in shown]
    cards = [_card(answer, reported, rank) for rank, reported in enumerate(shown, 1)]
    return section(
        'What causes it',
        _shares(answer, shown, rest),
        tag('div.cards', *cards),
        _smaller(rest),
        id_='cards',
        lead='How much of the gap each cause makes, counted in squares so that all shares, with what '
        f'is left and the noise, add up to 100\N{NO-BREAK SPACE}%. In brackets: where the true share '
        f'lies, 90\N{NO-BREAK SPACE}% sure.{_against(shown)}',
    )


def _against(shown: list[CauseAnswer]) -> str:
    """Return how to read a share that is far smaller than what its cause moves."""
    if all(reported.own_square < reported.cause.share + _APART for reported in shown):
        return ''
    return (
        ' Causes that move the tool at the same instants share what they explain together: a small '
        'share can belong to a cause whose mending is worth it. Its card says what that brings.'
    )


def _shares(answer: Answer, shown: list[CauseAnswer], rest: list[CauseAnswer]) -> Html:
    """Return one row for each cause, for what is left and for the noise: a whole of 100 %."""
    rows: list[tuple[str, float, str, str]] = []
    for rank, reported in enumerate(shown, 1):
        value, ends = answer.share_of(reported)
        label = f'{rank}. {cause_name(answer.diagnosis, reported.cause)}'
        rows.append((label, reported.cause.share, f'{value} ({ends})', 'cause'))
    smaller = sum(reported.cause.share for reported in rest)
    if smaller > 0.0:
        rows.append(('smaller causes', smaller, answer.percent(smaller), 'cause'))
    rows += [(name, share, answer.percent(share), 'rest') for name, share in answer.remainder]
    items = [
        tag(
            'li',
            tag('span.label', label),
            tag('span.track', tag('i', style=f'width:{100.0 * share:.2f}%')),
            tag('span.figure', text),
            class_=kind,
        )
        for label, share, text, kind in rows
    ]
    return tag('ul.bars.wide.shares', *items)


def _card(answer: Answer, reported: CauseAnswer, rank: int) -> Html:
    off = reported.off_by
    more = [f'and {len(off) - _VALUES} more'] if len(off) > _VALUES else []
    entries: list[tuple[str, Child]] = [
        ('What that is', lines(reported.meaning)),
        ('How sure', _sure(reported)),
        ('By how much', lines([*off[:_VALUES], *more])),
        ('Stands on', reported.stands_on),
        (_EFFECT[at_rest(answer.diagnosis)], _effect(reported)),
        ('If only this is mended', _mended(reported, answer.rule)),
        ('What to do', lines(joined(warned(text)) for text in reported.to_do)),
        reported.at_the_controller,
    ]
    return tag(
        'article.card',
        tag('h3', tag('span.rank', str(rank)), reported.name),
        tag('p.share', tag('b', answer.percent(reported.cause.share)), ' of the gap'),
        _box(reported),
        _picture(reported),
        pairs(entries),
        id_=f'cause-{rank}',
    )


def _box(reported: CauseAnswer) -> Html | None:
    """Return the switch that thinks this cause mended."""
    for at, switch in enumerate(switches(reported.diagnosis)):
        if switch.members == (reported.k,):
            box = tag('input', type='checkbox', data_switch=at, checked='')
            return tag('label.one-switch', box, ' take as mended')
    return None


def _sure(reported: CauseAnswer) -> Html | None:
    """Return how sure a cause is, and for engineers what each level of it is believed to be."""
    levels = tag('summary', 'place, dependence and name'), reported.levels
    folded = tag('details.detail', *levels) if reported.levels else None
    return (
        tag('span.lines', *(tag('span', text) for text in reported.sure), folded)
        if (reported.sure)
        else None
    )


def _effect(reported: CauseAnswer) -> Html | None:
    if reported.moves is None:
        return None
    most, ways = reported.moves
    return joined([most, tag('span.detail', ways) if ways else None])


def _mended(reported: CauseAnswer, rule: Rule | None) -> Html | None:
    """Return the gap that would be left if only this were mended, and whether that passes."""
    if reported.mended is None or reported.left is None or rule is None:
        return None
    after, how = reported.mended
    return joined([after, mark(rule, reported.left.largest_after, ', '), '.', how or None])


def _picture(reported: CauseAnswer) -> Html | None:
    """Return how far the cause moves the tool along the recording, or its curve."""
    diagnosis = reported.diagnosis
    curve = furthest_off(diagnosis, reported.cause)
    # A constant is one value, and no picture.
    if curve is not None and curve[1].over != 'constant':
        return curve_figure(diagnosis, *curve)
    if reported.most is None:
        return None
    run = reported.most[0]
    index = drawn(diagnosis, run)
    size = 1e3 * np.linalg.norm(reported.moved[run][index], axis=1)
    dots = static(diagnosis, run)
    return chart(
        'How far it moves the tool',
        along(diagnosis, run)[index],
        [Line('moves the tool', size, 'accent', points=dots)],
        (Axis('station') if dots else Axis('time', 's'), Axis('by', 'mm')),
        key=f'run{run}',
        from_zero=True,
        height=120,
    )


def _smaller(rest: list[CauseAnswer]) -> Html | None:
    if not rest:
        return None
    return tag(
        'details.detail',
        tag('summary', counted(len(rest), 'smaller cause')),
        table(LEVEL_HEADS, [reported.row for reported in rest], 'levels'),
    )
