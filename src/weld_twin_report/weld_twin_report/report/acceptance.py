# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Pass, fail, or 'cannot be said': the deviation against a tolerance, by ISO 14253-1."""

from typing import Any

import numpy as np

from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_core.errors import TwinError
from weld_twin_core.metrics.conformity import FAIL, OPEN, PASS, Rule
from weld_twin_core.metrics.performance import Performance, performance_of
from weld_twin_nodes.wording.mending import advised, remaining_with, switch_sets, switches, trusted
from weld_twin_nodes.wording.quantities import millimetres
from weld_twin_nodes.wording.words import capital, listed, unnamed

from .html import Html, joined, section, table, tag
from .page_data import at_rest, instant, worst
from .performance_page import PATH_HEADS, POSE_HEADS, path_row, pose_rows
from .sections import Content, Demand, on_page

WORDS = {PASS: 'passes', FAIL: 'fails', OPEN: 'cannot be said', None: 'no tolerance given'}
_ROWS = 6
"""Poses of ISO 9283 on the page; `weld-twin iso9283` has all."""


_REMEDY = (
    'To be able to say it: a better instrument, a mended robot measured anew, or another tolerance '
    'agreed on.'
)


def rule_of(diagnosis: Diagnosis, demand: Demand) -> Rule:
    """Return the decision rule: with the uncertainty given, or the noise where that is larger."""
    noise = diagnosis.gap.noise_floor_m / np.sqrt(3.0)
    noise = noise if np.isfinite(noise) else 0.0
    readings = sum(int(trusted(diagnosis, k).sum()) for k in range(len(diagnosis.traces.t)))
    return Rule(demand.tolerance_m, max(noise, demand.uncertainty_m or 0.0), max(readings, 1))


def largest(diagnosis: Diagnosis) -> float:
    """Return the largest deviation as it is [m]."""
    return remaining_with(diagnosis, ()).largest


def on_what(diagnosis: Diagnosis) -> str:
    """Return what a verdict on the tolerance holds for: nothing else was looked at."""
    return f'{"at the stations" if at_rest(diagnosis) else "on the seam"} recorded'


def judgement(rule: Rule, size: float) -> str:
    """Return the verdict on a largest deviation [m], and where it is open its limits."""
    verdict = rule.judged(size)
    words = f'{WORDS[verdict]}: {millimetres(size)} of {millimetres(rule.tolerance_m)} allowed'
    if verdict == OPEN and rule.tolerance_m is not None:
        low = rule.tolerance_m - rule.to_pass * rule.uncertainty_m
        high = rule.tolerance_m + rule.to_fail * rule.uncertainty_m
        passes = f'passes up to {millimetres(low)}' if low > 0.0 else 'nothing passes'
        words += f' ({passes}, fails above {millimetres(high)})'
    return capital(words)


def rule_data(rule: Rule) -> dict[str, Any]:
    """Return what the page's script judges by; lengths in mm."""
    return {
        'tolerance': None if rule.tolerance_m is None else 1e3 * rule.tolerance_m,
        'below': 1e3 * rule.to_pass * rule.uncertainty_m,
        'above': 1e3 * rule.to_fail * rule.uncertainty_m,
        'words': {str(key): word for key, word in WORDS.items()},
    }


def most_data(diagnosis: Diagnosis) -> dict[str, float]:
    """Return the largest deviation [mm] by which switches are thrown, a 1 or a 0 for each."""
    if diagnosis.contacts is not None:
        return {}
    every = range(len(switches(diagnosis)))
    return {
        ''.join(str(int(k in mended)) for k in every): round(
            1e3 * remaining_with(diagnosis, mended).largest_after, 9
        )
        for mended in switch_sets(diagnosis)
    }


@on_page('answer', 10)
def acceptance_section(page: Content) -> Html | None:
    """Return the judgement, with a field for a tolerance; None where contacts took its place."""
    diagnosis, demand = page.diagnosis, page.demand
    if diagnosis.contacts is not None or not diagnosis.traces.t:
        return None
    rule = rule_of(diagnosis, demand)
    before = largest(diagnosis)
    heads = ('the robot', 'RMS', 'largest deviation', 'verdict')
    parts = []
    if len(switch_sets(diagnosis)) < 2 ** len(switches(diagnosis)):
        parts.append('Any other combination: tick it under "What if".')
    if switches(diagnosis) and any(unnamed(c) for c in diagnosis.causes if c.members):
        parts.append('Where a cause has no name, mended means: programs corrected by its curve.')
    return section(
        'Does it pass',
        _field(rule),
        table(heads, _rows(diagnosis, rule), 'acceptance'),
        tag('p.note', ' '.join(parts)) if parts else None,
        tag('p#remedy.note', _REMEDY, hidden=None if rule.judged(before) == OPEN else ''),
        tag('p.note', _rule_words(diagnosis, rule, demand)),
        _standard(diagnosis),
        id_='acceptance',
    )


def _field(rule: Rule) -> Html:
    value = None if rule.tolerance_m is None else f'{1e3 * rule.tolerance_m:g}'
    # A field of type number drops a comma without a word in some languages: 0,3 becomes 3.
    entry = tag(
        'input#tolerance', type='text', value=value, size='6', inputmode='decimal',
        autocomplete='off', aria_describedby='unread'
    )  # fmt: skip
    unread = tag(
        'span#unread.mark.fail',
        'Not understood: write millimetres above 0, such as 0.3 or 0,3.',
        role='alert',
        hidden='',
    )
    label = tag('label', 'Tolerance of the tool point: ', entry, ' mm')
    return tag('p.asked', label, ' ', unread)


def _rows(diagnosis: Diagnosis, rule: Rule) -> list[tuple[Html | str, ...]]:
    """Return a row for the robot as it is, and for each of the causes that may be mended."""
    if not switches(diagnosis):
        remaining = remaining_with(diagnosis, ())
        first = _row(f'as it is{_where(diagnosis)}', remaining.rms, remaining.largest, rule)
        if not diagnosis.effects:
            return [first]
        then = (remaining.rms_after, remaining.largest_after)
        return [first, _row('with what was found mended', *then, rule)]
    out, taken = [], set(advised(diagnosis))
    for mended in switch_sets(diagnosis):
        remaining = remaining_with(diagnosis, mended)
        against = '' if set(mended) <= taken else ' (not advised)'
        name = f'{_mended_words(diagnosis, mended)}{against}'
        out.append(_row(name, remaining.rms_after, remaining.largest_after, rule))
    return out


def _mended_words(diagnosis: Diagnosis, mended: tuple[int, ...]) -> str:
    labels = [switch.label for switch in switches(diagnosis)]
    if not mended:
        return f'as it is{_where(diagnosis)}'
    if len(mended) == len(labels) > 1:
        return f'mended: all {len(labels)} causes'
    only = 'only ' if len(labels) > 1 else ''
    return f'mended: {only}{listed([f"{k + 1}. {labels[k]}" for k in mended])}'


def _row(name: str, rms: float, most: float, rule: Rule) -> tuple[Html | str, ...]:
    return name, millimetres(rms), millimetres(most), mark(rule, most)


def mark(rule: Rule, size: float, before: str = '') -> Html:
    """Return the verdict on a largest deviation [m], and what is ``before`` it, if there is one."""
    verdict = rule.judged(size)
    words = f'{before}{WORDS[verdict]}' if verdict is not None or not before else ''
    return tag(
        'span',
        words,
        class_=f'mark {verdict}',
        data_size=f'{1e3 * size:.9f}',
        data_before=before,
    )


def _where(diagnosis: Diagnosis) -> str:
    """Return where along the recordings it is worst."""
    result = worst(diagnosis)
    if result is None:
        return ''
    k, sample, _ = result
    name = f'{diagnosis.recordings[k].name}, ' if len(diagnosis.recordings) > 1 else ''
    return f', worst at {name}{instant(diagnosis, k, sample)}'


def _rule_words(diagnosis: Diagnosis, rule: Rule, demand: Demand) -> str:
    source = 'the noise of these data'
    if demand.uncertainty_m is not None and demand.uncertainty_m >= rule.uncertainty_m:
        source = 'the certificate of the instrument'
    text = (
        f'ISO 14253-1: it passes where the largest deviation stays below the tolerance by '
        f'{millimetres(rule.to_pass * rule.uncertainty_m)}, it fails where it is above by '
        f'{millimetres(rule.to_fail * rule.uncertainty_m)}; in between it cannot be said. '
        f'{_unequal(rule)}The standard uncertainty is '
        f'{millimetres(rule.uncertainty_m)}, from {source}.'
    )
    text += f' It is judged {on_what(diagnosis)}, and nowhere else.'
    if demand.uncertainty_m is None:
        text += (
            ' Noise says nothing of an error that all readings share: that stands in the '
            'certificate of the instrument, which was not given.'
        )
    return text


def _unequal(rule: Rule) -> str:
    """Return why the two margins differ, where they do."""
    if rule.readings < 2:
        return ''
    return (
        f'The second margin is wider: of {rule.readings} readings the largest has much noise in it, '
        'and a good robot must not fail by that. '
    )


def _standard(diagnosis: Diagnosis) -> Html | None:
    """Return the figures of ISO 9283, where the motion was repeated."""
    result = _repeated(diagnosis)
    if result is None:
        text = 'ISO 9283: no pose and no path was repeated, so there are no figures by it.'
        return tag('p.note.detail', text)
    tables = []
    if result.poses:
        tables.append(table(POSE_HEADS, pose_rows(result)[:_ROWS]))
    if result.path is not None:
        tables.append(table(PATH_HEADS, [path_row(result.path)]))
    return joined([tag('h3', 'ISO 9283'), *tables])


def _repeated(diagnosis: Diagnosis) -> Performance | None:
    model = diagnosis.model
    for recording, base in zip(diagnosis.recordings, model.bases, strict=False):
        if recording.measured is None:
            continue
        try:
            return performance_of(recording, model.robot.with_frames(base=base))
        except TwinError:
            continue
    return None
