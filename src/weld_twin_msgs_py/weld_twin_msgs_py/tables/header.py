# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which column is what, from the names in the header."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from weld_twin_core.arm.robot import Robot
from weld_twin_core.errors import DataError

from .table_options import TableOptions, flag_of

MEASURED = {'measurement', 'measured', 'meas', 'actual', 'tracker', 'laser', 'real', 'observed'}
TARGET = {'t', 'target', 'goal', 'nominal', 'cmd', 'command', 'commanded', 'desired', 'set', 'ref'}
DIFFERENCE = {'dif', 'diff', 'difference', 'delta', 'err', 'error', 'dev', 'deviation'}
SIGMA = {'std', 'sigma', 'sd', 'stdev', 'stddev', 'uncertainty'}
UNITS = {'m', 'mm', 'rad', 'deg', 'degree', 'degrees', 's', 'ms', 'us', 'ns'}
_UNIT_NAMES = {'degree': 'deg', 'degrees': 'deg', '\u00b0': 'deg'}
_ANGLES = {'roll': 'x', 'pitch': 'y', 'yaw': 'z'}
_JOINT = re.compile(r'^(?:joint|axis|theta|q|j|a)_?(\d+)$')


@dataclass(frozen=True)
class Named:
    """A header cell taken apart: what is left of the name, axis, kind of number, unit."""

    name: str
    stem: tuple[str, ...]
    axis: str = ''
    kind: str = ''
    unit: str | None = None


@dataclass
class Columns:
    """The columns by use; an empty tuple is a use nothing serves. ``units`` go by column."""

    joints: tuple[str, ...] = ()
    position: tuple[str, ...] = ()
    target: tuple[str, ...] = ()
    difference: tuple[str, ...] = ()
    rotation: tuple[str, ...] = ()
    sigma: tuple[str, ...] = ()
    temperature: str | None = None
    time: str | None = None
    units: dict[str, str | None] = field(default_factory=dict)

    def unit(self, names: Iterable[str]) -> str | None:
        """Return the unit the header gives the columns, None when it gives none."""
        return next((self.units[name] for name in names if self.units.get(name)), None)


def find_columns(header: Sequence[str], robot: Robot, options: TableOptions) -> Columns:
    """
    Return the columns by use.

    Raises
    ------
    DataError
        A use that is needed has no column, or more than one; the message names the option that
        decides.

    """
    parts = [_taken_apart(name) for name in header]
    out = Columns(units={part.name: part.unit for part in parts})
    out.joints = options.joint_columns or _joints(parts, robot)
    if len(out.joints) != robot.n:
        raise DataError(
            f'robot {robot.name!r} has {robot.n} joints, but {len(out.joints)} joint columns are '
            'named in --joint-columns'
        )
    _positions(parts, options, out)
    if not options.positions_only:
        out.rotation = options.rotation_columns or _rotation(parts)
    out.sigma = options.sigma_columns or _one_group(parts, 'length', SIGMA, 'sigma_columns', False)
    out.temperature = options.temperature_column or _first(header, r'temp')
    out.time = options.time_column or _first(header, r'time|stamp|^t$')
    return out


def joint_columns(header: Sequence[str], robot: Robot, options: TableOptions) -> tuple[str, ...]:
    """
    Return the joint columns alone, in the robot's order.

    Raises
    ------
    DataError
        There are none, or more than one set; the message names the option that decides.

    """
    return options.joint_columns or _joints([_taken_apart(name) for name in header], robot)


def _taken_apart(name: str) -> Named:
    tokens = [t for t in re.split(r'[^0-9a-z\u00b0]+', name.lower()) if t]
    unit = None
    if len(tokens) > 1 and tokens[-1] in UNITS | set(_UNIT_NAMES):
        unit = _UNIT_NAMES.get(tokens[-1], tokens[-1])
        tokens = tokens[:-1]
    for k, token in enumerate(tokens):
        stem = tuple(tokens[:k] + tokens[k + 1 :])
        if token in ('x', 'y', 'z'):
            return Named(name, stem, token, 'length', unit)
        if re.fullmatch(r'q[xyzw]', token):
            return Named(name, stem, token[1], 'quaternion', unit)
        if re.fullmatch(r'r[xyz]', token):
            return Named(name, stem, token[1], 'angle', unit)
        if token in _ANGLES:
            return Named(name, stem, _ANGLES[token], 'rpy', unit)
    return Named(name, tuple(tokens), unit=unit)


def _joints(parts: Sequence[Named], robot: Robot) -> tuple[str, ...]:
    """Return columns with the joints' own names, else numbered ones."""
    plain = {'_'.join(part.stem): part.name for part in parts if not part.axis}
    own = [plain.get(re.sub(r'[^0-9a-z]+', '_', joint.lower())) for joint in robot.joint_names]
    if all(own):
        return tuple(str(name) for name in own)
    numbered: dict[str, dict[int, str]] = {}
    for stem, name in plain.items():
        match = _JOINT.match(stem)
        if match:
            numbered.setdefault(stem[: match.start(1)], {})[int(match.group(1))] = name
    fitting = [
        tuple(group[k] for k in sorted(group))
        for group in numbered.values()
        if sorted(group) in (list(range(robot.n)), list(range(1, robot.n + 1)))
    ]
    if len(fitting) != 1:
        found = 'more than one set of' if fitting else 'no'
        raise DataError(
            f'the table has {found} columns for the {robot.n} joints of robot {robot.name!r} '
            f'({", ".join(robot.joint_names)}); --joint-columns decides'
        )
    return fitting[0]


def _positions(parts: Sequence[Named], options: TableOptions, out: Columns) -> None:
    out.position = options.position_columns or ()
    out.target = options.target_columns or ()
    out.difference = options.difference_columns or ()
    if not out.position and not (out.target and out.difference):
        out.position = _one_group(parts, 'length', MEASURED, 'position_columns', True)
    if out.position:
        return
    target = out.target or _one_group(parts, 'length', TARGET, 'target_columns', False)
    difference = out.difference or _one_group(
        parts, 'length', DIFFERENCE, 'difference_columns', False
    )
    if not target or not difference:
        raise DataError(
            'the table has no columns with measured positions, nor target and difference; '
            '--position-columns, or --target-columns and --difference-columns, decide'
        )
    out.target, out.difference = target, difference


def _rotation(parts: Sequence[Named]) -> tuple[str, ...]:
    """Return the measured quaternion or angles, nothing when the table has none."""
    for kind, axes in (('quaternion', 'xyzw'), ('angle', 'xyz'), ('rpy', 'xyz')):
        found = _one_group(parts, kind, MEASURED, 'rotation_columns', True, axes)
        if found:
            return found
    return ()


def _one_group(
    parts: Sequence[Named], kind: str, words: set[str], option: str, bare: bool, axes: str = 'xyz'
) -> tuple[str, ...]:
    """
    Return the one complete group of a kind whose stem says so.

    With ``bare``, a group without any stem will do when no other says so. Spread words (sigma,
    difference) never count as measured.
    """
    groups: dict[tuple[str, ...], dict[str, str]] = {}
    for part in parts:
        if part.kind == kind:
            groups.setdefault(part.stem, {})[part.axis] = part.name
    whole = {stem: group for stem, group in groups.items() if set(axes) <= set(group)}
    spread = SIGMA | DIFFERENCE
    named = [stem for stem in whole if set(stem) & words and not (set(stem) - words) & spread]
    if not named and bare and () in whole:
        named = [()]
    if len(named) > 1:
        listed = '; '.join(', '.join(whole[stem][axis] for axis in axes) for stem in named)
        raise DataError(f'several columns could serve ({listed}); {flag_of(option)} decides')
    return tuple(whole[named[0]][axis] for axis in axes) if named else ()


def _first(header: Sequence[str], pattern: str) -> str | None:
    return next((name for name in header if re.search(pattern, name.lower())), None)
