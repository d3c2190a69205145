# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What changed between several recordings of one arm."""

from __future__ import annotations

from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_nodes.wording.quantities import parameter_rows
from weld_twin_nodes.wording.words import CAUSES, cause, listed

from .html import Child, Html, section, table, tag

CHANGED_HEADS = ('recording', 'changed', 'parameter', 'by')


def changed_rows(diagnosis: Diagnosis) -> list[list[str]]:
    """Return recording, error, parameter and value of everything that changed."""
    return [
        [
            diagnosis.recordings[item.recording].name,
            cause(item.effect.name, item.effect.site),
            *row,
        ]
        for item in diagnosis.changed
        for row in parameter_rows(item.effect, item.std, diagnosis.model.robot)
    ]


def nothing_changed(diagnosis: Diagnosis) -> str:
    """Return that nothing was seen to change, of what."""
    names = listed([CAUSES.get(name, name) for name in diagnosis.may_change], 'or')
    return f'No {names} was seen to change between the recordings.'


def changed_section(diagnosis: Diagnosis) -> Html | None:
    """Return what the later recordings have that the first has not; None where it was not asked."""
    if not diagnosis.may_change or len(diagnosis.recordings) < 2:
        return None
    rows: list[list[Child]] = [list(row) for row in changed_rows(diagnosis)]
    heads = tuple(head.capitalize() for head in CHANGED_HEADS)
    content = table(heads, rows, 'changed') if rows else tag('p', nothing_changed(diagnosis))
    return section(
        'What changed between the recordings',
        content,
        id_='changed',
        lead=f'Against {diagnosis.recordings[0].name}; the causes above are what all have in common.',
    )
