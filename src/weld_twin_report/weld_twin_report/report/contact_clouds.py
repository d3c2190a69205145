# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The clouds of the predicted tool point about every contact, before and after, magnified."""

from collections.abc import Callable

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.result import ContactResult, Diagnosis, KnownLength
from weld_twin_nodes.wording.quantities import millimetres

from .html import Html, columns, section, table, tag
from .sections import Content, on_page

_MOST = 24
"""Contacts that are drawn; more would make a page of pictures."""
_SIZE = 100.0
"""Half the width of a picture, in its own units."""
_STEPS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
"""What half a picture may stand for [mm]: lengths that are easy to read."""


@on_page('answer', 30)
def contacts_section(page: Content) -> Html | None:
    """Return the clouds and figures of contacts; None where an instrument measured."""
    diagnosis, result = page.diagnosis, page.diagnosis.contacts
    if result is None:
        return None
    rows = [
        (
            item.label,
            str(item.postures),
            *(millimetres(v) for v in (item.before_m, item.after_m, item.held_out_m)),
        )
        for item in result.touched
    ]
    every = (result.spread_before_m, result.spread_after_m, result.held_out_spread_m)
    postures = sum(item.postures for item in result.touched)
    rows.append(('all', str(postures), *(millimetres(v) for v in every)))
    return section(
        'Contacts',
        table(('contact', 'postures', 'before', 'after', 'left out'), rows),
        _lengths(result),
        tag('div.clouds', *_pictures(diagnosis), style=_GRID),
        _not_seen(result),
        id_='contacts',
        lead='How far the predicted tool point is from the middle of what it touched, on average. '
        '"Left out" is predicted from the other places alone. In the pictures each dot is a '
        'posture, seen from above: hollow before, full after, the same scale for all of one size.',
    )


def contacts_sentence(result: ContactResult) -> str:
    """Return how far the tool point is from what it touched, in one sentence."""
    before, after, elsewhere = (
        millimetres(v)
        for v in (result.spread_before_m, result.spread_after_m, result.held_out_spread_m)
    )
    return (
        f'The tool point is {before} from what it touched on average, {after} after the fit, and '
        f'{elsewhere} where it was foretold from the others: that is what to expect near them.'
    )


_GRID = 'display:grid;grid-template-columns:repeat(auto-fill,minmax(11rem,1fr));gap:1rem'


def _lengths(result: ContactResult) -> Html | None:
    shown: dict[str, Callable[[KnownLength], str]] = {
        'distance': lambda item: ' to '.join(item.between),
        'known': lambda item: f'{millimetres(item.value)} ± {millimetres(item.sigma)}',
        'before': lambda item: millimetres(item.before),
        'after': lambda item: millimetres(item.after),
    }
    distances = [item for item in result.lengths if item.kind == 'distance']
    return columns(distances, shown) if distances else None


def _not_seen(result: ContactResult) -> Html | None:
    if not result.not_seen:
        return None
    return tag('p.note', f'No contact shows: {"; ".join(result.not_seen)}.')


def _pictures(diagnosis: Diagnosis) -> list[Html]:
    out: list[Html] = []
    traces = diagnosis.traces
    for recording, before, after in zip(
        diagnosis.recordings, traces.before, traces.after, strict=True
    ):
        contacts = recording.contacts
        if contacts is None:
            continue
        for label in dict.fromkeys(contacts.labels):
            index = contacts.of(label)
            if before.shape[1] == 3 and len(out) < _MOST:
                out.append(_picture(label, before[index], after[index]))
    return out


def _picture(label: str, before: Array, after: Array) -> Html:
    """Return the clouds of one contact, seen from above, about their own middles."""
    clouds = [(cloud - cloud.mean(axis=0))[:, :2] * 1e3 for cloud in (before, after)]
    most = float(max(np.abs(cloud).max(initial=0.0) for cloud in clouds))
    half = next((step for step in _STEPS if step >= most), most)
    dots = [
        dot
        for cloud, filled in zip(clouds, (False, True), strict=True)
        for dot in _dots(cloud * (_SIZE / half), filled)
    ]
    edge = _SIZE * 1.05
    cross = [
        tag('line', x1=a, y1=b, x2=c, y2=d, stroke='currentColor', opacity='.2')
        for a, b, c, d in ((-edge, 0.0, edge, 0.0), (0.0, -edge, 0.0, edge))
    ]
    picture = tag(
        'svg',
        *cross,
        *dots,
        viewBox=f'{-edge} {-edge} {2 * edge} {2 * edge}',
        role='img',
        aria_label=f'predicted tool point about {label}, before and after',
    )
    return tag(
        'figure',
        picture,
        tag('figcaption', f'{label}: from the middle to the edge {half:g} mm'),
    )


def _dots(cloud: Array, filled: bool) -> list[Html]:
    """Return the dots of a cloud, (m, 2) in units of the picture."""
    colour = 'var(--after)' if filled else 'var(--before)'
    return [
        tag(
            'circle',
            cx=f'{x:.1f}',
            cy=f'{-y:.1f}',
            r='3',
            fill=colour if filled else 'none',
            stroke=colour,
        )
        for x, y in cloud
    ]
