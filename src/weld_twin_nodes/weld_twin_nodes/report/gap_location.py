# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the gap lies: the joint x regressor map, joints, regimes, directions, stretches."""

from __future__ import annotations

from weld_twin_core.diagnosis.result import Diagnosis

from .html import Html, bars, section, tag
from .quantities import millimetres, percent, seconds
from .seam_view import at_rest
from .words import REGIMES

_VISIBLE = 0.005
"""Share below which a cell of the map stays empty: it would read 0."""


def where_section(diagnosis: Diagnosis) -> Html:
    """Return the map first, then what it sums up to."""
    where = diagnosis.where
    parts = [
        _part('By joint', _joints(diagnosis)),
        _part(
            'By regime',
            bars(
                [
                    (REGIMES.get(name, name), share, percent(share))
                    for name, share in sorted(where.regimes.items(), key=lambda item: -item[1])
                ]
            ),
        ),
        _part('By direction', _directions(diagnosis)),
    ]
    return section(
        'Where it lies',
        _map(diagnosis),
        tag('div', *parts, class_='columns'),
        _stretches(diagnosis),
        id_='where',
        lead='How much of the squared gap each joint explains by itself, as a function of what; '
        'on stretches of the data not used for fitting. Rows and columns overlap, so they need '
        'not add up.',
    )


def _part(title: str, content: Html) -> Html:
    return tag('div', tag('h3', title), content)


def _map(diagnosis: Diagnosis) -> Html | None:
    where = diagnosis.where
    if not where.map_shares:
        return None
    heads = [tag('th', tag('span', name), scope='col') for name in where.map_regressors]
    rows = []
    for name, shares in zip(diagnosis.model.robot.joint_names, where.map_shares, strict=True):
        cells = [_cell(share) for share in shares]
        rows.append(tag('tr', tag('th', name, scope='row'), *cells))
    head = tag('thead', tag('tr', tag('th', 'Joint', scope='col'), *heads))
    return tag(
        'div',
        tag('table', head, tag('tbody', *rows), class_='map'),
        class_='scroll',
        tabindex='0',
        role='region',
        aria_label='Share by joint and regressor',
    )


def _cell(share: float) -> Html:
    strength = min(max(share, 0.0), 1.0)
    class_ = 'strong' if strength > 0.55 else None
    text = f'{100.0 * share:.0f}' if share >= _VISIBLE else ''
    return tag('td', text, style=f'--share:{strength:.3f}', class_=class_)


def _joints(diagnosis: Diagnosis) -> Html:
    joints = diagnosis.where.joints
    if diagnosis.effects and not any(share > 0.0 for _, share in joints):
        return tag('p', 'What was found sits on no joint.', class_='note')
    return bars([(name, share, percent(share)) for name, share in joints])


def _directions(diagnosis: Diagnosis) -> Html:
    direction = dict(diagnosis.where.direction)
    names = {'along_m': 'along the seam', 'across_m': 'across it', 'normal_m': 'along the tool'}
    if at_rest(diagnosis):
        direction = {key: value for key, value in direction.items() if key != 'along_m'}
        names['across_m'] = 'across the tool'
    largest = max([*direction.values(), 1e-12])
    return bars(
        [
            (names.get(key, key), value / largest, millimetres(value))
            for key, value in direction.items()
        ]
    )


def _stretches(diagnosis: Diagnosis) -> Html | None:
    path = diagnosis.where.path
    if len(path) < 2:
        return None
    largest = max(*(rms for *_, rms in path), 1e-12)
    cells = [
        tag(
            'li',
            tag('span', f'{1e3 * rms:.2f}', class_='figure'),
            style=f'--share:{rms / largest:.3f};flex-grow:{max(end - start, 1e-3):.3f}',
            class_='strong' if rms > 0.55 * largest else None,
            title=f'{seconds(start)} to {seconds(end)}: {millimetres(rms)}, '
            f'{percent(share)} of the squared gap',
        )
        for start, end, share, rms in path
    ]
    return _part(
        'Along the recording',
        tag(
            'div',
            tag('ol', *cells, class_='strip'),
            tag('p', 'RMS gap in mm of each stretch, in the order of time.', class_='note'),
        ),
    )
