# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures beyond the paper's: how the arm stands, and what was recorded beside the tolerances."""

from __future__ import annotations

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.sensitivity import arc_weights, expected_deviation, posture

from ..setting import RECORDED, Setting, recorded_deviations
from .canvas import COLOURS, Drawing, label, legend, panels, svg


def standing(setting: Setting) -> Drawing:
    """Draw condition number, manipulability and gain along the seam."""
    study = next(iter(setting.studies.values()))
    stand = posture(study)
    expected = expected_deviation(study, setting.tolerances)
    columns: tuple[tuple[str, str, Array], ...] = (
        ('Condition number, translation', '', stand.condition),
        ('Manipulability', 'm^3', stand.manipulability),
        ('Expected deviation', 'mm', 1e3 * expected),
    )
    figure, axes = panels(3, height=2.7)
    for colour, axis, (title, unit, value) in zip(COLOURS, axes, columns, strict=False):
        axis.plot(1e3 * study.s, value, color=colour)
        axis.set_ylim(0.0, 1.15 * float(value.max()))
        label(axis, title, 'arc length [mm]', unit)
    table = {
        's_m': study.s,
        'condition': stand.condition,
        'manipulability': stand.manipulability,
        'gain_m_per_rad': stand.amplification,
        'expected_m': expected,
    }
    caption = 'How the arm stands along the seam, and the deviation its tolerances lead to expect.'
    return Drawing('figure-posture', caption, table, svg(figure))


def recorded(setting: Setting) -> Drawing | None:
    """Draw the deviations that were measured beside those to be expected; None without any."""
    study = setting.studies[RECORDED]
    off = recorded_deviations(study)
    if off is None:
        return None
    expected = expected_deviation(study, setting.tolerances)
    size = np.linalg.norm(off, axis=1)
    t = study.t - study.t[0]
    figure, (left, right) = panels(2)
    left.fill_between(t, 0.0, 2e3 * expected, color='#e3e6ea', label='twice the expected')
    left.plot(t, 1e3 * expected, color='#666666', lw=1.0, label='expected (rms)')
    left.plot(t, 1e3 * size, color=COLOURS[1], label='recorded')
    left.set_ylim(0.0, None)
    label(left, 'Size of the deviation', 'time [s]', 'D [mm]')
    legend(left)
    names = ('along', 'across', 'normal')
    for colour, name, value in zip(COLOURS, names, off.T, strict=False):
        right.plot(t, 1e3 * value, color=colour, label=name)
    label(right, 'Recorded, by direction', 'time [s]', 'mm')
    legend(right)
    mean = np.sqrt((size**2 * arc_weights(study.s)).sum())
    table = {
        't_s': study.t,
        's_m': study.s,
        'along_m': off[:, 0],
        'across_m': off[:, 1],
        'normal_m': off[:, 2],
        'recorded_m': size,
        'expected_m': expected,
    }
    caption = (
        f'Recorded deviation, {1e3 * mean:.3f} mm rms over the path, beside what the tolerances '
        'lead to expect.'
    )
    return Drawing('figure-recorded', caption, table, svg(figure))
