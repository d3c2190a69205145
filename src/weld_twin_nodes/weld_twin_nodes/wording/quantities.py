# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Numbers with units as people read them: mm, mrad, ms; SI stays inside."""

from math import floor, isfinite, log10, pi
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.diagnosis.result import Diagnosis, Shrink
from weld_twin_core.effects import Effect
from weld_twin_core.effects.geometry import FrameError
from weld_twin_core.effects.transmission_ripple import TransmissionRipple

DEGREES = 180.0 / pi
"""Degrees in a radian."""
_PULL = 100.0
"""Torque [N m] under which a yielding is reported: what an arm's own links load a joint with."""
_BY_UNIT = {
    'm': (1e3, 'mm'),
    'rad': (1e3, 'mrad'),
    's': (1e3, 'ms'),
    'm/s': (1e6, 'µm/s'),
    '1/K': (1e6, 'ppm/K'),
    'rad/(N m)': (_PULL * DEGREES, f'° under {_PULL:.0f} N m'),
    'm/N': (1e6, 'µm/N'),
    's/s': (1e6, 'ppm'),
    '-': (1.0, ''),
}
"""Factor from SI and the unit that people read, by the unit of the parameter ..."""
_BY_NAME = {
    'phase': (1.0, 'rad'),
    'scale': (1e6, 'ppm'),
    'ratio': (1e6, 'ppm'),
    'difference': (1e6, 'ppm'),
    'strain': (1e6, 'ppm'),
    'warming_time': (1.0, 's'),
}
"""... or by its name, where the unit alone does not tell."""
UNCHANGED = 0.005
"""Share of a gap below which it counts as the same."""
MISSING = '\N{EN DASH}'
STAYS = 0.95
"""Ratio of after to before from which a gap counts as staying."""
_NARROW = 0.02
"""Width of an interval below which whole per cents would make its ends the same."""
_SMALL = 0.1
"""Share below which whole per cents have only one digit."""
_UNREAD = 5e-4
"""Angle [degrees] that is left over and that nobody reads: it would be 0.000."""
_THREE = 3
"""Digits of a value beside an action: more than a controller or a fitter can use."""
_SEEN = 2.0
"""Standard errors within which all parts of a vector count as nothing: about 95 %."""
_SMALL_STEP = 1e-6
"""Step [m, rad] of a frame by which it is told how errors go over into other axes."""
_GAP = '\N{NO-BREAK SPACE}'


def millimetres(metres: float | None) -> str:
    """Return a length as '0.421 mm'; below a micrometre, that it is."""
    if metres is None or not isfinite(metres):
        return MISSING
    value = 1e3 * metres
    if 0.0 < abs(value) < 0.0005:
        return f'<{_GAP}0.001{_GAP}mm'
    return f'{value:.{2 if abs(value) >= 10.0 else 3}f}{_GAP}mm'


def milliradians(radians: float | None) -> str:
    """Return an angle as '0.42 mrad'."""
    if radians is None or not isfinite(radians):
        return MISSING
    return f'{1e3 * radians:.3f}{_GAP}mrad'


def turned(radians: float) -> str:
    """Return an angle as '0.014°', with two digits at least."""
    value = DEGREES * abs(radians)
    places = 3 if value >= 0.01 or value == 0.0 else min(1 - floor(log10(value)), 6)
    return f'{value:.{places}f}°'


def small_turn(radians: float) -> str:
    """Return an angle as '0.014°', or that it is smaller than anybody reads."""
    return f'<{_GAP}0.001°' if abs(DEGREES * radians) < _UNREAD else turned(radians)


def both_angles(radians: float | None) -> str:
    """Return an angle as '0.023° (0.400 mrad)'."""
    if radians is None or not isfinite(radians):
        return MISSING
    return f'{turned(radians)} ({milliradians(radians)})'


def percent(share: float, places: int = 0) -> str:
    """Return a share as '93 %'; never 0 or 100 for what is only close to it."""
    value, step = 100.0 * share, 10.0**-places
    if 0.0 < value < 0.5 * step:
        return f'<{_GAP}{step:.{places}f}{_GAP}%'
    if 100.0 - 0.5 * step < value < 100.0:
        return f'>{_GAP}{100.0 - step:.{places}f}{_GAP}%'
    return f'{value:.{places}f}{_GAP}%'


def with_ends(share: float, low: float, high: float) -> tuple[str, str]:
    """Return a share and the ends of its interval to the same place, '6.6 %' and '6.2 to 6.9 %'."""
    return ends_to(int(fine(low, high)), share, low, high)


def fine(low: float, high: float) -> bool:
    """Tell whether an interval of shares needs a decimal."""
    return high < _SMALL or high - low < _NARROW


def ends_to(places: int, share: float, low: float, high: float) -> tuple[str, str]:
    """Return a share and the ends of its interval with so many decimals."""
    return percent(share, places), f'{100.0 * low:.{places}f} to {100.0 * high:.{places}f}{_GAP}%'


def change(shrink: float) -> str:
    """Return how much a gap shrinks, or grows."""
    if abs(shrink) < UNCHANGED:
        return 'unchanged'
    return f'{percent(abs(shrink))} {"less" if shrink > 0.0 else "more"}'


def shrink_ratio(shrink: Shrink) -> tuple[str, str]:
    """Return the ratio of after to before, and how sure it is."""
    value, ends = with_ends(shrink.ratio, *shrink.ci95)
    return value, f'95{_GAP}% interval {ends}'


def shrink_elsewhere(shrink: Shrink) -> str:
    """Return how much of the gap is left where nothing was recorded, in a sentence."""
    if shrink.elsewhere_ci95 is None:
        return ''
    _, ends = with_ends(shrink.ratio, *shrink.elsewhere_ci95)
    return f' On a motion where nothing was recorded it may be {ends}.'


def turns_only(diagnosis: Diagnosis) -> bool:
    """Tell whether what was found shows in the tool's orientation and not in its position."""
    shrink = diagnosis.shrink
    if shrink.orientation_rad is None or not diagnosis.effects or shrink.ratio < STAYS:
        return False
    before, after = shrink.orientation_rad
    return after < STAYS * before


def odds(probability: float) -> str:
    """Return a probability as '98 %'; nothing is certain, and nothing beyond possibility."""
    return percent(min(max(probability, 1e-9), 1.0 - 1e-9))


def counted(count: int, one: str, many: str | None = None) -> str:
    """Return '1 cell' or '3 cells'."""
    return f'{count} {one if count == 1 else many or f"{one}s"}'


def seconds(value: float) -> str:
    """Return a time as '12.3 s'."""
    return f'{value:.1f} s' if abs(value) < 1000.0 else f'{value:.0f} s'


def uncertain(value: float, std: float | None, factor: float = 1.0, unit: str = '') -> str:
    """Return '0.500 ± 0.012 mrad': two digits of the error, the value to the same place."""
    value = factor * value
    tail = unit if unit.startswith('°') else f' {unit}' if unit else ''
    if std is None or not isfinite(std) or std <= 0.0:
        return f'{_signed(f"{value:.4g}")}{tail}'
    std = factor * std
    places = min(max(1 - floor(log10(std)), 0), 9)
    return f'{_signed(f"{value:.{places}f}")} ± {std:.{places}f}{tail}'


def in_short(value: float, std: float | None, factor: float = 1.0, unit: str = '') -> str:
    """Return '0.0287 ± 0.0003°': three digits of the value, the error to the same place."""
    value = factor * value
    tail = unit if unit.startswith('°') else f' {unit}' if unit else ''
    places = min(max(_THREE - 1 - floor(log10(abs(value) or 1.0)), 0), 9)
    digits = _signed(f'{value:.{places}f}')
    if std is None or not isfinite(std) or std <= 0.0:
        return f'{digits}{tail}'
    error = max(round(factor * std, places), 10.0**-places)
    return f'{digits} ± {error:.{places}f}{tail}'


def _signed(number: str) -> str:
    if not number.strip('-0.'):
        number = number.lstrip('-')
    return number.replace('-', '\N{MINUS SIGN}')


def short_rows(
    effect: Effect, std: dict[str, Any], robot: Robot | None = None
) -> list[tuple[str, str]]:
    """Return the parameters of an effect as `in_short`; of a vector the axes that count."""
    if isinstance(effect, TransmissionRipple):
        return _orders(effect, std, slides=robot is not None and effect.on_slide(robot))
    effect, std = _as_told(effect, std, robot)
    out = []
    for p in effect.parameters:
        value: Any = getattr(effect, p.name)
        error: Any = std.get(p.name)
        factor, unit = display_unit(p.name, effect.unit(p, robot))
        if np.ndim(value):
            words = _that_count(
                value, error, *((DEGREES, '°') if unit == 'mrad' else (factor, unit))
            )
        elif unit == 'mrad':
            beside = in_short(float(value), None, factor, unit)
            words = f'{in_short(float(value), error, DEGREES, "°")} ({beside})'
        else:
            words = in_short(float(value), None if np.ndim(error) else error, factor, unit)
        out += [(p.name, words)] if words else []
    return out


def _as_told(
    effect: Effect, std: dict[str, Any], robot: Robot | None
) -> tuple[Effect, dict[str, Any]]:
    """Return the error of a frame in the axes in which its remedy is told; others as they are."""
    if robot is None or not isinstance(effect, FrameError):
        return effect, std
    known = {p.name: std[p.name] for p in effect.parameters if np.ndim(std.get(p.name, 0.0))}
    errors = np.concatenate([known.get(p.name, np.zeros(3)) for p in effect.parameters])
    told = [effect.with_vector(row).told(robot) for row in _SMALL_STEP * np.eye(6)]
    share = np.transpose(told) / _SMALL_STEP
    # A direction that is not known at all, with an infinite error, counts only where it takes part.
    parts = np.multiply(share, errors, where=share != 0.0, out=np.zeros((6, 6)))
    own = dict(zip(('xyz', 'rotvec'), np.linalg.norm(parts, axis=1).reshape(2, 3), strict=True))
    return effect.with_vector(effect.told(robot)), {name: own[name].tolist() for name in known}


def _that_count(value: Any, std: Any, factor: float, unit: str) -> str:
    """Return the parts of a vector that differ from nothing, each with its axis."""
    return ', '.join(
        axis + in_short(float(v), e, factor, unit)
        for axis, v, e in _parts(value, std)
        if (abs(v) > _SEEN * e if e is not None else v != 0.0)
    )


def _parts(value: Any, std: Any) -> list[tuple[str, Any, Any]]:
    """Return axis, value and standard error of the parts of a vector; None where it is not known."""
    errors = std if np.ndim(std) and len(std) == len(value) else [None] * len(value)
    axes = ('x ', 'y ', 'z ') if len(value) == len('xyz') else [''] * len(value)
    return list(zip(axes, value, errors, strict=True))


def parameter_rows(
    effect: Effect, std: dict[str, Any], robot: Robot | None = None
) -> list[tuple[str, str]]:
    """Return name and value of every parameter of an effect; a ripple has a row per order."""
    if isinstance(effect, TransmissionRipple):
        return _orders(effect, std, slides=robot is not None and effect.on_slide(robot))
    effect, std = _as_told(effect, std, robot)
    parameters = [p for p in effect.parameters if np.size(getattr(effect, p.name))]
    return [
        (p.name, _shown(p.name, effect.unit(p, robot), getattr(effect, p.name), std.get(p.name)))
        for p in parameters
    ]


def _shown(name: str, si: str, value: Any, std: Any) -> str:
    factor, unit = display_unit(name, si)
    if np.ndim(value):
        return _listed(value, std, *((DEGREES, '°') if unit == 'mrad' else (factor, unit)))
    error = None if np.ndim(std) else std
    if unit == 'mrad':
        beside = uncertain(float(value), error, factor).partition(' ±')[0]
        return f'{uncertain(float(value), error, DEGREES, "°")} ({beside}{_GAP}{unit})'
    return uncertain(float(value), error, factor, unit)


def _listed(value: Any, std: Any, factor: float, unit: str) -> str:
    """Return several numbers with their errors in one unit, each with its axis if there are three."""
    rows = _parts(value, std)
    if all(e is not None and abs(v) <= _SEEN * e for _, v, e in rows):
        alike = ' each' if len(value) > 1 else ''
        alike = ' in x, y and z' if len(value) == len('xyz') else alike
        return f'{uncertain(0.0, max(e for _, _, e in rows), factor, unit)}{alike}'
    parts = [axis + uncertain(float(v), e, factor) for axis, v, e in rows]
    return f'{", ".join(parts)}{"" if unit == "°" else " "}{unit}'.rstrip()


def _orders(
    ripple: TransmissionRipple, std: dict[str, Any], *, slides: bool
) -> list[tuple[str, str]]:
    """Return amplitude and phase for every order, the largest first."""

    def shown(size: float, error: float | None) -> str:
        if slides:
            return uncertain(size, error, 1e3, 'mm')
        return f'{uncertain(size, error, DEGREES, "°")} ({uncertain(size, None, 1e3, "mrad")})'

    columns = [np.atleast_1d(getattr(ripple, p.name)).tolist() for p in ripple.parameters]
    errors = [
        np.atleast_1d(std[key]).tolist() if key in std else [None] * len(columns[0])
        for key in ('amplitude', 'phase')
    ]
    rows = sorted(zip(*columns, *errors, strict=True), key=lambda row: -row[0])
    return [
        (
            f'order {order:g}',
            f'{shown(size, error)} at {uncertain(phase, turn, DEGREES, "°")}',
        )
        for size, order, phase, error, turn in rows
    ]


def display_unit(name: str, unit: str) -> tuple[float, str]:
    """Return the factor from SI and the unit a parameter is shown in."""
    return _BY_NAME.get(name) or _BY_UNIT.get(unit) or (1.0, unit)
