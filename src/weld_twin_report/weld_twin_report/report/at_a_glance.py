# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a fitter asks first, on the first screen: how far off, may we weld, what, how sure, what then."""

from __future__ import annotations

import re

from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_core.metrics.conformity import Rule
from weld_twin_nodes.offline.where_it_holds import elsewhere, left_open, which_file
from weld_twin_nodes.wording.mending import (
    advised,
    correctable,
    curve_fault,
    left_with,
    left_without,
    thought_mended,
)
from weld_twin_nodes.wording.quantities import (
    counted,
    ends_to,
    left_of,
    millimetres,
    odds,
    percent,
    small_turn,
    turns_only,
)
from weld_twin_nodes.wording.switches import alternatives, as_it_is, cause_name, switches
from weld_twin_nodes.wording.words import (
    leading,
    likely,
    listed,
    not_to_be_tried,
    passed,
    unnamed,
    untried_in_short,
)

from .acceptance import largest, mark
from .belief import belief_lines, together
from .cause_values import effects_of, one_of, values
from .controllers import UNCHECKED, UNNAMED, correction
from .directions import components, sides_words, worst
from .html import Child, Html, joined, tag
from .remainder import places
from .seam_view import at_rest, instant, left_out

_CAUSES = 4
"""Causes in the table; the cards have more."""
_RADIANS = re.compile(r' \([^)]*mrad\)')
_SENTENCE = re.compile(r'(?<=\.) (?=[A-Z])')
_VALUES = 2
"""Values of a cause in the table; its card has more."""
_SURE_OF = {
    'identified': 'that every cause named is right, and none is missing',
    'ambiguous': 'that what is named holds the causes, and none is missing',
    'unknown': 'that the cause is none of those tried',
}
_APART = '\N{NO-BREAK SPACE}\N{NO-BREAK SPACE}'
"""Between a size and the verdict on it."""
_WIDER = 2.0
"""Ratio of the error elsewhere in the reach to that where it was measured from which it is a warning."""
_HEADS = (
    *('Cause', 'Share of the gap', 'By how much', 'How sure'),
    *('If only this is mended', 'Where to enter it'),
)
WORDS = (
    ('gap', 'how far the tool is from where the model of the robot has it: measured minus model'),
    ('RMS', 'an average of sizes: the root of the mean of the squares'),
    (
        'measuring noise',
        'what the instrument alone makes: nothing below it can be seen in these data',
    ),
    (
        'not used for fitting',
        'each stretch was predicted from the others, so that nothing is judged on what it was '
        'learned from',
    ),
    (
        'share',
        'the part of the squared gap that a cause makes: squares add up to 100 %, lengths do not',
    ),
    (
        'curve',
        'where the cause has no name: how far the joint is off, as it was measured, over the angle, '
        'the speed or the like; programs can be corrected by it',
    ),
    (
        'mended',
        'thought away: the arm as if this cause were gone and all others still there; of a cause '
        'without a name, programs corrected by its curve',
    ),
    (
        'standard deviation',
        'two of three values lie within one, 95 of 100 within two',
    ),
)
"""Words of the page that not everybody has, each told once."""

Figure = tuple[str, Child, Child]
"""What is asked, the answer, and what stands behind it."""


def figures(diagnosis: Diagnosis, rule: Rule | None) -> Html:
    """Return the figures that answer what is asked first."""
    rows = [_off(diagnosis), _worst(diagnosis), _pass(diagnosis, rule), _left(diagnosis)]
    if diagnosis.status in _SURE_OF:
        told = f'{_SURE_OF[diagnosis.status]}{together(diagnosis)}{_among(diagnosis)}'
        rows.append(('How sure', odds(diagnosis.confidence), told))
    rows.append(_data(diagnosis))
    cells = [
        tag('div', tag('dt', name), tag('dd', value), tag('dd', note, class_='note'))
        for name, value, note in filter(None, rows)
    ]
    return tag('dl', *cells, class_='figures')


def _off(diagnosis: Diagnosis) -> Figure:
    gap = diagnosis.gap
    told = (
        f'the gap: RMS of {counted(gap.samples, "sample")}. Measuring noise alone: '
        f'{millimetres(gap.noise_floor_m)}'
    )
    if gap.orientation_rms_rad is not None:
        told += f'. The tool is turned by {small_turn(gap.orientation_rms_rad)}'
        left = diagnosis.shrink.orientation_rad
        if left is not None and diagnosis.effects:
            told += f', with all mended by {small_turn(left[1])}'
    return 'How far off', millimetres(gap.rms_m), told


def _worst(diagnosis: Diagnosis) -> Figure | None:
    """Return the largest deviation, where and when it is, and to which side."""
    found = worst(diagnosis)
    if found is None or diagnosis.contacts is not None:
        return None
    k, sample, _ = found
    when = instant(diagnosis, k, sample)
    told = f'at {when}' if at_rest(diagnosis) else f'{when} after the start'
    if len(diagnosis.recordings) > 1:
        told = f'{diagnosis.recordings[k].name}, {told}'
    told += _place(diagnosis, k, sample)
    parts = components(diagnosis, k, as_it_is(diagnosis, k))
    if parts is not None and sides_words(parts[sample]):
        told += f': {sides_words(parts[sample])}'
    return 'At the worst spot', millimetres(largest(diagnosis)), told


def _place(diagnosis: Diagnosis, k: int, sample: int) -> str:
    """Return where in space a sample was measured."""
    x, y, z = (f'{1e3 * float(v):.0f}' for v in diagnosis.traces.measured[k][sample])
    return f", at x {x}, y {y}, z {z} mm in the instrument's frame"


def _pass(diagnosis: Diagnosis, rule: Rule | None) -> Figure | None:
    """Return whether it passes as it is, and what would be left with everything mended."""
    if rule is None or diagnosis.contacts is not None or not diagnosis.traces.t:
        return None
    before, taken = largest(diagnosis), advised(diagnosis)
    told: list[Child] = ['as it is, on what was recorded']
    if taken or (diagnosis.effects and not switches(diagnosis)):
        after = left_with(diagnosis, taken).largest_after
        told.append(f'; with {_which(diagnosis, taken)} mended {millimetres(after)} at most')
        told.append(mark(rule, after, _APART))
    link = 'Each combination' if len(switches(diagnosis)) > 1 else 'How it is judged'
    link = 'Write it here' if rule.tolerance_m is None else link
    told.append(joined(['. ', tag('a', link, href='#acceptance')]))
    return 'May we weld with it', mark(rule, before), joined(told)


def _which(diagnosis: Diagnosis, taken: tuple[int, ...]) -> str:
    """Return what is mended in words: all, or the causes that may be by their number."""
    count = len(switches(diagnosis))
    if len(taken) == count:
        return 'this' if count == 1 else 'all'
    return f'only cause{"s" if len(taken) > 1 else ""} {listed([str(k + 1) for k in taken])}'


def _left(diagnosis: Diagnosis) -> Figure:
    every, taken = switches(diagnosis), advised(diagnosis)
    if taken and len(taken) < len(every):
        left = left_with(diagnosis, taken)
        told = f'RMS, {percent(left.rms_after / left.rms)} of the RMS gap, on data not used for fitting'
        name = f'Left with {_which(diagnosis, taken)} mended'
        return name, millimetres(left.rms_after), told
    mended = diagnosis.effects or every or not diagnosis.model.found
    name = 'Left with all mended' if mended else 'Left with what fits best'
    return name, millimetres(diagnosis.shrink.rms_after_m), _how_much(diagnosis)


def _how_much(diagnosis: Diagnosis) -> str:
    shrink = diagnosis.shrink
    if not diagnosis.model.found:
        return 'RMS: nothing was found that could be mended'
    if turns_only(diagnosis):
        return 'RMS on data not used for fitting; what was found turns the tool'
    with_what = '' if diagnosis.effects or switches(diagnosis) else ', and nothing to be entered'
    value, interval = left_of(shrink)
    return f'RMS, {value} of the RMS gap, on data not used for fitting{with_what} ({interval})'


def _among(diagnosis: Diagnosis) -> str:
    """Return among which causes an unknown one is not, where some were not to be tried."""
    if diagnosis.status != 'unknown' or not not_to_be_tried(diagnosis):
        return ''
    return f'; {untried_in_short(diagnosis)}, as asked'


def _data(diagnosis: Diagnosis) -> Figure | None:
    """Return how the checks of the data came out."""
    checks = diagnosis.checks
    if not checks:
        return None
    counts = {level: sum(c.level == level for c in checks) for level in ('warning', 'note')}
    fine = len(checks) - sum(counts.values())
    told = [counted(n, level) for level, n in counts.items() if n]
    if counts['warning']:
        about = [c.name.replace('_', ' ') for c in checks if c.level == 'warning']
        told[0] += f' ({listed(about)})'
    out, every = left_out(diagnosis)
    if out:
        told.append(f'{out} of {counted(every, "sample")} left out')
    told += _instrument(diagnosis)
    word = 'yes, see the notes' if told else 'yes'
    word = 'see the warnings' if counts['warning'] else word
    words = f'{passed(fine, len(checks))}{"; " if told else ""}{"; ".join(told)}. '
    return 'Were the data good', word, joined([words, tag('a', 'Which', href='#checks')])


def _instrument(diagnosis: Diagnosis) -> list[str]:
    """Return which cause sits with what measured, and how much of the gap that makes."""
    return [
        f'but cause {k + 1}, {percent(cause.share, places(diagnosis))} of the gap, sits at '
        f'{likely(cause.place)}'
        for k, cause in enumerate(diagnosis.causes[:_CAUSES])
        if {at for at, _ in leading(cause.place)} & {'instrument', 'clock'}
    ]


def causes_table(diagnosis: Diagnosis, brand: str | None, rule: Rule | None) -> Html | None:
    """Return one row for each cause, as on its card; None without any."""
    causes = diagnosis.causes[:_CAUSES]
    if not causes or rule is None or diagnosis.contacts is not None or diagnosis.families:
        return None
    rows = [_row(diagnosis, k, brand, rule) for k in range(len(causes))]
    if len(switches(diagnosis)) > 1:
        rows.append(_together(diagnosis, rule))
    top = tag('tr', *(tag('th', head, scope='col') for head in _HEADS))
    return tag(
        'div',
        tag('table', tag('thead', top), tag('tbody', *rows), class_='glance'),
        tag('p', _more(diagnosis), class_='note'),
        class_='detail',
    )


def _row(diagnosis: Diagnosis, k: int, brand: str | None, rule: Rule) -> Html:
    cause = diagnosis.causes[k]
    name = cause_name(diagnosis, cause)
    value, ends = ends_to(places(diagnosis), cause.share, *cause.share_ci90)
    sure = belief_lines(diagnosis, cause)
    # Radians stand on the card.
    off = [_RADIANS.sub('', told) for told in values(diagnosis, cause)[:_VALUES]]
    if alternatives(diagnosis, cause) and off:
        off = [f'should it be {one_of(diagnosis, cause)}:', *off]
    cells: list[Child] = [
        joined([tag('b', value), f' ({ends})']),
        _lines(off) or 'open',
        _lines(sure) or 'not judged',
        _alone(diagnosis, k, rule) or 'cannot be told: nothing that was tried stands for it',
        _enter(diagnosis, k, brand),
    ]
    first = tag('a', f'{k + 1}. {name[:1].upper()}{name[1:]}', href=f'#cause-{k + 1}')
    pairs = zip(_HEADS[1:], cells, strict=True)
    return tag(
        'tr',
        tag('th', first, scope='row'),
        *(tag('td', cell, data_head=head) for head, cell in pairs),
    )


def _lines(told: list[str]) -> Html | None:
    return tag('span', *(tag('span', text) for text in told), class_='lines') if told else None


def _alone(diagnosis: Diagnosis, k: int, rule: Rule) -> Html | None:
    left = left_without(diagnosis, k)
    return None if left is None else _left_over(left.rms_after, left.largest_after, rule)


def _left_over(rms: float, most: float, rule: Rule) -> Html:
    told = [f'{millimetres(rms)} RMS, {millimetres(most)} at most', mark(rule, most, _APART)]
    return joined(told)


def _enter(diagnosis: Diagnosis, k: int, brand: str | None) -> str:
    """Return where the controller takes it, without the way through its menus, which the card has."""
    cause = diagnosis.causes[k]
    found = effects_of(diagnosis, cause)
    if curve_fault(diagnosis, k) or not found:
        return 'nothing yet'
    if alternatives(diagnosis, cause):
        return 'nothing before it is known which it is'
    told = UNNAMED if unnamed(cause) else correction(found[0], brand, diagnosis.model.robot)
    return _SENTENCE.split(told.removesuffix(UNCHECKED).rstrip())[0]


def _together(diagnosis: Diagnosis, rule: Rule) -> Html:
    left = left_with(diagnosis, range(len(switches(diagnosis))))
    told = _left_over(left.rms_after, left.largest_after, rule)
    return tag(
        'tr',
        tag('th', 'All mended', scope='row'),
        *(tag('td', '', class_='blank') for _ in range(3)),
        tag('td', told, data_head='If all are mended'),
        tag('td', '', class_='blank')
        if len(advised(diagnosis)) == len(switches(diagnosis))
        else tag('td', 'not advised', data_head=_HEADS[-1]),
    )


def _more(diagnosis: Diagnosis) -> Html:
    more = len(diagnosis.causes) - _CAUSES
    told: list[Child] = [f'{more} more on the cards. '] if more > 0 else []
    count = len(switches(diagnosis))
    if count > 2:
        every = len(thought_mended(diagnosis)) == 2**count
        name, at = ('Does it pass', 'acceptance') if every else ('What if', 'seam')
        told += ['With only two of them mended: see ', tag('a', name, href=f'#{at}'), '. ']
    return joined([*told, 'A click on a cause leads to its card.'])


def holds(diagnosis: Diagnosis) -> Html | None:
    """Return where what is said holds, how wide it is beyond, and what the data left open."""
    posterior = diagnosis.posterior
    if posterior is None:
        return None
    rest = left_open(posterior)
    wide = rest or posterior.anywhere_m > _WIDER * posterior.recorded_m
    file = which_file(diagnosis.model.alone)
    sentences = [elsewhere(posterior, correctable(diagnosis)), *([file] if file else []), *rest]
    return tag('p', ' '.join(sentences), class_='warn' if wide else 'note')


def words_told() -> Html:
    """Return what the words of the page mean, folded."""
    pairs = [part for word, told in WORDS for part in (tag('dt', word), tag('dd', told))]
    return tag(
        'details',
        tag('summary', 'What the words on this page mean'),
        tag('dl', *pairs, class_='pairs'),
        class_='detail',
    )
