# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How far the gap shrinks: the waterfall on unseen data, and the residual over time."""

from __future__ import annotations

from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_nodes.wording.quantities import (
    both_angles,
    left_elsewhere,
    left_of,
    millimetres,
    turns_only,
)
from weld_twin_nodes.wording.words import cause

from .cause_list import leftover
from .html import Html, section, tag

_STEPS = 12
"""Steps of the waterfall; more are drawn as one."""


def shrink_section(diagnosis: Diagnosis) -> Html:
    """Return the waterfall, how it was judged, and what is left."""
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
        rows.append(_step(('+ ' if k else '') + name, rms / largest, before / largest, rms))
        before = rms
    floor = diagnosis.gap.noise_floor_m
    rows.append(_step('measuring noise', floor / largest, floor / largest, floor, 'floor'))
    return tag('ul.bars.waterfall.wide', *rows)


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
    value, interval = left_of(shrink)
    remaining = f'{value} of the RMS gap is left ({interval})'
    if not _apart(diagnosis):
        return f'Judged on stretches left out in turn, {remaining}.{left_elsewhere(shrink)}'
    return (
        f'On {shrink.held_out}, which was not fitted, {millimetres(shrink.rms_before_m)} shrinks '
        f'to {millimetres(shrink.rms_after_m)}: {remaining}.{left_elsewhere(shrink)}'
    )


def _readable(name: str) -> str:
    effect, _, joint = name.partition(' of ')
    return cause(effect, joint or None)


def _step(label: str, share: float, before: float, rms: float, class_: str = '') -> Html:
    fallen = max(before - share, 0.0)
    return tag(
        'li',
        tag('span.label', label),
        tag(
            'span.track',
            tag('i', style=f'width:{100 * share:.2f}%'),
            tag('i.fallen', style=f'width:{100 * fallen:.2f}%'),
        ),
        tag('span.figure', millimetres(rms)),
        class_=class_ or None,
    )
