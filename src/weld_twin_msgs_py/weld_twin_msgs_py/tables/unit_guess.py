# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a table does not tell, guessed from its numbers: units, what its clock is good for, agreement."""

from collections.abc import Callable, Mapping
from datetime import datetime, timezone
from functools import partial
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from .cells import Cells

METRES = {'m': 1.0, 'mm': 1e-3, 'cm': 1e-2, 'um': 1e-6, 'in': 0.0254, 'ft': 0.3048}
RADIANS = {'rad': 1.0, 'deg': np.pi / 180.0, 'mrad': 1e-3}
_WIDEST = 20.0
"""Spread [m] of measured positions beyond that of any cell with one robot."""
_DOUBT = 6.0
"""The spread of the measurements may differ from the arm's own by this factor."""


def largest(values: Array) -> float:
    """Return the largest size of some numbers, zero for none; gaps do not count."""
    return float(np.nanmax(abs(values), initial=0.0))


def factor(known: Mapping[str, float], unit: str, column: str, what: str) -> float:
    """Return what a column is multiplied with; what is known of its kind has units, in SI."""
    if unit not in known:
        raise DataError(
            f'column {column!r} is taken for {what}, and its unit {unit!r} does not fit; name '
            'the right columns or units with the options of import'
        )
    return known[unit]


def angle_unit(values: Array, given: str | None, what: str) -> tuple[str, str]:
    """Return the unit of angles and the sentence that says how it was found."""
    if given is not None:
        return given, ''
    size = largest(values)
    if size > 2.0 * np.pi + 1e-3:
        return 'deg', f'{what} are in degrees (up to {size:.4g})'
    return 'rad', f'{what} are in radians (none beyond {size:.3g})'


def length_unit(position: Array, robot: Robot, q: Array, given: str | None) -> tuple[str, str]:
    """
    Return the unit of the measured positions and the sentence that says how it was found.

    The spread of the measurements must be that of the poses the joints give, whatever frame the
    instrument has. Where neither unit fits, columns are mixed up: what no cell spans in metres is
    then taken for millimetres.
    """
    if given is not None:
        return given, ''
    own = _spread(forward(robot, q)[:, :3, 3])
    theirs = _spread(position)
    for unit in ('m', 'mm'):  # inches must not pass for centimetres
        factor = METRES[unit]
        if own / _DOUBT < theirs * factor < own * _DOUBT:
            return unit, f'positions are in {unit} (they spread as far as the arm moves)'
    unit = 'mm' if theirs > _WIDEST else 'm'
    return unit, (
        f'positions spread over {theirs:.4g}, the arm moves over {own:.4g} m: neither metres nor '
        f'millimetres fit, {unit} is taken; --length-unit decides, or the columns are not what '
        'they seem'
    )


def _spread(position: Array) -> float:
    return float(np.sqrt(((position - position.mean(axis=0)) ** 2).sum(axis=1).mean()))


_SECONDS = {'s': 1.0, 'ms': 1e-3, 'us': 1e-6, 'ns': 1e-9, 'min': 60.0, 'h': 3600.0}
_LARGEST = (('s', 1e11), ('ms', 1e14), ('us', 1e17), ('ns', np.inf))
"""Beyond these, stamps since 1970 must be in the next finer unit."""


_SERIALS = (25_569.0, 73_051.0)
"""Days from the end of 1899, as Excel counts dates, to 1970 and to 2100."""
_FASTEST = 5e-4
"""Step [s] that no controller and no tracker is below; as days it is 43 s."""
_SET_BACK, _TIMES_SET = 3.0, 2
"""Usual steps by which stamps fall back, and how often, where a clock was set: rows that came late fall
back by less, rows in another order more often."""
_MOSTLY = 0.9
"""Share of the rows that are in order at least, for the others to be repeats and no other order."""
_DATES = ('%d.%m.%Y', '%Y/%m/%d', '%d-%b-%Y', '%Y-%m-%d', '%m/%d/%Y', '%d/%m/%Y', '')
"""Dates as instruments and spreadsheets write them, American before British; or none."""
_CLOCKS = ('%H:%M:%S.%f', '%H:%M:%S', '%H:%M', '%I:%M:%S.%f %p', '%I:%M:%S %p', '%I.%M.%S.%f %p')


def stamps(
    cells: Cells, column: str | None, unit: str | None, date: str | None = None
) -> tuple[Array | None, str]:
    """
    Return stamps of the rows, shape (rows,) [s], and a sentence; None when they are no use.

    ``date`` is the column of the day, where the time of day has a column of its own.
    """
    order = 'rows are taken in their order, one station per second'
    if column is None:
        return None, f'the table has no stamps; {order}'
    values = _parsed(cells, column, date)
    if values is None:
        return None, f'stamps in {column!r} cannot be read; {order}'
    steps = np.diff(values)
    if not (steps > 0.0).all():  # an empty cell is in no order either
        if told := set_back(cells, column, values):
            return None, f'{told}; {order}'
        line = cells.lines[int(np.argmin(steps > 0.0)) + 1]
        return None, (
            f'stamps in {column!r} do not increase from row to row (line {line} is the first); where '
            f'the rows are one motion, sort them by time first; {order}'
        )
    if unit is None and _is_serial(values, steps, column):
        days = values - _SERIALS[0]
        return days * 86_400.0, f'stamps in {column!r} are dates as Excel counts them, in days'
    chosen = unit or next(name for name, top in _LARGEST if abs(values).max() < top)
    scale = factor(_SECONDS, chosen, column, 'the time')
    return values * scale, f'stamps in {column!r} are in {chosen}'


def _is_serial(values: Array, steps: Array, column: str) -> bool:
    """Return whether stamps are dates in days: by their column's name, or no clock steps so little."""
    first, last = _SERIALS
    if not first <= values[0] <= values[-1] < last:
        return False
    named = any(word in column.lower() for word in ('date', 'datum'))
    return named or bool(steps.size and np.median(steps) < _FASTEST)


def set_back(cells: Cells, column: str, values: Array) -> str:
    """Return where stamps fall back once or twice, as of a clock that was set; empty where not."""
    steps = np.diff(values)
    falls = np.flatnonzero(steps < -_SET_BACK * np.median(np.abs(steps)))
    if not 0 < falls.size <= _TIMES_SET:
        return ''
    line = cells.lines[int(falls[0]) + 1]
    return (
        f'stamps in {column!r} go back in line {line}: the clock was set there, or another run begins; '
        'give what follows as a table of its own'
    )


def later_rows(
    cells: Cells, column: str | None, date: str | None = None
) -> NDArray[np.intp] | None:
    """Return the rows whose stamp is later than all before; None where the stamps are no use."""
    values = None if column is None else _parsed(cells, column, date)
    if values is None or np.isnan(values).any():
        return None
    if column is not None and (told := set_back(cells, column, values)):
        raise DataError(f"table '{cells.path}': {told}")
    before = np.concatenate([[-np.inf], np.maximum.accumulate(values)[:-1]])
    later = np.flatnonzero(values > before)
    return later if later.size >= _MOSTLY * values.size else None


def _parsed(cells: Cells, column: str, date: str | None) -> Array | None:
    if date is None:
        try:
            return cells.numbers(column)
        except DataError:
            pass
    texts = cells.column(column)
    if date is not None:
        texts = [f'{day} {clock}' for day, clock in zip(cells.column(date), texts, strict=True)]
    read = _reader(texts)
    if read is None:
        return None
    times = [read(text) for text in texts]
    zoned = [t if t.tzinfo else t.replace(tzinfo=timezone.utc) for t in times]
    return np.array([t.timestamp() for t in zoned])


def _reader(texts: list[str]) -> Callable[[str], datetime] | None:
    """Return what reads every one of the texts as a date with a time, or a time alone."""
    formats = [f'{day} {clock}'.strip() for day in _DATES for clock in _CLOCKS]
    readers: list[Callable[[str], datetime]] = [datetime.fromisoformat]
    readers += [partial(_by_format, form=form) for form in formats]
    for read in readers:
        try:
            for text in texts:
                read(text)
        except ValueError:
            continue
        return read
    return None


def _by_format(text: str, form: str) -> datetime:
    # A comma before the fraction of a second, as German spreadsheets have it.
    result = datetime.strptime(text.replace(',', '.').strip(), form)
    return result if '%Y' in form else result.replace(year=2000)


_ROUNDS = 30
"""Rounds of fitting the frames in turn; a guess of units needs no more digits."""
_FIRST = 3
"""Rounds after which the best of several beginnings stands out from the others."""
_FAR = 0.02
"""Share of the measured span that a fit may leave before others are begun elsewhere: units differ by
more, and errors of arms are less."""
_CORNERS = tuple(
    turn
    for order in permutations(range(3))
    for signs in product((1.0, -1.0), repeat=3)
    if np.linalg.det(turn := np.diag(signs) @ np.eye(3)[list(order)]) > 0.0
)
"""The 24 turns that put axes on axes: every turn is within 63 degrees of one of them."""


def misfit(robot: Robot, q: Array, position: Array) -> Array:
    """
    Return the distance of each position (M, 3) from the nominal arm, shape (M,) [m].

    Measuring frame and tool point are fitted, in turns: a rigid fit (Kabsch), then a linear one.
    """
    T = forward(robot, q)
    flange, turn = T[:, :3, 3], T[:, :3, :3]
    seen, count = position - position.mean(axis=0), len(q)
    # All that the rounds need are sums over the rows, so a long table is read once.
    turns, flanges = turn.sum(axis=0), flange.sum(axis=0)
    seen_turn = (seen.T @ turn.reshape(count, 9)).reshape(3, 3, 3)
    seen_flange = seen.T @ flange
    turned_flange = np.einsum('mbc,mb->c', turn, flange)

    def fitted(R: Array, rounds: int) -> tuple[Array, Array]:
        """Return what is left of every position, and the turn of the frame after so many rounds."""
        for _ in range(rounds):
            cross, own = R @ turns, count * np.eye(3)
            normal = np.block([[own, cross.T], [cross, own]])
            right = [np.einsum('ab,abc->c', R, seen_turn) - turned_flange, -R @ flanges]
            solution = np.linalg.lstsq(normal, np.concatenate(right), rcond=None)[0]
            last, R = R, _best_turn(seen_flange + seen_turn @ solution[:3])
        rest = seen - (flange + turn @ solution[:3]) @ last.T - solution[3:]
        return np.asarray(np.linalg.norm(rest, axis=1)), R

    result, _ = fitted(_best_turn(seen_flange), _ROUNDS)
    if np.median(result) > _FAR * np.linalg.norm(seen, axis=1).max(initial=0.0):
        # Few axes bring the flange along an arc: then the turns have ends that are not the best.
        begun = [fitted(turn, _FIRST) for turn in _CORNERS]
        _, R = min(begun, key=lambda one: float(np.median(one[0])))
        result = min(result, fitted(R, _ROUNDS)[0], key=np.median)
    return result


def _best_turn(products: Array) -> Array:
    """Return the rotation (3, 3) that turns points closest to others (Kabsch), by their products."""
    u, _, vt = np.linalg.svd(products)
    sign = np.sign(np.linalg.det(u @ vt))
    return np.asarray(u @ np.diag([1.0, 1.0, sign]) @ vt)
