# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The top of the page: the verdict in two sentences, the figures behind it, what to do."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timezone

from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_core.metrics.conformity import Rule
from weld_twin_core.recording import Recording
from weld_twin_nodes.wording.verdict import verdict
from weld_twin_nodes.wording.words import mended, status_word

from .at_a_glance import causes_table, figures, holds, words_told
from .html import Html, tag
from .to_do import worth_doing
from .warned import warned

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


def opening(
    diagnosis: Diagnosis,
    judged: Html | None = None,
    rule: Rule | None = None,
    brand: str | None = None,
) -> Html:
    """Return status, verdict, how it is judged, figures, actions and the causes in a table."""
    first, second = verdict(diagnosis)
    sound = diagnosis.status != 'unsound'
    return tag(
        'section',
        tag('p', status_word(diagnosis), class_=f'status {diagnosis.status}'),
        judged,
        tag('h1', first),
        tag('p', second, class_='second'),
        _mended(diagnosis),
        figures(diagnosis, rule) if sound else None,
        holds(diagnosis) if sound else None,
        _actions(diagnosis, rule) if sound else None,
        causes_table(diagnosis, brand, rule) if sound else None,
        words_told() if sound else None,
        id_='verdict',
    )


def _mended(diagnosis: Diagnosis) -> Html | None:
    """Return what was wrong with the data and undone; all that follows stands on it."""
    sentences = mended(diagnosis)
    if not sentences:
        return None
    items = [tag('li', sentence) for sentence in sentences]
    return tag(
        'div', tag('h2', 'Mended before the diagnosis'), tag('ul', *items), class_='actions mended'
    )


def _actions(diagnosis: Diagnosis, rule: Rule | None) -> Html | None:
    told = worth_doing(diagnosis, rule)
    if not told:
        return None
    items = [tag('li', *warned(action)) for action in told]
    title = 'What to do, in this order' if len(items) > 1 else 'What to do'
    return tag('div', tag('h2', title), tag('ol', *items), class_='actions')
