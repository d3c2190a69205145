# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the answer stands on and where to go from it: on the page, and on the print to be signed."""

from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any

from weld_twin_core import __version__
from weld_twin_core.diagnosis.result import Diagnosis, Site
from weld_twin_msgs_py.files.input_files import InputFile
from weld_twin_nodes.wording.quantities import counted, odds
from weld_twin_nodes.wording.words import (
    CURVES,
    cause,
    depending,
    in_words,
    listed,
    open_sets,
    passed,
    place_name,
)

from .answer import Answer
from .html import Child, Html, joined, pairs, section, table, tag
from .sections import Content, on_page
from .to_do import made_for, minutes, untried

_APART = (
    *('kind', 'motion', 'between', 'cost', 'robot_minutes', 'expected_separation_sigma'),
    *('changes', 'promise', 'skipped'),
)
"""What programs need of a measurement, or the page says in words."""
_ENOUGH = (
    'No further measurement is needed for this verdict.',
    'Between what was tried, no further measurement is needed.',
)
"""What is said where none is proposed: all effects were tried, or some could not be."""
_SURER = 'The verdict stands without it; who wants to be surer measures this.'
_ORDER = {'unsound': 0, 'warning': 1, 'note': 2, 'ok': 3}
"""What needs attention comes first."""


@on_page('answer', 60)
def next_section(page: Content) -> Html:
    """Return the measurement that would decide, or that none is needed."""
    answer, diagnosis = page.answer, page.diagnosis
    wanted = diagnosis.next_experiment
    if wanted is not None:
        sure = diagnosis.status == 'identified'
        content = joined([
            tag('p', _SURER) if sure else None,
            _wanted(wanted, _sites(diagnosis)),
            *_left_open(answer, wanted),
        ])  # fmt: skip
    elif diagnosis.status == 'unknown' or answer.open:
        content = tag('p', 'No measurement that would decide has been found.')
    else:
        text = f'{_ENOUGH[bool(untried(diagnosis))]} {untried(diagnosis)}'.rstrip()
        content = tag('p', text)
    return section('What to measure next', content, id_='next')


def measured_next(diagnosis: Diagnosis) -> str | None:
    """Return the measurement that would decide in a sentence; None where none is proposed."""
    wanted = diagnosis.next_experiment
    if wanted is None or not wanted.get('sentence'):
        return None
    return in_words(wanted['sentence'], _sites(diagnosis))


def _sites(diagnosis: Diagnosis) -> set[Site]:
    named = {site for group in diagnosis.indistinguishable for site in group}
    return named | {candidate.site for candidate in diagnosis.candidates}


def _wanted(wanted: dict[str, Any], sites: set[Site]) -> Html:
    """Return what to measure, why, and what it takes."""
    known = {'sentence', 'reason', *_APART}
    rest = {key: value for key, value in wanted.items() if key not in known}
    if wanted.get('motion'):
        rest['as a program'] = (
            'weld-twin export program next_experiment.yaml writes it in the language of the '
            'controller, with a sheet on how to load it'
        )
    if minutes(wanted):
        rest['takes'] = minutes(wanted)
    if wanted.get('promise'):
        rest['chance that it decides'] = odds(wanted['promise'])
    elif wanted.get('expected_separation_sigma'):
        sigma = f'{wanted["expected_separation_sigma"]:.0f}'
        rest['tells them apart by'] = f'{sigma} standard deviations, as far as can be foreseen'
    parts = [tag('p', in_words(wanted['sentence'], sites))] if wanted.get('sentence') else []
    why = parts_what(wanted) or (in_words(wanted['reason'], sites) if wanted.get('reason') else '')
    parts += [tag('p.note', why)] if why else []
    entries = [
        (key.replace('_', ' ').capitalize(), _plain(value))
        for key, value in rest.items()
        # Lists of numbers belong into a file and not onto a page.
        if value not in (None, '') and not (isinstance(value, list) and len(value) > 12)
    ]
    return joined([*parts, pairs(entries) if entries else None])


def parts_what(wanted: Mapping[str, Any]) -> str:
    """
    Return what a measurement is to tell apart, in a sentence; nothing where it parts nothing.

    What an explanation without a name depends on is told only where the two differ in that alone.
    """
    one, other = wanted.get('between') or ((), ())
    if not one or not other:
        return ''
    same = {item.get('at') for item in one} == {item.get('at') for item in other}
    sides = [listed(list(dict.fromkeys(_side(item, same) for item in side)))
             for side in (one, other)]  # fmt: skip
    if sides[0] == sides[1]:
        return ''
    if not same and all(item['effect'] in CURVES for item in (*one, *other)):
        # Both may be there side by side.
        return f'It tells {sides[0]} from {sides[1]}.'
    return f'It shows whether it is {sides[0]} or {sides[1]}.'


def _side(item: Mapping[str, Any], same: bool) -> str:
    """Return one part of an explanation in words, with what it depends on at the same place."""
    if item['effect'] not in CURVES:
        return cause(item['effect'], item.get('joint'))
    at = f'something at {place_name(str(item.get("at")))}'
    return f'{at} that {depending(str(item.get("on")))}' if same else at


def _left_open(answer: Answer, wanted: dict[str, Any]) -> list[Html]:
    """Return which open questions a measurement is not made for: motion may never part them."""
    words = 'It is not made to tell whether it is {}: see what to do first.'
    sets = zip(open_sets(answer.diagnosis), answer.open, strict=True)
    return [
        tag('p.note', words.format(names)) for group, names in sets if not made_for(wanted, group)
    ]


def _plain(value: Any) -> str:
    if isinstance(value, float):
        return f'{value:.4g}'
    if isinstance(value, list | tuple):
        return ', '.join(_plain(item) for item in value)
    if isinstance(value, dict):
        return '; '.join(f'{key.replace("_", " ")}: {_plain(v)}' for key, v in value.items())
    return str(value)


@on_page('checks', 10)
def checks_section(page: Content) -> Html:
    """Return the checks of the data, those that need attention first."""
    diagnosis = page.diagnosis
    ordered = sorted(diagnosis.checks, key=lambda check: _ORDER[check.level])
    items = [
        tag(
            'li',
            tag('span', check.level, class_=f'level {check.level}'),
            tag('span', tag('b', check.name.replace('_', ' ')), ' ', check.sentence),
        )
        for check in ordered
    ]
    notes = [
        tag('li', tag('span.level.note', 'note'), tag('span', tag('b', recording.name), ' ', note))
        for recording in diagnosis.recordings
        for note in recording.notes
    ]
    result = tag('ul.checks', *items, *_left_out(diagnosis), *notes)
    return section(
        'Are the data sound',
        result if items or notes else tag('p', 'Nothing stood out.'),
        id_='checks',
        lead='Looked at before any cause was.',
    )


def _left_out(diagnosis: Diagnosis) -> list[Html]:
    """Return how many samples the figures leave out though the instrument is not at fault."""
    out = []
    for recording, good in zip(diagnosis.recordings, diagnosis.traces.trusted, strict=False):
        count = int((~good).sum())
        if count:
            verb = 'lies' if count == 1 else 'lie'
            text = (
                f'{count} of {counted(good.size, "sample")} of {recording.name} {verb} far from '
                'what the fitted model says. They count little in the fit, and figures and '
                'pictures are without them. They need not be slips of the instrument: a motion '
                'that no effect describes looks like this too.'
            )
            out.append(tag('li', tag('span.level.note', 'left out'), tag('span', text)))
    return out


@on_page('foot', 10)
def made_from_section(page: Content) -> Html:
    """Return inputs and version; in the foot of the sheet."""
    return inputs_section(page.inputs)


def inputs_section(inputs: Sequence[InputFile]) -> Html:
    """Return inputs and version, so that the answer can be had again."""
    rows: list[list[Child]] = [
        [item.use, tag('code', item.path), tag('code.hash', item.sha256)] for item in inputs
    ]
    return section(
        'Made from',
        table(('Use', 'Path', 'SHA-256'), rows, 'inputs')
        if rows
        else tag('p', 'No files: the recordings were handed over by a program, not read.'),
        tag('p.note', f'weld_twin {__version__}'),
        id_='inputs',
    )


_SHORT = 12
"""Digits of a hash that tell files apart on paper; the page has all."""
_FILES = 4
"""Files listed on paper; the page has all."""
_FINDINGS = 3
"""Checks listed on paper, the gravest; the page has all."""


@on_page('print', 10)
def printed_section(page: Content) -> Html:
    """Return what only a print shows, with the lines to sign on: a side may part from the other."""
    answer, diagnosis = page.answer, page.diagnosis
    rows: list[tuple[str, Child]] = [
        ('Data', _stood_out(diagnosis)),
        ('Cannot be told apart', '; '.join(answer.open)),
        ('Measure next', measured_next(diagnosis)),
        ('Made from', _files(page.inputs)),
    ]
    lines = [tag('span', text) for text in ('Checked by', 'Date', 'Signature')]
    status = tag('span', answer.status, class_=f'status {diagnosis.status}')
    return tag(
        'section.printed',
        pairs(rows),
        tag('div', status, page.judged),
        tag('p.signatures', *lines),
    )


def _stood_out(diagnosis: Diagnosis) -> str:
    """Return what stood out of the data; warnings before notes."""
    open_ones = [c for level in ('unsound', 'warning', 'note') for c in diagnosis.checks
                 if c.level == level]  # fmt: skip
    fine = len(diagnosis.checks) - len(open_ones)
    words = [f'{check.level}: {check.sentence}' for check in open_ones[:_FINDINGS]]
    if len(open_ones) > _FINDINGS:
        words.append(f'{len(open_ones) - _FINDINGS} more are on the page.')
    return ' '.join([f'{passed(fine, len(diagnosis.checks)).capitalize()}.', *words])


def _files(inputs: Sequence[InputFile]) -> Html:
    """Return files, the start of their hashes, the version, and when it was printed."""
    words = [f'{PurePath(item.path).name} (SHA-256 {item.sha256[:_SHORT]}…)' for item in inputs]
    more = [f'{len(words) - _FILES} more'] if len(words) > _FILES else []
    named = '; '.join([*words[:_FILES], *more, f'weld_twin {__version__}'])
    return tag('span', named, tag('span#printed-at'))
