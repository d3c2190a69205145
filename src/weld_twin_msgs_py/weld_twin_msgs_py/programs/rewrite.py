# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A program written again with other points: only the digits of those points change."""

import re
from collections.abc import Collection, Sequence

import numpy as np

from weld_twin_core.arm.rotation import rotation_vector
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from .build import Point, Program

SAME = (5.1e-6, 5.1e-5)
"""Rounding of a written length [m] and angle [rad] at most: the coarsest of the languages has a
thousandth of a millimetre and of a degree, and three coordinates add up."""
UNMOVED = 1e-9
"""Change of a point [m, rad] that is rounding: its digits stay as they are."""


def rewritten(program: Program, points: Sequence[Array], moved: Collection[int]) -> list[str]:
    """Return the texts of the files with some points moved to the values of all points."""
    edits: list[tuple[int, int, int, str]] = []
    for k in sorted(moved):
        point = program.points[k]
        if np.abs(points[k] - point.value).max() < UNMOVED:
            continue
        old = [number.value for number in point.numbers]
        new = point.notation.numbers(points[k], old)
        texts = program.sources
        for place, (number, value) in enumerate(zip(point.numbers, new, strict=True)):
            length, angle = point.notation.decimals
            least = angle if point.notation.joints or place > 2 else length
            written = texts[number.file].text[number.start : number.end]
            text = numeral(value, written, least)
            if abs(value - number.value) > 0.5 * 10.0 ** -max(least, _decimals(written)):
                edits.append((number.file, number.start, number.end, text))
    out = [source.text for source in program.sources]
    for file, start, end, text in sorted(edits, reverse=True):
        out[file] = out[file][:start] + text + out[file][end:]
    return out


def numeral(value: float, old: str, least: int) -> str:
    """Return a number as text, with the digits and the written sign of the old one."""
    text = f'{value:.{max(least, _decimals(old)) if least else 0}f}'
    if re.fullmatch(r'-0(\.0*)?', text):
        text = text[1:]
    return f'+{text}' if old.startswith('+') and not text.startswith('-') else text


def _decimals(text: str) -> int:
    result = re.search(r'\.(\d+)', text)
    return min(len(result[1]), 12) if result and 'e' not in text.lower() else 0


def check_written(before: Program, after: Program, points: Sequence[Array]) -> None:
    """Refuse a program that does not say what it was to say when it is read again."""
    same = len(before.points) == len(after.points) and len(before.steps) == len(after.steps)
    if same:
        for one, other in zip(before.steps, after.steps, strict=True):
            same &= (one.kind, one.stop, one.where) == (other.kind, other.stop, other.where)
        for value, was, point in zip(points, before.points, after.points, strict=True):
            same &= _close(value, point) and _same_external(was, point)
    if not same:
        raise DataError(
            f'{before.sources[0].name}: the corrected program reads differently from what was '
            'meant, so it is not written'
        )


def _same_external(was: Point, point: Point) -> bool:
    if was.external is None or point.external is None:
        return was.external is point.external
    return bool(np.abs(was.external - point.external).max(initial=0.0) < UNMOVED)


def _close(value: Array, point: Point) -> bool:
    if value.shape != point.value.shape:
        return False
    if np.abs(value - point.value).max() < UNMOVED:
        return True
    if value.ndim == 1:
        # A pulse is some ten thousandths of a degree; the digits written bound the rest.
        unit = 10.0 ** -point.notation.decimals[1] if point.notation.decimals[1] else 1.0
        off = np.array(point.notation.numbers(value, [n.value for n in point.numbers]))
        return bool(np.abs(off - [n.value for n in point.numbers]).max() <= 0.51 * unit)
    turn = rotation_vector(value[:3, :3] @ point.value[:3, :3].T)
    away = np.abs(value[:3, 3] - point.value[:3, 3]).max()
    return bool(away <= SAME[0] and np.abs(turn).max() <= SAME[1])
