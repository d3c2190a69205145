# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures 11 and 14: all errors together, and what they sum to along the path."""

from __future__ import annotations

from typing import Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.sensitivity import Study, cumulative, scenario_deviations

from ..setting import Setting
from .canvas import COLOURS, Drawing, from_zero, label, legend, panels, svg

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
        power = _power(grid, total)
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


def _power(path: Array, total: Array) -> float:
    late = slice(len(path) // 2, None)
    return float(np.polyfit(np.log(path[late]), np.log(total[late]), 1)[0])
