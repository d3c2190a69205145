# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The sheet of a diagnosis: one HTML file that needs nothing else, and prints on a side or two."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

import yaml

from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_core.errors import ModelError
from weld_twin_core.metrics.conformity import Rule
from weld_twin_msgs_py.files.input_files import InputFile
from weld_twin_nodes.wording.mending import (
    advised,
    as_it_is,
    remaining_with,
    switch_sets,
    switches,
)
from weld_twin_nodes.wording.quantities import (
    STAYS,
    counted,
    millimetres,
    odds,
    percent,
    shrink_ratio,
    small_turn,
    turns_only,
)
from weld_twin_nodes.wording.words import (
    leading,
    likely,
    listed,
    not_to_be_tried,
    passed,
    untried_in_short,
)

from .acceptance import judgement, largest, mark, most_data, on_what, rule_data, rule_of
from .answer import Answer
from .cause_answer import CauseAnswer
from .charts import embedded
from .circle_plot import circle_data
from .controllers import brand_of
from .html import Child, Figure, Html, document, joined, lines, own_file, pairs, tag
from .html import figures as figure_row
from .page_data import at_rest, components, instant, left_out, page_data, sides_words, worst
from .sections import Content, Demand, drawn
from .to_do import warned

_CAUSES = 4
"""Causes in the table; the cards have more."""
_VALUES = 2
"""Values of a cause in the table; its card has more."""
_SURE_OF = {
    'identified': 'that every cause named is right, and none is missing',
    'ambiguous': 'that what is named holds the causes, and none is missing',
    'unknown': 'that the cause is none of those tried',
}
_APART = '\N{NO-BREAK SPACE}\N{NO-BREAK SPACE}'
"""Between a size and the verdict on it."""
_HEADS = (
    *('Cause', 'Share of the gap', 'By how much', 'How sure'),
    *('If only this is mended', 'Where to enter it'),
)
WORDS = {
    'gap': 'how far the tool is from where the model of the robot has it: measured minus model',
    'RMS': 'an average of sizes: the root of the mean of the squares',
    'measuring noise': 'what the instrument alone makes: nothing below it can be seen in these data',
    'not used for fitting': 'each stretch was predicted from the others, so that nothing is judged '
    'on what it was learned from',
    'share': 'the part of the squared gap that a cause makes: squares add up to 100 %, lengths do '
    'not',
    'curve': 'where the cause has no name: how far the joint is off, as it was measured, over the '
    'angle, the speed or the like; programs can be corrected by it',
    'mended': 'thought away: the arm as if this cause were gone and all others still there; of a '
    'cause without a name, programs corrected by its curve',
    'standard deviation': 'two of three values lie within one, 95 of 100 within two',
}
"""Words of the page that not everybody has, each explained once."""


def header(answer: Answer) -> Html:
    kind = tag('p.kind', 'Positional accuracy ', tag('b', 'diagnosis'))
    return tag('header', kind, tag('p.subject', answer.subject))


def opening(answer: Answer, judged: Html | None = None) -> Html:
    """Return status, verdict, how it is judged, figures, actions and the causes in a table."""
    first, second = answer.verdict
    parts = (figures, _holds, _actions, causes_table, _words) if answer.sound else ()
    return tag(
        'section#verdict',
        tag('p', answer.status, class_=f'status {answer.diagnosis.status}'),
        judged,
        tag('h1', first),
        tag('p.second', second),
        _mended(answer),
        *(part(answer) for part in parts),
    )


def _mended(answer: Answer) -> Html | None:
    """Return what was wrong with the data and undone; all that follows stands on it."""
    if not answer.mended:
        return None
    items = tag('ul', *(tag('li', sentence) for sentence in answer.mended))
    return tag('div.actions.mended', tag('h2', 'Mended before the diagnosis'), items)


def _actions(answer: Answer) -> Html | None:
    if not answer.to_do:
        return None
    items = tag('ol', *(tag('li', *warned(action)) for action in answer.to_do))
    title = 'What to do, in this order' if len(answer.to_do) > 1 else 'What to do'
    return tag('div.actions', tag('h2', title), items)


def _holds(answer: Answer) -> Html | None:
    holds = answer.holds
    if holds is None:
        return None
    text = ' '.join(filter(None, [holds.elsewhere, holds.file, *holds.open]))
    return tag('p', text, class_='warn' if holds.wide else 'note')


def _words(_: Answer) -> Html:
    """Return what the words of the page mean, folded."""
    return tag(
        'details.detail', tag('summary', 'What the words on this page mean'), pairs(WORDS.items())
    )


def figures(answer: Answer) -> Html:
    diagnosis = answer.diagnosis
    rows = [_off(diagnosis), _worst(diagnosis), _pass(diagnosis, answer.rule), _left(diagnosis)]
    if diagnosis.status in _SURE_OF:
        words = f'{_SURE_OF[diagnosis.status]}{answer.together}{_among(diagnosis)}'
        rows.append(('How sure', odds(diagnosis.confidence), words))
    return figure_row(filter(None, [*rows, _data(answer)]))


def _off(diagnosis: Diagnosis) -> Figure:
    gap = diagnosis.gap
    words = (
        f'the gap: RMS of {counted(gap.samples, "sample")}. Measuring noise alone: '
        f'{millimetres(gap.noise_floor_m)}'
    )
    if gap.orientation_rms_rad is not None:
        words += f'. The tool is turned by {small_turn(gap.orientation_rms_rad)}'
        remaining = diagnosis.shrink.orientation_rad
        if remaining is not None and diagnosis.effects:
            words += f', with all mended by {small_turn(remaining[1])}'
    return 'How far off', millimetres(gap.rms_m), words


def _worst(diagnosis: Diagnosis) -> Figure | None:
    """Return the largest deviation, where and when it is, and to which side."""
    result = worst(diagnosis)
    if result is None or diagnosis.contacts is not None:
        return None
    k, sample, _ = result
    when = instant(diagnosis, k, sample)
    words = f'at {when}' if at_rest(diagnosis) else f'{when} after the start'
    if len(diagnosis.recordings) > 1:
        words = f'{diagnosis.recordings[k].name}, {words}'
    x, y, z = (f'{1e3 * float(v):.0f}' for v in diagnosis.traces.measured[k][sample])
    words += f", at x {x}, y {y}, z {z} mm in the instrument's frame"
    parts = components(diagnosis, k, as_it_is(diagnosis, k))
    if parts is not None and sides_words(parts[sample]):
        words += f': {sides_words(parts[sample])}'
    return 'At the worst spot', millimetres(largest(diagnosis)), words


def _pass(diagnosis: Diagnosis, rule: Rule | None) -> Figure | None:
    """Return whether it passes as it is, and what would be left with everything mended."""
    if rule is None or diagnosis.contacts is not None or not diagnosis.traces.t:
        return None
    before, taken = largest(diagnosis), advised(diagnosis)
    words: list[Child] = ['as it is, on what was recorded']
    if taken or (diagnosis.effects and not switches(diagnosis)):
        after = remaining_with(diagnosis, taken).largest_after
        words.append(f'; with {_which(diagnosis, taken)} mended {millimetres(after)} at most')
        words.append(mark(rule, after, _APART))
    link = 'Each combination' if len(switches(diagnosis)) > 1 else 'How it is judged'
    link = 'Write it here' if rule.tolerance_m is None else link
    words.append(joined(['. ', tag('a', link, href='#acceptance')]))
    return 'May we weld with it', mark(rule, before), joined(words)


def _which(diagnosis: Diagnosis, taken: tuple[int, ...]) -> str:
    """Return what is mended in words: all, or the causes that may be by their number."""
    count = len(switches(diagnosis))
    if len(taken) == count:
        return 'this' if count == 1 else 'all'
    return f'only cause{"s" if len(taken) > 1 else ""} {listed([str(k + 1) for k in taken])}'


def _left(diagnosis: Diagnosis) -> Figure:
    every, taken = switches(diagnosis), advised(diagnosis)
    if taken and len(taken) < len(every):
        remaining = remaining_with(diagnosis, taken)
        share = percent(remaining.rms_after / remaining.rms)
        words = f'RMS, {share} of the RMS gap, on data not used for fitting'
        name = f'Left with {_which(diagnosis, taken)} mended'
        return name, millimetres(remaining.rms_after), words
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
    value, interval = shrink_ratio(shrink)
    return f'RMS, {value} of {_whole(diagnosis)}, on data not used for fitting{with_what} ({interval})'


def _whole(diagnosis: Diagnosis) -> str:
    """Return what is left a share of: frames fitted to other stretches may leave more than the gap."""
    before = diagnosis.shrink.rms_before_m
    if STAYS * before <= diagnosis.gap.rms_m:
        return 'the RMS gap'
    return f'the {millimetres(before)} there'


def _among(diagnosis: Diagnosis) -> str:
    """Return among which causes an unknown one is not, where some were not to be tried."""
    if diagnosis.status != 'unknown' or not not_to_be_tried(diagnosis):
        return ''
    return f'; {untried_in_short(diagnosis)}, as asked'


def _data(answer: Answer) -> Figure | None:
    diagnosis = answer.diagnosis
    checks = diagnosis.checks
    if not checks:
        return None
    counts = {level: sum(c.level == level for c in checks) for level in ('warning', 'note')}
    fine = len(checks) - sum(counts.values())
    notes = [counted(n, level) for level, n in counts.items() if n]
    if counts['warning']:
        about = [c.name.replace('_', ' ') for c in checks if c.level == 'warning']
        notes[0] += f' ({listed(about)})'
    out, every = left_out(diagnosis)
    if out:
        notes.append(f'{out} of {counted(every, "sample")} left out')
    notes += [
        f'but cause {k}, {answer.percent(item.cause.share)} of the gap, sits at '
        f'{likely(item.cause.place)}'
        for k, item in enumerate(answer.causes[:_CAUSES], 1)
        if {at for at, _ in leading(item.cause.place)} & {'instrument', 'clock'}
    ]
    word = 'yes, see the notes' if notes else 'yes'
    word = 'see the warnings' if counts['warning'] else word
    words = f'{passed(fine, len(checks))}{"; " if notes else ""}{"; ".join(notes)}. '
    return 'Were the data good', word, joined([words, tag('a', 'Which', href='#checks')])


def causes_table(answer: Answer) -> Html | None:
    """Return one row for each cause, as on its card; None without any."""
    diagnosis, rule = answer.diagnosis, answer.rule
    causes = answer.causes[:_CAUSES]
    if not causes or rule is None or diagnosis.contacts is not None or diagnosis.families:
        return None
    rows = [_row(answer, item, rule) for item in causes]
    if len(switches(diagnosis)) > 1:
        rows.append(_together(diagnosis, rule))
    top = tag('tr', *(tag('th', head, scope='col') for head in _HEADS))
    more = len(diagnosis.causes) - _CAUSES
    words: list[Child] = [f'{more} more on the cards. '] if more > 0 else []
    count = len(switches(diagnosis))
    if count > 2:
        every = len(switch_sets(diagnosis)) == 2**count
        name, at = ('Does it pass', 'acceptance') if every else ('What if', 'seam')
        words += ['With only two of them mended: see ', tag('a', name, href=f'#{at}'), '. ']
    return tag(
        'div.detail',
        tag('table.glance', tag('thead', top), tag('tbody', *rows)),
        tag('p.note', joined([*words, 'A click on a cause leads to its card.'])),
    )


def _row(answer: Answer, item: CauseAnswer, rule: Rule) -> Html:
    value, ends = answer.share_of(item)
    remaining = item.remaining
    cells: list[Child] = [
        joined([tag('b', value), f' ({ends})']),
        lines(item.off_in_short(_VALUES)) or 'open',
        lines(item.sure) or 'not judged',
        'cannot be said: nothing that was tried stands for it'
        if remaining is None
        else _left_over(remaining.rms_after, remaining.largest_after, rule),
        item.where_to_enter,
    ]
    first = tag('a', f'{item.k + 1}. {item.name}', href=f'#cause-{item.k + 1}')
    with_heads = zip(_HEADS[1:], cells, strict=True)
    return tag(
        'tr',
        tag('th', first, scope='row'),
        *(tag('td', cell, data_head=head) for head, cell in with_heads),
    )


def _left_over(rms: float, most: float, rule: Rule) -> Html:
    parts = [f'{millimetres(rms)} RMS, {millimetres(most)} at most', mark(rule, most, _APART)]
    return joined(parts)


def _together(diagnosis: Diagnosis, rule: Rule) -> Html:
    remaining = remaining_with(diagnosis, range(len(switches(diagnosis))))
    cell = _left_over(remaining.rms_after, remaining.largest_after, rule)
    return tag(
        'tr',
        tag('th', 'All mended', scope='row'),
        *(tag('td.blank', '') for _ in range(3)),
        tag('td', cell, data_head='If all are mended'),
        tag('td.blank', '')
        if len(advised(diagnosis)) == len(switches(diagnosis))
        else tag('td', 'not advised', data_head=_HEADS[-1]),
    )


_FOLDED = 'For engineers: what else it could be, and how far each effect shrinks it'
SCRIPTS = ('sheet.js', 'seam.js', 'polar.js')


@dataclass(frozen=True)
class Sheet:
    """What a reader wants of the sheet."""

    demand: Demand = field(default_factory=Demand)  # tolerance, and uncertainty of the instrument
    joints: Mapping[str, str] = field(default_factory=dict)
    """What joints are called on the controller; those not in it keep their name."""
    brand: str | None = None
    """Whose controller it is, as `controllers.BRANDS` has it; None and the robot's name tells."""


def report_page(
    diagnosis: Diagnosis, inputs: Sequence[InputFile] = (), sheet: Sheet | None = None
) -> str:
    sheet = sheet or Sheet()
    rule = rule_of(diagnosis, sheet.demand)
    brand = sheet.brand or brand_of(diagnosis.model.robot.name)
    answer = Answer(diagnosis, rule, brand)
    judged = _judged(diagnosis, rule) if answer.sound else None
    page = Content(answer, sheet.demand, inputs, judged)
    body = joined(
        [
            header(answer),
            opening(answer, judged),
            *(drawn('answer', page) if answer.sound else ()),
            *drawn('checks', page),
            tag('details.detail', tag('summary', _FOLDED), *drawn('engineers', page))
            if answer.sound
            else None,
            *drawn('print', page),
        ]
    )
    title = f'{answer.status} · {diagnosis.model.robot.name} · diagnosis'
    foot = tag('div.detail', *drawn('foot', page))
    main = tag('main', Html(renamed(body, sheet.joints)), foot)
    if not answer.sound:
        return document(title, main)
    data = {
        **page_data(diagnosis),
        'most': most_data(diagnosis),
        'rule': rule_data(rule),
        'circles': circle_data(diagnosis),
    }
    data_tag = Html(renamed(embedded(data, 'data'), sheet.joints))
    scripts = [tag('script', own_file(name)) for name in SCRIPTS]
    return document(title, main, data_tag, charts=True, scripts=scripts)


def _judged(diagnosis: Diagnosis, rule: Rule) -> Html | None:
    """Return the verdict on the tolerance; it stays hidden until one is given, here or there."""
    if diagnosis.contacts is not None or not diagnosis.traces.t:
        return None
    size = largest(diagnosis)
    verdict = rule.judged(size)
    where = f'as it is, {on_what(diagnosis)}'
    out, _ = left_out(diagnosis)
    if out:
        verb = 'is' if out == 1 else 'are'
        where += f'; {counted(out, "sample")} {verb} left out of it'
    return tag(
        'p',
        f'{judgement(rule, size)}, {where}',
        class_=f'status judged {verdict}',
        hidden='' if rule.tolerance_m is None else None,
        data_top=f'{1e3 * size:.9f}',
        data_where=where,
    )


_PREFIX = re.compile(r'[A-Za-z]{1,3}')


def joint_labels(given: str, joints: Sequence[str]) -> dict[str, str]:
    """
    Return what each joint is called on the page; empty for the names of the model.

    given: a prefix such as ``A`` or ``J``, which the number of the joint follows, or a YAML
    file that gives a name to joints: ``shoulder_pan_joint: A1``.
    """
    if not given:
        return {}
    if _PREFIX.fullmatch(given):
        return {name: f'{given}{k}' for k, name in enumerate(joints, 1)}
    path = Path(given)
    if not path.is_file():
        raise ModelError(
            f'--joint-names {given}: give a prefix of one to three letters such as A, or a YAML '
            'file with a line "joint: name" for each joint'
        )
    content = yaml.safe_load(path.read_text(encoding='utf-8'))
    if not isinstance(content, dict):
        raise ModelError(f'{given}: expected lines "joint: name", one for each joint')
    for name in content:
        if name not in joints:
            raise ModelError(
                f'{given}: the robot has no joint {name!r}; it has {", ".join(joints)}'
            )
    return {str(name): str(label) for name, label in content.items()}


def renamed(markup: str, labels: Mapping[str, str]) -> str:
    """Return markup in which joints have their labels; other words are left alone."""
    if not labels:
        return markup
    by_name = {escape(name): escape(label) for name, label in labels.items()}
    longest = sorted(by_name, key=len, reverse=True)
    pattern = re.compile(rf'(?<![\w/.-])({"|".join(map(re.escape, longest))})(?![\w/-])')
    return pattern.sub(lambda match: by_name[match[1]], markup)
