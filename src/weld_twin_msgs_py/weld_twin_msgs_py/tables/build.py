# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A table to a recording of static stations, with every assumption put into words."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple
from zlib import crc32

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import matrix_from_quaternion
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Measurements, Recording, Signal

from .agreement import misfit
from .cells import Cells, read_cells
from .clock_column import stamps
from .header import Columns, find_columns
from .rotations import AGREES, disagreement, find_convention, rotations
from .table_options import TableOptions, flag_of
from .unit_guess import METRES, RADIANS, angle_unit, length_unit
from .words import OWN, tokens

_FAR = 10.0
"""A row this many times farther off than the median row is pointed out."""
_FARTHEST = 1e9
"""A coordinate beyond this is a slip in any unit, and its square may be no number."""
_TOO_GOOD = 2e-6
"""A typical misfit [m] below what any tracker repeats, a fifth of its best."""
_WRONG = 0.05
"""A typical misfit beyond this share of the arm's reach means that the table is wrong or misread."""


class Table(NamedTuple):
    """A recording of static stations, and the sentences that say how the table was read."""

    recording: Recording
    assumptions: tuple[str, ...]


def read_table(path: Path | str, robot: Robot, options: TableOptions | None = None) -> Table:
    """
    Read a table of joint angles and measured positions or poses.

    Parameters
    ----------
    path : Path or str
        A text file with a header line, cells separated by comma, semicolon or tab.
    robot : Robot
        Its kinematics decide between units and rotation conventions.
    options : TableOptions, optional
        What the user knows; the rest is read from the table and reported.

    Raises
    ------
    DataError
        The table cannot be read, or more than one reading is possible; the message names the
        option that decides.

    """
    options = options or TableOptions()
    cells = read_cells(path, options.delimiter, options.decimal, options.marker)
    return table_of(cells, robot, options, list(cells.said))


def table_of(cells: Cells, robot: Robot, options: TableOptions, said: list[str]) -> Table:
    """Return what the cells of a table mean; the same errors as `read_table`."""
    path = cells.path
    try:
        return _read(cells, robot, options, said)
    except DataError as error:
        text = str(error)
        raise DataError(text if str(path) in text else f"table '{path}': {text}") from None
    except (np.linalg.LinAlgError, OverflowError):
        raise DataError(
            f"table '{path}' holds numbers far beyond any robot's; look for slipped columns or "
            'decimal signs'
        ) from None


def _read(cells: Cells, robot: Robot, options: TableOptions, said: list[str]) -> Table:
    columns = find_columns(cells.header, robot, options)
    cells = _usable(cells, columns, options, said)
    said.append('joint columns are ' + ', '.join(columns.joints))
    unit = columns.unit(columns.joints)
    q = joint_angles(cells, robot, columns.joints, options, said, unit)
    position, scale = _position(cells, robot, q, columns, options, said)
    rotation = _rotation(cells, robot, q, columns, options, said) if columns.rotation else None
    sigma = _sigma(cells, columns, scale, said) if columns.sigma else None
    _check(cells, robot, q, position, options, said)
    t, sentence = stamps(cells, columns.time, columns.unit((columns.time or '',)), columns.date)
    said.append(sentence)
    if t is None:
        epoch, t = own_epoch(cells.path), np.arange(float(len(q)))
    else:
        epoch, t = round(float(t[0])) * 1_000_000_000, t - round(float(t[0]))
    temperature = None
    if columns.temperature is not None:
        values = cells.numbers(columns.temperature)
        temperature = Signal(t, values)
        said.append(f'temperature is {columns.temperature!r} in degC')
    recording = Recording(
        cells.path.stem,
        JointMotion(t, q, static=True),
        Measurements(t, position, rotation, sigma),
        temperature=temperature,
        epoch_ns=max(epoch, 0),
        notes=tuple(said),
    )
    return Table(recording, tuple(said))


def own_epoch(path: Path) -> int:
    """
    Return a date for a table without one, made from its content [ns].

    Before 2001, so that nobody takes it for real; two tables do not share it, so that neither is
    taken for a part of the other.
    """
    return 1_000_000_000_000 * (1 + crc32(path.read_bytes()) % 900_000)


def _usable(cells: Cells, columns: Columns, options: TableOptions, said: list[str]) -> Cells:
    """Return the cells without the rows to skip and those with a gap in a needed column."""
    needed = columns.joints + columns.position + columns.target + columns.difference
    needed += columns.rotation + columns.sigma
    needed += () if columns.temperature is None else (columns.temperature,)
    values = cells.stack(needed)
    whole = np.isfinite(values).all(axis=1)
    asked = np.zeros(len(cells.rows), bool)
    for row in options.skip_rows:
        if not 1 <= row <= len(cells.rows):
            raise DataError(f'--skip-rows names row {row}, the table has rows 1 to {asked.size}')
        asked[row - 1] = True
    gaps = np.flatnonzero(~whole & ~asked)
    if gaps.size:
        said.append(
            f'{gaps.size} rows with empty cells left out, the first in line {cells.lines[gaps[0]]}'
        )
    keep = np.flatnonzero(whole & ~asked)
    if not keep.size:
        raise DataError(f"table '{cells.path}' has no complete row")
    for k, j in np.argwhere(np.abs(values[keep]) > _FARTHEST)[:1]:
        raise DataError(
            f"table '{cells.path}' line {cells.lines[keep[k]]}, column {needed[j]!r}: "
            f"{values[keep[k], j]:.3g} is far beyond any robot's; look for slipped columns or "
            'decimal signs, or leave the row out with --skip-rows'
        )
    return Cells(
        cells.path,
        cells.header,
        [cells.rows[k] for k in keep],
        [cells.lines[k] for k in keep],
        cells.decimal,
        cells.said,
    )


def joint_angles(
    cells: Cells,
    robot: Robot,
    names: tuple[str, ...],
    options: TableOptions,
    said: list[str],
    unit: str | None = None,
) -> Array:
    """
    Return the joint columns of a table, shape (M, n) [rad or m], and say how they were read.

    Parameters
    ----------
    cells : Cells
    robot : Robot
    names : tuple of str
        The columns, in the robot's order.
    options : TableOptions
    said : list of str
        Sentences are added to it.
    unit : str, optional
        That the header gives.

    """
    q = cells.stack(names)
    turning = ~robot.prismatic
    given = options.angle_unit or unit
    unit, sentence = angle_unit(q[:, turning], given, 'joint angles')
    if sentence:
        said.append(sentence)
    q[:, turning] *= RADIANS[unit]
    q = as_modelled(q, robot, options, said)
    outside = ((q < robot.lower - 1e-6) | (q > robot.upper + 1e-6)).any(axis=1)
    if outside.any():
        said.append(f'{outside.sum()} rows leave the joint limits of robot {robot.name!r}')
    return q


def as_modelled(q: Array, robot: Robot, options: TableOptions, said: list[str]) -> Array:
    """
    Return joint columns, shape (M, n) [rad or m], counted as the model counts them.

    Signs come first, then what one joint adds to another, then offsets, which are in the
    model's sense.
    """
    for name in ('joint_signs', 'joint_offsets'):
        given = getattr(options, name)
        if given is not None and len(given) != robot.n:
            raise DataError(f'{flag_of(name)} needs {robot.n} numbers, got {len(given)}')
    if options.joint_signs is not None:
        q = q * np.array(options.joint_signs)
        said.append('signs of the joints are ' + _listed(options.joint_signs))
    if options.coupled is not None:
        q = _coupled(q, options.coupled)
        said.append(f'joints are coupled by {options.coupled}')
    if options.joint_offsets is not None:
        q = q + np.array(options.joint_offsets) * np.where(robot.prismatic, 1e-3, np.pi / 180.0)
        said.append(
            f'added to the joints are {_listed(options.joint_offsets)} deg (mm for a slide)'
        )
    return q


def _listed(values: tuple[float, ...]) -> str:
    return ', '.join(f'{value:g}' for value in values)


def _coupled(q: Array, text: str) -> Array:
    """Return joint columns after '3+2': what the model's third joint is, the second added."""
    match = re.fullmatch(r'\s*(\d+)\s*([+-])\s*(\d+)\s*', text)
    count = q.shape[1]
    one, other = (int(match[1]), int(match[3])) if match else (0, 0)
    if match is None or not (1 <= one <= count and 1 <= other <= count) or one == other:
        raise DataError(f'--coupled needs two joints such as 3+2 or 3-2, got {text!r}')
    out = np.array(q)
    out[:, one - 1] += (1.0 if match[2] == '+' else -1.0) * q[:, other - 1]
    return out


def _position(
    cells: Cells,
    robot: Robot,
    q: Array,
    columns: Columns,
    options: TableOptions,
    said: list[str],
) -> tuple[Array, float]:
    """Return measured positions (M, 3) [m] and the factor from the table's unit."""
    if columns.position:
        named = columns.position
        position = cells.stack(named)
        said.append('measured positions are ' + ', '.join(named))
        if any(set(tokens(name)) & OWN for name in named):
            said.append(
                f'{named[0]} may be what the controller computes; only an instrument measures'
            )
    else:
        named = columns.target
        sign = 1.0 if options.difference == 'add' else -1.0
        position = cells.stack(named) + sign * cells.stack(columns.difference)
        word = 'plus' if sign > 0.0 else 'minus'
        said.append(
            f'measured = target ({", ".join(named)}) {word} difference '
            f'({", ".join(columns.difference)}); --difference decides'
        )
    given = options.length_unit or columns.unit(named)
    unit, sentence = length_unit(position, robot, q, given)
    if sentence:
        said.append(sentence)
    return position * METRES[unit], METRES[unit]


def _rotation(
    cells: Cells,
    robot: Robot,
    q: Array,
    columns: Columns,
    options: TableOptions,
    said: list[str],
) -> Array:
    values = cells.stack(columns.rotation)
    if values.shape[1] == 4:
        rotation = matrix_from_quaternion(values, 'measured quaternion')
        said.append('measured quaternions are ' + ', '.join(columns.rotation))
        off = disagreement(rotation, robot, q)
        if off > AGREES:
            said.append(
                f'relative rotations disagree with the arm by {np.degrees(off):.3g} deg: the '
                'quaternion or joint columns may not be what they seem'
            )
        return rotation
    given = options.rotation_unit or columns.unit(columns.rotation)
    unit, sentence = angle_unit(values, given, 'measured angles')
    if sentence:
        said.append(sentence)
    angles = values * RADIANS[unit]
    convention = options.rotation
    if convention is None:
        convention, sentence = find_convention(angles, robot, q)
        said.append(sentence)
    return rotations(angles, convention)


def _sigma(cells: Cells, columns: Columns, scale: float, said: list[str]) -> Array:
    values = cells.stack(columns.sigma) * scale
    said.append('standard deviations are ' + ', '.join(columns.sigma) + ', joined by mean square')
    return np.asarray(np.sqrt((values**2).mean(axis=1)))


def _check(
    cells: Cells,
    robot: Robot,
    q: Array,
    position: Array,
    options: TableOptions,
    said: list[str],
) -> None:
    """
    Say how far the positions are from the nominal arm, and which rows stand out.

    A table that does not fit is refused where the user said how to read it. Read by its own
    header it stays as it is: `diagnose` finds out which mistake was made in it.
    """
    if len(q) < 8:
        said.append('too few rows to check the positions against the arm')
        return
    off = misfit(robot, q, position)
    typical = float(np.median(off))
    reach = float(abs(robot.a).sum() + abs(robot.d).sum())
    said.append(
        f'with base and tool fitted, positions are {typical * 1e3:.3g} mm (median) from the '
        'nominal arm'
    )
    if typical < _TOO_GOOD:
        said.append(
            'no instrument agrees so well with an arm: these positions were computed, not measured, '
            'and a diagnosis of them will find no gap'
        )
    if typical > _WRONG * reach:
        sentence = (
            f'positions are {typical * 1e3:.3g} mm from where robot {robot.name!r} would be, with '
            'base and tool fitted: wrong robot, joint columns, or units; --joint-columns, '
            '--angle-unit or --length-unit decide'
        )
        if options.joint_columns or options.angle_unit or options.length_unit:
            raise DataError(sentence)
        said.append(f'{sentence}, and weld-twin diagnose says what is wrong')
        return
    far = np.flatnonzero(off > _FAR * typical)
    if far.size:
        worst = int(far[off[far].argmax()])
        said.append(
            f'{far.size} rows stand out, most of all line {cells.lines[worst]} with '
            f'{off[worst] * 1e3:.3g} mm; they are kept, --skip-rows leaves rows out'
        )
