# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures 10 to 14: deviation over the size of one error, and all errors together."""

from typing import Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.sensitivity import (
    Study,
    default_tolerances,
    default_values,
    sweep,
)
from weld_twin_core.sensitivity.claims.measures import growth_exponent
from weld_twin_core.sensitivity.evaluate import exact_deviations
from weld_twin_core.sensitivity.local import arc_weights
from weld_twin_core.sensitivity.sweep import (
    DEGREE,
    cumulative,
    scenario_deviations,
    spread_of_passes,
    together,
)

from ..setting import Setting
from .canvas import COLOURS, Drawing, from_zero, label, legend, panels, plain_powers, svg

_GRID = 400
"""Even steps of the path that deviations are summed over."""


def _scenarios(setting: Setting) -> tuple[Study, dict[str, Array]]:
    """Return the study, and D of every source, of all together and summed, shape (N,)."""
    study = next(iter(setting.studies.values()))
    result = {k: np.linalg.norm(v, axis=1) for k, v in scenario_deviations(study).items()}
    result['sum of the single ones'] = sum(
        (v for k, v in result.items() if k != 'combined'), np.zeros(study.samples)
    )
    return study, result


def _style(name: str) -> dict[str, Any]:
    if name == 'combined':
        return {'color': '#000000', 'lw': 2.2}
    if name.startswith('sum'):
        return {'color': '#000000', 'lw': 1.4, 'ls': '--'}
    return {}


def combined(setting: Setting) -> Drawing:
    """Draw D of every source, of all together, and the sum of the single ones."""
    study, result = _scenarios(setting)
    figure, (left, right) = panels(2, width_ratios=(3, 2))
    for colour, (name, value) in zip(COLOURS, result.items(), strict=False):
        left.plot(1e3 * study.s, 1e3 * value, label=name, **{'color': colour, **_style(name)})
    from_zero(left, 1.35)
    label(left, 'Deviation of each source and together', 'arc length [mm]', 'D [mm]')
    legend(left, ncols=2, loc='upper left')
    ratio = result['combined'] / result['sum of the single ones']
    right.plot(1e3 * study.s, ratio, color='#000000')
    right.axhline(1.0, color=COLOURS[1], lw=1.0, ls='--')
    right.set_ylim(0.0, 1.1)
    label(right, 'Combined over the sum', 'arc length [mm]', 'ratio')
    table = {'s_m': study.s, **{f'{k.replace(" ", "_")}_m': v for k, v in result.items()}}
    caption = (
        'All errors together stay below the sum of the single ones: deviations are vectors and '
        f'partly cancel; here the ratio is at most {ratio.max():.2f}.'
    )
    return Drawing('figure-11', caption, table, svg(figure))


def drift(setting: Setting) -> Drawing:
    """Draw D_cum of every scenario over path length, at equal steps of arc length."""
    study, result = _scenarios(setting)
    order = np.argsort(study.s, kind='stable')
    grid = np.linspace(0.0, float(study.s.max()), _GRID)
    table: dict[str, Array] = {'path_m': grid}
    figure, (left, right) = panels(2)
    for colour, (name, value) in zip(COLOURS, result.items(), strict=False):
        even = np.interp(grid, study.s[order], value[order])
        total = cumulative(even[:, None])
        power = growth_exponent(grid, total)
        table[f'{name.replace(" ", "_")}_d_cum_m'] = total
        style = {'color': colour, **_style(name)}
        left.plot(1e3 * grid, total, label=f'{name}: power {power:.2f}', **style)
        right.plot(1e3 * grid[1:], 1e3 * total[1:] / np.arange(2, _GRID + 1), **style)
    label(left, f'D_cum over {_GRID} equal steps', 'path length [mm]', 'D_cum [m]')
    label(right, 'D_cum per sample', 'path length [mm]', 'mean D so far [mm]')
    from_zero(left, 1.6)
    from_zero(right)
    legend(left, loc='upper left')
    caption = (
        'Cumulative drift: the sum grows with the path because every sample adds its deviation; '
        'per sample it stays what it was, so nothing accumulates.'
    )
    return Drawing('figure-14', caption, table, svg(figure))


def angles(setting: Setting) -> Drawing:
    """Draw D_norm over the angle: measured, proportional, and the difference."""
    study = next(iter(setting.studies.values()))
    offsets = default_tolerances(setting.robot, ('joint_offset',))
    values = default_values(offsets[0], 50)
    single = [sweep(study, tolerance, values) for tolerance in offsets]
    best = max(single, key=lambda result: float(result.max_m[-1]))
    result = {
        best.name.split('.')[1]: best,
        'all joints together': together(study, offsets, values, 'all'),
    }
    table: dict[str, Array] = {'angle_deg': values / DEGREE}
    figure, (left, right) = panels(2)
    for colour, (name, item) in zip(COLOURS, result.items(), strict=False):
        key = name.replace(' ', '_')
        table[f'{key}_d_norm'] = item.max_m / study.length
        table[f'{key}_proportional_d_norm'] = item.linear_m / study.length
        table[f'{key}_departure'] = item.departure
        left.plot(values / DEGREE, 1e3 * item.max_m / study.length, color=colour, label=name)
        left.plot(values / DEGREE, 1e3 * item.linear_m / study.length, color=colour, ls=':', lw=3)
        right.plot(values / DEGREE, 1e6 * item.departure, color=colour, label=name)
    label(
        left,
        'D_norm (dotted: proportional to the angle)',
        'angle of the error [deg]',
        'D_norm [1/1000]',
    )
    label(right, 'Departure from proportional', 'angle of the error [deg]', 'parts per million')
    right.set_yscale('symlog', linthresh=1.0)
    plain_powers(right)
    legend(left)
    legend(right)
    caption = (
        'Deviation over the angular error: proportional far beyond the range swept; one joint '
        f'alone is {1e6 * best.departure[-1]:.1f} ppm off at 0.5 deg.'
    )
    return Drawing('figure-10', caption, table, svg(figure))


def joints(setting: Setting) -> Drawing:
    """Draw the deviation over the angle for every joint."""
    study = next(iter(setting.studies.values()))
    offsets = default_tolerances(setting.robot, ('joint_offset',))
    values = default_values(offsets[0], 50)
    table: dict[str, Array] = {'angle_deg': values / DEGREE}
    figure, (left, right) = panels(2, width_ratios=(3, 2))
    slopes = []
    for colour, tolerance in zip(COLOURS, offsets, strict=False):
        result = sweep(study, tolerance, values)
        table[f'{tolerance.joint}_m'] = result.max_m
        slopes.append(result.max_m[-1] / values[-1])
        left.plot(values / DEGREE, 1e3 * result.max_m, color=colour, label=tolerance.joint)
    label(left, 'Largest deviation', 'angle of the error [deg]', 'max D [mm]')
    legend(left)
    names = [str(t.joint) for t in offsets]
    places = np.arange(len(names))
    right.barh(places, slopes, color=COLOURS[: len(names)])
    right.set_yticks(places, names)
    right.invert_yaxis()
    right.grid(False, axis='y')
    label(right, 'Lever arm, first joint at the top', 'S [m/rad]', '')
    caption = 'Deviation over the angular error of each joint: the lever arm to the tool decides.'
    return Drawing('figure-12', caption, table, svg(figure))


def widths(setting: Setting) -> Drawing:
    """Draw the deviation over the width of play on every motion."""
    gaps = default_tolerances(setting.robot, ('backlash',))
    values = default_values(gaps[0], 26)
    table: dict[str, Array] = {'width_deg': values / DEGREE}
    figure, axes = panels(3)
    for colour, (name, study) in zip(COLOURS, setting.studies.items(), strict=False):
        draws = np.repeat(values[:, None], len(gaps), axis=1)
        off = exact_deviations(study, gaps, draws)
        distance = np.linalg.norm(off, axis=-1)
        shown = {
            'peak': distance.max(axis=1),
            'rms': np.sqrt((distance**2 * arc_weights(study.s)).sum(axis=1)),
            'range': spread_of_passes(study, off),
        }
        style: dict[str, Any] = {'lw': 4.0, 'alpha': 0.35} if name == 'smooth' else {}
        for axis, (key, value) in zip(axes, shown.items(), strict=True):
            table[f'{name}_{key}_m'] = value
            axis.plot(values / DEGREE, 1e3 * value, color=colour, label=name, **style)
    titles = ('Peak', 'Rms over arc length', 'Spread at one place of the seam')
    for axis, title in zip(axes, titles, strict=True):
        label(axis, title, 'width of the gap, every joint [deg]', 'mm')
        from_zero(axis)
        legend(axis)
    caption = (
        'Deviation over backlash width: peak and rms hardly depend on the motion; what a motion '
        'with reversals adds is that the same place of the seam is met from both sides.'
    )
    return Drawing('figure-13', caption, table, svg(figure))
