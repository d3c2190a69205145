# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The causes: each on a card, largest share of the gap first, and for engineers what was considered."""

from collections.abc import Sequence

import numpy as np

from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_core.effects import REGISTRY
from weld_twin_core.metrics.conformity import Rule
from weld_twin_nodes.wording import words
from weld_twin_nodes.wording.mending import MOST, cause_name, switches
from weld_twin_nodes.wording.quantities import (
    MISSING,
    both_angles,
    counted,
    millimetres,
    shrink_elsewhere,
    shrink_ratio,
    turns_only,
)

from .acceptance import mark
from .answer import Answer
from .cause_answer import LEVEL_HEADS, CauseAnswer
from .charts import Axis, Line, chart, curve_figure, furthest_off
from .html import Bar, Child, Html, bars, joined, lines, pairs, section, sentences, table, tag
from .page_data import along, at_rest, drawn, static
from .sections import Content, on_page
from .to_do import reason_and_joints, untried, warned

_TRIVIAL = 1e-4
"""Share of the squared gap below which a cause has no card: it moves nothing anybody sees."""
_APART = 0.03
"""Share of the squared gap by which a cause moves the tool beyond its share, to be reported."""
_VALUES = 4
"""Parameters listed on a card; effects.yaml has all."""
_EFFECT = ('Effect on the seam', 'Effect at the stations')
"""What a cause does, along a motion and at stations at rest."""


@on_page('answer', 20)
def causes_cards(page: Content) -> Html | None:
    """Return the shares of the gap and a card for every cause; None without any."""
    answer = page.answer
    # A cause matters that holds a share, or at least moves the tool so that mending it shows.
    big = [c for c in answer.causes if max(c.cause.share, c.own_square) >= _TRIVIAL]
    shown = big[:MOST]
    if not shown:
        return None
    rest = [item for item in answer.causes if item not in shown]
    cards = [_card(answer, item, rank) for rank, item in enumerate(shown, 1)]
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
    if all(item.own_square < item.cause.share + _APART for item in shown):
        return ''
    return (
        ' Causes that move the tool at the same instants share what they explain together: a small '
        'share can belong to a cause whose mending is worth it. Its card says what that brings.'
    )


def _shares(answer: Answer, shown: list[CauseAnswer], rest: list[CauseAnswer]) -> Html:
    """Return one row for each cause, for what is left and for the noise: a whole of 100 %."""
    rows: list[Bar] = []
    for rank, item in enumerate(shown, 1):
        value, ends = answer.share_of(item)
        label = f'{rank}. {cause_name(answer.diagnosis, item.cause)}'
        rows.append(Bar(label, item.cause.share, f'{value} ({ends})', 'cause'))
    smaller = sum(item.cause.share for item in rest)
    if smaller > 0.0:
        rows.append(Bar('smaller causes', smaller, answer.percent(smaller), 'cause'))
    rows += [Bar(name, share, answer.percent(share), 'rest') for name, share in answer.remainder]
    return bars(rows, 'wide shares')


def _card(answer: Answer, item: CauseAnswer, rank: int) -> Html:
    off = item.off_by
    more = [f'and {len(off) - _VALUES} more'] if len(off) > _VALUES else []
    entries: list[tuple[str, Child]] = [
        ('What that is', lines(item.meaning)),
        ('How sure', _sure(item)),
        ('By how much', lines([*off[:_VALUES], *more])),
        ('Stands on', item.stands_on),
        (_EFFECT[at_rest(answer.diagnosis)], _effect(item)),
        ('If only this is mended', _mended(item, answer.rule)),
        ('What to do', lines(joined(warned(text)) for text in item.to_do)),
        item.at_the_controller,
    ]
    return tag(
        'article.card',
        tag('h3', tag('span.rank', str(rank)), item.name),
        tag('p.share', tag('b', answer.percent(item.cause.share)), ' of the gap'),
        _box(item),
        _picture(item),
        pairs(entries),
        id_=f'cause-{rank}',
    )


def _box(item: CauseAnswer) -> Html | None:
    """Return the switch that thinks this cause mended."""
    for at, switch in enumerate(switches(item.diagnosis)):
        if switch.members == (item.k,):
            box = tag('input', type='checkbox', data_switch=at, checked='')
            return tag('label.one-switch', box, ' take as mended')
    return None


def _sure(item: CauseAnswer) -> Html | None:
    """Return how sure a cause is, and for engineers what each level of it is believed to be."""
    levels = tag('summary', 'place, dependence and name'), item.levels
    folded = tag('details.detail', *levels) if item.levels else None
    return (
        tag('span.lines', *(tag('span', text) for text in item.sure), folded)
        if (item.sure)
        else None
    )


def _effect(item: CauseAnswer) -> Html | None:
    if item.moves is None:
        return None
    most, ways = item.moves
    return joined([most, tag('span.detail', ways) if ways else None])


def _mended(item: CauseAnswer, rule: Rule | None) -> Html | None:
    """Return the gap that would be left if only this were mended, and whether that passes."""
    if item.mended is None or item.remaining is None or rule is None:
        return None
    after, how = item.mended
    return joined([after, mark(rule, item.remaining.largest_after, ', '), '.', how or None])


def _picture(item: CauseAnswer) -> Html | None:
    """Return how far the cause moves the tool along the recording, or its curve."""
    diagnosis = item.diagnosis
    curve = furthest_off(diagnosis, item.cause)
    # A constant is one value, and no picture.
    if curve is not None and curve[1].over != 'constant':
        return curve_figure(diagnosis, *curve)
    if item.most is None:
        return None
    run = item.most[0]
    index = drawn(diagnosis, run)
    size = 1e3 * np.linalg.norm(item.moved[run][index], axis=1)
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
        table(LEVEL_HEADS, [item.row for item in rest], 'levels'),
    )


_CANDIDATES = 6
"""Hypotheses shown for a cause."""
_SLOTS = 6
"""Places of which alternatives are listed."""
_KINDS = (
    'A kind is named where data that were not fitted get worse without it by a tenth or '
    'more in the median part left out, and better in none; all other kinds that are '
    'needed and the frames are fitted anew each time. Exchangeable: the other kinds take '
    'its place. Every member and order is in effects.yaml.'
)
_INSTEAD = (
    'No effect is named. These come nearest; figures and pictures are with the curves on the cards '
    'above.'
)
_STAND_IN = (
    'No effect is named. These imitate the unknown cause together; figures and pictures that say '
    'after are with them.'
)
_GROUP = 'A group for every cause: what was found, and what else it could be. '
_RIVALS = (
    'They are weighed against each other only, as if one of them had to be it; how sure it is '
    'stands on the card.'
)
_BARS = 'All bars have one scale: what would be left of the gap; a full bar is all of it.'
_ABOVE = 1.5
"""Ratio to the noise floor above which what remains is not at its level."""
_NONE = (
    'Nothing: in these recordings no other effect looks like one of those named. How sure each is '
    'stands on its card.',
    'Nothing of what could be tried. How sure each is stands on its card.',
)
"""What is said where nothing looks alike: where all effects were tried, and where some could not be."""
_STILL = 'hardly moves'
_ENOUGH = (
    'Each effect needs a motion of its own kind to show, so joints that move enough for one can '
    'stand here for another.'
)


@on_page('engineers', 10)
def causes_section(page: Content) -> Html:
    """Return parameters, candidates and equivalence sets."""
    answer, diagnosis = page.answer, page.diagnosis
    return section(
        'Which effect',
        _found(answer),
        _candidates(answer),
        _sets(answer),
        _absent(diagnosis),
        id_='causes',
    )


@on_page('engineers', 20)
def changed_section(page: Content) -> Html | None:
    """Return what the later recordings have that the first has not; None where it was not asked."""
    answer, changed = page.answer, page.answer.changed
    if changed is None:
        return None
    none = tag('p', answer.nothing_changed)
    return section(
        'What changed between the recordings',
        table(changed.heads, changed.rows, 'changed') if changed.rows else none,
        id_='changed',
        lead=f'Against {answer.diagnosis.recordings[0].name}; the causes above are what all have in '
        'common.',
    )


def _found(answer: Answer) -> Html | None:
    if not answer.found:
        return None if answer.diagnosis.model.found else tag('p', 'No effect was found.')
    parts: list[Html] = []
    for k, (title, heads, rows) in enumerate(answer.found):
        if not answer.diagnosis.families:
            rows = [
                [name, words.parameter_word(parameter), *rest] for name, parameter, *rest in rows
            ]
        parts += [tag('h3', title), table(heads, rows, '' if k else 'effects')]
    if answer.diagnosis.families:
        parts.insert(2, tag('p.note', _KINDS))
    return joined(parts)


def _candidates(answer: Answer) -> Html | None:
    """Return the hypotheses for every cause, the most probable first."""
    diagnosis, groups = answer.diagnosis, answer.alternatives
    if not groups:
        return None
    named = bool(diagnosis.effects)
    parts = [
        bars(
            [
                # What only stands in is not compared.
                (r.name, r.length, f'{r.likely} · ' * named + f'leaves {r.left} ({r.change})')
                for r in group[:_CANDIDATES]
            ],
            'wide',
        )
        for group in groups[:_SLOTS]
    ]
    more = sum(map(len, groups)) - sum(len(g[:_CANDIDATES]) for g in groups[:_SLOTS])
    note = tag('p.note', f'{more} more in diagnosis.json.') if more > 0 else None
    if not named:
        title = 'What fits best, though no cause is named'
        lead = _INSTEAD if words.carries_curves(diagnosis) else _STAND_IN
    else:
        title = 'Candidates against each other'
        lead = f'{_GROUP if len(groups) > 1 else ""}{_RIVALS}'
    intro = tag('p.note', f'{lead} {_BARS}')
    return joined([tag('h3', title), intro, *parts, note])


def _sets(answer: Answer) -> Html | None:
    diagnosis = answer.diagnosis
    if not diagnosis.effects:
        return None
    every = {site for group in words.open_sets(diagnosis) for site in group}
    reasons = sentences(words.in_words(reason, every) for reason in diagnosis.reasons)
    if answer.open:
        guess = sentences(
            f'{names}: naming one of them would be a guess.' for names in answer.open
        )
        parts = [guess, *([tag('p', 'Why:'), reasons] if diagnosis.reasons else [])]
    elif diagnosis.families:
        parts = [reasons]
    elif diagnosis.same:
        parts = [sentences(words.same_words(diagnosis))]
    else:
        none = f'{_NONE[bool(untried(diagnosis))]} {untried(diagnosis)}'
        parts = [tag('p', none.rstrip())]
    return joined([tag('h3', 'What these data cannot tell apart'), *parts])


def _absent(diagnosis: Diagnosis) -> Html | None:
    if not diagnosis.absent:
        return None
    rows = [_left_out(*item, diagnosis) for item in sorted(diagnosis.absent.items())]
    return tag(
        'details',
        tag('summary', f'Not considered, and why ({len(rows)})'),
        table(('Effect', 'Why'), rows),
        tag('p.note', _ENOUGH) if any(_STILL in why for _, why in rows) else None,
    )


def _left_out(effect: str, why: str, diagnosis: Diagnosis) -> tuple[str, str]:
    """Return an effect by its name in words, with the joints that the reason ends with."""
    reason, joints = reason_and_joints(why, diagnosis)
    if joints:
        if 'source' in getattr(REGISTRY.get(effect), 'options', ()):
            reason = reason.replace('the joint hardly', 'the joint beside it hardly')
        return words.cause(effect, words.listed(joints)), reason
    return words.cause(effect, None), why


def leftover(diagnosis: Diagnosis) -> Html:
    """Return what remains after the verdict."""
    rest = diagnosis.unexplained
    floor = diagnosis.gap.noise_floor_m
    if not rest.above_noise and rest.rms_m > _ABOVE * floor:
        return tag(
            'p',
            f'What remains, {millimetres(rest.rms_m)}, depends on nothing that was '
            f'looked at, but the instrument is better than that: {millimetres(floor)}.',
        )
    if words.carries_curves(diagnosis) and rest.rms_m <= _ABOVE * floor:
        return joined(
            [
                tag('p', 'What no known effect explains, and the curves carry, depends on:'),
                _dependent(rest.structure),
                tag('p', f'With the curves, {millimetres(rest.rms_m)} remain.'),
            ]
        )
    if not rest.above_noise:
        text = f'What remains, {millimetres(rest.rms_m)}, is at the level of the noise.'
        return tag('p', text)
    text = (
        f'{_with(diagnosis)}{millimetres(rest.rms_m)} remain at a noise floor of {millimetres(floor)}, '
        'which is more than noise. '
    )
    if not rest.structure:
        return tag('p', f'{text}It depends on nothing that was looked at.')
    return joined([tag('p', f'{text}It depends on:'), _dependent(rest.structure)])


def _with(diagnosis: Diagnosis) -> str:
    """Return what was taken off, where it has no name."""
    if diagnosis.effects or diagnosis.families or not diagnosis.model.found:
        return ''
    return 'With the curves, ' if words.carries_curves(diagnosis) else 'With what fits best, '


def _dependent(structure: Sequence[str]) -> Html:
    return sentences(structure or [MISSING])


_STEPS = 12
"""Steps of the waterfall; more are drawn as one."""


@on_page('engineers', 30)
def shrink_section(page: Content) -> Html:
    """Return the waterfall, how it was judged, and what is left."""
    diagnosis = page.diagnosis
    return section(
        'How far it shrinks',
        _waterfall(diagnosis),
        tag('p', _judged(diagnosis)),
        leftover(diagnosis),
        id_='shrink',
        lead='RMS gap as each effect is put into the model in turn, each stretch of the recordings '
        'predicted from the others. At each step the effects that are in are fitted anew, so one can '
        'take up a part of another: a card, which leaves the others as they are, may say otherwise.',
    )


def _waterfall(diagnosis: Diagnosis) -> Html:
    steps = [
        ('as given', _given(diagnosis)),
        *((_readable(name), rms) for name, rms in diagnosis.shrink.steps),
    ]
    if len(steps) > _STEPS + 1:
        skipped = len(steps) - _STEPS
        steps = [*steps[:_STEPS], (f'{skipped} more', steps[-1][1])]
    largest = max(*(rms for _, rms in steps), diagnosis.gap.noise_floor_m, 1e-12)
    rows, before = [], steps[0][1]
    for k, (name, rms) in enumerate(steps):
        fallen = max(before - rms, 0.0) / largest
        rows.append(Bar('+ ' * (k > 0) + name, rms / largest, millimetres(rms), '', fallen))
        before = rms
    floor = diagnosis.gap.noise_floor_m
    rows.append(Bar('measuring noise', floor / largest, millimetres(floor), 'floor', 0.0))
    return bars(rows, 'waterfall wide')


def _apart(diagnosis: Diagnosis) -> bool:
    """Tell whether other recordings judge the shrink; the steps are on those fitted."""
    return diagnosis.shrink.held_out != 'blocked cross-validation'


def _given(diagnosis: Diagnosis) -> float:
    """Return the gap the steps start from, on the recordings that they are judged on."""
    return diagnosis.gap.rms_m if _apart(diagnosis) else diagnosis.shrink.rms_before_m


def _judged(diagnosis: Diagnosis) -> str:
    shrink = diagnosis.shrink
    if not diagnosis.model.found:
        return f'No effect was found, so nothing shrinks; judged on {shrink.held_out}.'
    if shrink.orientation_rad is not None and turns_only(diagnosis):
        before, after = map(both_angles, shrink.orientation_rad)
        return f'The position gap stays; the orientation gap of {before} shrinks to {after}.'
    value, interval = shrink_ratio(shrink)
    remaining = f'{value} of the RMS gap is left ({interval})'
    if not _apart(diagnosis):
        return f'Judged on stretches left out in turn, {remaining}.{shrink_elsewhere(shrink)}'
    return (
        f'On {shrink.held_out}, which was not fitted, {millimetres(shrink.rms_before_m)} shrinks '
        f'to {millimetres(shrink.rms_after_m)}: {remaining}.{shrink_elsewhere(shrink)}'
    )


def _readable(name: str) -> str:
    effect, _, joint = name.partition(' of ')
    return words.cause(effect, joint or None)
