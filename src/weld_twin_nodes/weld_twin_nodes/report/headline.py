# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The top of the page: the verdict in two sentences, the figures behind it, what to do."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timezone

from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_core.metrics.conformity import Rule
from weld_twin_core.recording import Recording

from ..offline.where_it_holds import where_it_holds
from .belief import together
from .html import Html, tag
from .quantities import counted, left_of, millimetres, odds, small_turn, turns_only
from .to_do import worth_doing
from .words import STATUS, listed, mended, not_to_be_tried, verdict

_SURE_OF = {
    'identified': 'that every cause named is right, and none is missing',
    'ambiguous': 'that what is named holds the causes, and none is missing',
    'unknown': 'that the cause is none of those known',
}
_FIRST_REAL_STAMP = 10**18
"""Stamps [ns] before 2001 count from something else than the epoch."""


def header(diagnosis: Diagnosis) -> Html:
    """Return what was diagnosed."""
    robot = diagnosis.model.robot
    names = ', '.join(recording.name for recording in diagnosis.recordings)
    parts = [robot.name, names, recorded_at(diagnosis.recordings)]
    return tag(
        'header',
        tag('p', 'Positional accuracy ', tag('b', 'diagnosis'), class_='kind'),
        tag('p', ' · '.join(part for part in parts if part), class_='subject'),
    )


def recorded_at(recordings: Sequence[Recording]) -> str:
    """Return when the first of the recordings was made; nothing where the stamps do not tell."""
    stamps = [r.epoch_ns for r in recordings if r.epoch_ns > _FIRST_REAL_STAMP]
    if not stamps:
        return ''
    when = datetime.fromtimestamp(min(stamps) * 1e-9, tz=timezone.utc)
    return f'recorded {when:%Y-%m-%d %H:%M} UTC'


def opening(diagnosis: Diagnosis, judged: Html | None = None, rule: Rule | None = None) -> Html:
    """Return status, verdict, how it is judged, figures and actions."""
    first, second = verdict(diagnosis)
    sound = diagnosis.status != 'unsound'
    return tag(
        'section',
        tag('p', STATUS[diagnosis.status], class_=f'status {diagnosis.status}'),
        judged,
        tag('h1', first),
        tag('p', second, class_='second'),
        _mended(diagnosis),
        _figures(diagnosis) if sound else None,
        _holds(diagnosis, judged) if sound else None,
        _actions(diagnosis, rule) if sound else None,
        id_='verdict',
    )


def _holds(diagnosis: Diagnosis, judged: Html | None) -> Html | None:
    """Return how far the corrected robot can be relied on, and what the data left open."""
    if diagnosis.posterior is None:
        return None
    first, *rest = where_it_holds(diagnosis.posterior)[:-1]
    kind = 'note left-open' if rest else 'note'
    apart = (
        'A verdict on the tolerance is about what was recorded, not about the reach.'
        if judged is not None
        else ''
    )
    return tag('p', ' '.join(filter(None, [first, apart, *rest])), class_=kind)


def _mended(diagnosis: Diagnosis) -> Html | None:
    """Return what was wrong with the data and undone; all that follows stands on it."""
    sentences = mended(diagnosis)
    if not sentences:
        return None
    items = [tag('li', sentence) for sentence in sentences]
    return tag(
        'div', tag('h2', 'Mended before the diagnosis'), tag('ul', *items), class_='actions mended'
    )


def _figures(diagnosis: Diagnosis) -> Html:
    gap, shrink = diagnosis.gap, diagnosis.shrink
    rows = [
        (
            'Gap',
            millimetres(gap.rms_m),
            f'RMS of {counted(gap.samples, "sample")}; {millimetres(gap.max_m)} at most',
        ),
        ('Left over', millimetres(shrink.rms_after_m), _left(diagnosis)),
        ('Noise floor', millimetres(gap.noise_floor_m), 'what the data cannot resolve'),
    ]
    if diagnosis.status in _SURE_OF:
        rows.append(
            (
                'Confidence',
                odds(diagnosis.confidence),
                f'{_SURE_OF[diagnosis.status]}{together(diagnosis)}{_among(diagnosis)}',
            )
        )
    if gap.orientation_rms_rad is not None:
        rows.append(('Orientation', small_turn(gap.orientation_rms_rad), _turned(diagnosis)))
    cells = [
        tag('div', tag('dt', name), tag('dd', value), tag('dd', note, class_='note'))
        for name, value, note in rows
    ]
    return tag('dl', *cells, class_='figures')


def _among(diagnosis: Diagnosis) -> str:
    """Return among which causes an unknown one is not, where some were not to be tried."""
    names = not_to_be_tried(diagnosis)
    if diagnosis.status != 'unknown' or not names:
        return ''
    verb = 'was' if len(names) == 1 else 'were'
    return (
        f', among causes that were not excluded: {listed(names)} {verb} left out as asked; run '
        f'again with {"it" if len(names) == 1 else "them"}'
    )


def _left(diagnosis: Diagnosis) -> str:
    shrink = diagnosis.shrink
    if not diagnosis.model.found:
        return 'on unseen data; no effect is in the twin'
    if turns_only(diagnosis):
        return 'on unseen data; what was found turns the tool'
    with_what = '' if diagnosis.effects else ', with what fits best'
    value, interval = left_of(shrink)
    return f'{value} of the RMS gap, on unseen data{with_what} ({interval})'


def _turned(diagnosis: Diagnosis) -> str:
    left = diagnosis.shrink.orientation_rad
    if left is None or not diagnosis.effects:
        return 'RMS gap'
    return f'RMS gap; {small_turn(left[1])} left over'


def _actions(diagnosis: Diagnosis, rule: Rule | None) -> Html | None:
    told = worth_doing(diagnosis, rule)
    if not told:
        return None
    items = [tag('li', action) for action in told]
    title = 'What to do, in this order' if len(items) > 1 else 'What to do'
    return tag('div', tag('h2', title), tag('ol', *items), class_='actions')
