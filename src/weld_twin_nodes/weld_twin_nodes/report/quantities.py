# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Numbers with units as people read them: mm, mrad, ms; SI stays inside."""

from __future__ import annotations

from math import floor, isfinite, log10
from typing import Any

from weld_twin_core.effects import Effect

_BY_UNIT = {
    'm': (1e3, 'mm'), 'rad': (1e3, 'mrad'), 's': (1e3, 'ms'), 'm/s': (1e6, 'µm/s'),
    '1/K': (1e6, 'ppm/K'), 'rad/(N m)': (1e6, 'µrad/(N m)'), 'm/N': (1e6, 'µm/N'),
    '-': (1.0, ''),
}  # fmt: skip
_BY_NAME = {'phase': (1.0, 'rad'), 'scale': (1e6, 'ppm'), 'ratio': (1e6, 'ppm')}
MISSING = '\N{EN DASH}'


def millimetres(metres: float | None) -> str:
    """Return a length as '0.421 mm'; below a micrometre, that it is."""
    if metres is None or not isfinite(metres):
        return MISSING
    value = 1e3 * metres
    if 0.0 < abs(value) < 0.0005:
        return '< 0.001 mm'
    return f'{value:.{2 if abs(value) >= 10.0 else 3}f} mm'


def milliradians(radians: float | None) -> str:
    """Return an angle as '0.42 mrad'."""
    if radians is None or not isfinite(radians):
        return MISSING
    return f'{1e3 * radians:.3f} mrad'


def percent(share: float) -> str:
    """Return a share as '93 %'; never 0 or 100 for what is only close to it."""
    value = 100.0 * share
    if 0.0 < value < 0.5:
        return '< 1 %'
    if 99.5 < value < 100.0:
        return '> 99 %'
    return f'{value:.0f} %'


def odds(probability: float) -> str:
    """Return a probability as '98 %'."""
    return percent(min(max(probability, 0.0), 1.0))


def seconds(value: float) -> str:
    """Return a time as '12.3 s'."""
    return f'{value:.1f} s' if abs(value) < 1000.0 else f'{value:.0f} s'


def uncertain(value: float, std: float | None, factor: float = 1.0, unit: str = '') -> str:
    """Return '0.500 ± 0.012 mrad': two digits of the error, the value to the same place."""
    value = factor * value
    tail = f' {unit}' if unit else ''
    if std is None or not isfinite(std) or std <= 0.0:
        return f'{value:.4g}{tail}'
    std = factor * std
    places = min(max(1 - floor(log10(std)), 0), 9)
    return f'{value:.{places}f} ± {std:.{places}f}{tail}'


def parameter_rows(effect: Effect, std: dict[str, Any]) -> list[tuple[str, str]]:
    """Return name and value of every component of an effect's parameters."""
    out = []
    for parameter, k in effect.components():
        value, error = getattr(effect, parameter.name), std.get(parameter.name)
        name = parameter.name
        if k is not None:
            name = f'{name} {"xyz"[k] if parameter.size == 3 else k + 1}'
            value = value[k]
            error = error[k] if isinstance(error, list | tuple) and k < len(error) else None
        factor, unit = display_unit(parameter.name, parameter.unit)
        number = None if error is None or isinstance(error, list | tuple) else float(error)
        out.append((name, uncertain(float(value), number, factor, unit)))
    return out


def display_unit(name: str, unit: str) -> tuple[float, str]:
    """Return the factor from SI and the unit a parameter is shown in."""
    return _BY_NAME.get(name) or _BY_UNIT.get(unit) or (1.0, unit)
