# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Circles as a magnified polar plot, like ISO 230-4 has them, with the reversals of the joints."""

from typing import Any

import numpy as np

from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_core.metrics.circle import Circle, circle_of
from weld_twin_core.recording import Recording
from weld_twin_nodes.wording.mending import as_it_is, trusted
from weld_twin_nodes.wording.quantities import millimetres

from .html import Html, section, tag
from .page_data import along, drawn, static
from .sections import Content, on_page

_MOST = 3
"""Circles drawn."""
_STILL = 0.02
"""Part of its largest speed below which a joint counts as standing, so that noise turns nothing."""


def circles(diagnosis: Diagnosis) -> list[tuple[int, Circle]]:
    """Return the recordings that go round a circle, with it."""
    if diagnosis.contacts is not None:
        return []
    out = []
    for k, (measured, before) in enumerate(
        zip(diagnosis.traces.measured, diagnosis.traces.before, strict=True)
    ):
        result = (
            None if static(diagnosis, k) else circle_of((measured - before)[trusted(diagnosis, k)])
        )
        if result is not None:
            out.append((k, result))
    return out[:_MOST]


def circle_data(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Return what the script draws the polar plots from."""
    out = []
    for k, circle in circles(diagnosis):
        index = drawn(diagnosis, k)
        path = (diagnosis.traces.measured[k] - diagnosis.traces.before[k])[index]
        out.append(
            {
                'run': k,
                'angle': [round(float(v), 4) for v in circle.angles(path)],
                'out': [round(float(v), 4) for v in circle.outwards(path).ravel()],
                'radius': round(1e3 * circle.radius, 3),
                'reversals': _marks(diagnosis, k, circle),
                'named': _accused(diagnosis),
            }
        )
    return out


def _accused(diagnosis: Diagnosis) -> list[int]:
    """Return the joints, counted from 0, that a cause sits on; all of them where none does."""
    names = diagnosis.model.robot.joint_names
    places = {cause.place[0][0] for cause in diagnosis.causes if cause.place}
    return [k for k, name in enumerate(names) if name in places] or list(range(len(names)))


def _marks(diagnosis: Diagnosis, k: int, circle: Circle) -> list[tuple[int, float]]:
    """Return the joints that turn back, counted from 0, and at which angle of the circle."""
    t = diagnosis.traces.t[k]
    path = diagnosis.traces.measured[k] - diagnosis.traces.before[k]
    angle = np.unwrap(circle.angles(path))
    return [
        (joint, round(float(np.interp(when, t, angle)), 4))
        for joint, when in reversals(diagnosis.recordings[k])
        if t[0] <= when <= t[-1]
    ]


def reversals(recording: Recording) -> list[tuple[int, float]]:
    """Return which joint, counted from 0, turns back when [s]."""
    motion, out = recording.joints, []
    for i in range(motion.q.shape[1]):
        speed = np.gradient(motion.q[:, i], motion.t)
        moving = np.flatnonzero(np.abs(speed) > _STILL * max(float(np.abs(speed).max()), 1e-9))
        turned = np.flatnonzero(np.diff(np.sign(speed[moving])) != 0)
        out += [(i, float(motion.t[moving[j : j + 2]].mean())) for j in turned]
    return out


@on_page('answer', 40)
def circles_section(page: Content) -> Html | None:
    """Return the polar plots; None where nothing went round a circle."""
    diagnosis, result = page.diagnosis, circles(page.diagnosis)
    if not result:
        return None
    figures = [_figure(diagnosis, k, circle) for k, circle in result]
    return section(
        'The circle',
        tag('div.panels', *figures),
        id_='circles',
        lead='How far outside or inside the commanded circle the tool point is, magnified (as in '
        'ISO 230-4).',
    )


def _figure(diagnosis: Diagnosis, k: int, circle: Circle) -> Html:
    path = diagnosis.traces.measured[k] - diagnosis.traces.before[k]
    good = trusted(diagnosis, k)
    radial = np.asarray((circle.outwards(path) * as_it_is(diagnosis, k)).sum(axis=1))[good]
    name = diagnosis.recordings[k].name
    caption = (
        f'{name}: radius {millimetres(circle.radius)}, '
        f'{along(diagnosis, k)[-1]:.1f} s; as it is from {millimetres(float(radial.min()))} to '
        f'{millimetres(float(radial.max()))}, so {millimetres(float(np.ptp(radial)))} out of round'
    )
    label = f'Polar plot of {name}'
    return tag(
        'figure',
        tag('canvas', data_circle=k, role='img', aria_label=label),
        tag('figcaption', caption),
        _key(bool(diagnosis.model.found)),
    )


def _key(changes: bool) -> Html:
    """Return what the lines and ticks of a polar plot are."""
    rows = [
        ('before', 'as it is'),
        *([('after', 'with what is ticked mended')] if changes else []),
        ('soft', 'middle ring: the commanded circle; outside it the tool is too far out'),
        ('ink', 'tick at the rim: a joint turns back there; the joint of a cause is named, a long '
         'name by its number from the base'),
    ]  # fmt: skip
    items = [tag('li', tag('i', class_=f'swatch {colour}'), ' ', words) for colour, words in rows]
    return tag('ul.key', *items)
