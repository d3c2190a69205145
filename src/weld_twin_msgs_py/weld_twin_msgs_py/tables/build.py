# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A table to a recording of stations or of a motion, with every assumption put into words."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import matrix_from_quaternion
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, JointSignal, Measurements, Recording, Signal

from ..assembly.whole_recording import looks_static
from .cells import Cells, read_cells
from .formats import one_of
from .header import Columns, find_columns
from .joint_readings import FITS, JointColumns, Units, counted
from .unit_guess import METRES, RADIANS, angle_unit, factor, length_unit, misfit, stamps
from .words import EULER_ORDERS, OWN, ROTATION_VECTOR, TableOptions, flag_of, shortened, tokens

COUNTING = 'how the controller counts (--joint-signs, --joint-offsets, --coupled)'
"""What to look at where orientations disagree with the arm, beside the columns."""
AGREES = np.radians(3.0)
"""RMS disagreement of relative angles an arm with unknown errors may show."""
CLEARLY = 5.0
"""The runner-up must be worse by this factor."""
ROUNDING = 1e-4
"""Disagreement [rad] that digits left out of the table may cause."""


def rotations(angles: Array, convention: str) -> Array:
    """Return rotations (M, 3, 3) of angles (M, 3) [rad]: 'XYZ' means Rx Ry Rz; or 'rotvec'."""
    if convention == ROTATION_VECTOR:
        return np.asarray(Rotation.from_rotvec(angles).as_matrix())
    columns = angles[:, ['XYZ'.index(axis) for axis in convention]]
    return np.asarray(Rotation.from_euler(convention, columns).as_matrix())


def disagreement(rotation: Array, robot: Robot, q: Array) -> float:
    """Return the RMS difference [rad] of relative angles between table and arm."""
    off = _relative(rotation) - _relative(forward(robot, q)[:, :3, :3])
    return float(np.sqrt((off**2).mean()))


def _relative(rotation: Array) -> Array:
    """Return the angles between each orientation and two others, shape (2 M,)."""
    out = []
    for step in (1, max(1, len(rotation) // 2)):
        turn = np.swapaxes(rotation, -1, -2) @ np.roll(rotation, -step, axis=0)
        out.append(Rotation.from_matrix(turn).magnitude())
    return np.concatenate(out)


def find_convention(angles: Array, robot: Robot, q: Array) -> tuple[str, str]:
    """
    Return the convention of the angles and the sentence that says how it was found.

    The angle between the orientations at two stations does not depend on the frames of the instrument
    or the probe: the true convention agrees to the arm's accuracy, the others by tens of degrees.
    """
    result = {
        name: disagreement(rotations(angles, name), robot, q)
        for name in (*EULER_ORDERS, ROTATION_VECTOR)
    }
    ranked = sorted(result, key=lambda name: result[name])
    best, second = ranked[0], ranked[1]
    if result[best] > AGREES:
        raise DataError(
            f'no reading of the three angles agrees with the arm (the best, {best}, is '
            f'{np.degrees(result[best]):.3g} deg off); check the joint columns and '
            f'{COUNTING}, or --positions-only leaves orientation out'
        )
    if result[second] < CLEARLY * result[best] + ROUNDING:
        raise DataError(
            f'the angles could be {best} or {second}, the poses do not tell which; '
            '--rotation decides'
        )
    meaning = 'a rotation vector' if best == ROTATION_VECTOR else f'Euler {best} (intrinsic)'
    return best, (
        f'measured angles are {meaning}: relative rotations agree with the arm to '
        f'{np.degrees(result[best]):.2g} deg, the next reading is {np.degrees(result[second]):.2g} '
        'deg off'
    )


_TARGETS = {
    'target',
    'marker',
    'reflector',
    'reflektor',
    'smr',
    'prism',
    'ball',
    'kugel',
    'ziel',
    'point',
    'punkt',
}
"""First words of a column that says what was measured."""
_LISTED = 8
"""Rows that stand out which are listed at most."""
_FAR = 10.0
"""A row this many times farther off than the median row is pointed out."""
_FARTHEST = 1e9
"""A coordinate beyond this is a slip in any unit, and its square may be no number."""
_TOO_GOOD = 2e-6
"""A typical misfit [m] below what any tracker repeats, a fifth of its best."""
_JUDGED = 300
"""Rows, evenly over the table, from which units are guessed: two readings differ in all of them."""
LAST_STAMP = 2.0**31
"""Seconds since 1970 that a stamp of ROS can hold, until January 2038."""
BEYOND = (
    'the stamps lie beyond January 2038, the last that a bag can hold: they are counted from the '
    'first row'
)
_KELVINS = {'degC': 1.0, 'K': 1.0, 'degF': 5.0 / 9.0}
"""Units of temperature, and their degree [K]."""
_FREEZING = {'degC': 0.0, 'K': 273.15, 'degF': 32.0}
"""Where water freezes, in each unit."""
_TORQUES = {'N m': 1.0, 'N mm': 1e-3, 'N': 1.0}
"""Units of efforts [N m, or N of a slide]."""
_HOT = 150.0
"""No arm is so warm [degC]: without a unit, larger numbers are kelvins."""
_WRONG = 0.05
"""A typical misfit beyond this share of the arm's reach means that the table is wrong or misread."""


class Table(NamedTuple):
    """A recording of stations or of a motion, and the sentences that say how it was read."""

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
    return table_and_units(cells, robot, options, list(cells.said))[0]


def table_and_units(
    cells: Cells, robot: Robot, options: TableOptions, said: list[str]
) -> tuple[Table, Units]:
    """Return what a table means, and the units of the joints whose columns name none."""
    path = cells.path
    try:
        columns = find_columns(cells.header, robot, options)
        cells = _of_one_target(cells, columns, options.marker, said)
        usable, log = _usable(cells, columns, options, said)
        return _Reading(usable, robot, columns, options, said, log, cells.lines).table()
    except DataError as error:
        text = str(error)
        raise DataError(text if str(path) in text else f"table '{path}': {text}") from None
    except (np.linalg.LinAlgError, OverflowError):
        raise DataError(
            f"table '{path}' holds numbers far beyond any robot's; look for slipped columns or "
            'decimal signs'
        ) from None


@dataclass(frozen=True)
class _Reading:
    """One reading of a table; every assumption is said."""

    cells: Cells
    robot: Robot
    columns: Columns
    options: TableOptions
    said: list[str]
    log: Cells
    """Rows with all joints, also those in which nothing was measured."""
    lines: list[int]
    """Where every row of the file stands in it, as `--skip-rows` counts them."""

    def table(self) -> tuple[Table, Units]:
        """Return what the table means, and the units of the joints whose columns name none."""
        cells, robot, columns, said = self.cells, self.robot, self.columns, self.said
        said.append('joint columns are ' + ', '.join(columns.joints))
        if unused := columns.unused():
            said.append(f'not used: {shortened(unused)}')
        judge = replace(self, said=[])._relative_misfit
        units = self._joints.units(cells.stack(columns.joints), judge)
        q = self._joints.angles(cells, units)
        position, scale = self._position(q)
        rotation = self._rotation(q) if columns.rotation else None
        sigma = self._sigma(scale) if columns.sigma else None
        self._check(q, position)
        epoch, t = self._clock()
        motion, measured = JointMotion(t, q), Measurements(t, position, rotation, sigma)
        if looks_static(robot, motion, measured):
            motion = JointMotion(t, q, static=True)
        else:
            motion = self._whole_motion(motion, units)
            said.append('by their stamps the rows are one motion, not stations at rest')
        recording = Recording(
            cells.path.stem,
            motion,
            measured,
            temperature=self._temperature(t),
            effort=self._effort(t),
            epoch_ns=epoch,
            notes=tuple(said),
            counted=counted(robot, self.options),
        )
        return Table(recording, tuple(said)), units

    @property
    def _joints(self) -> JointColumns:
        return JointColumns(self.robot, self.columns.joints, self.options, self.said)

    def _clock(self) -> tuple[int, Array]:
        """Return what the stamps count from [ns since 1970] and the stamps, shape (M,) [s]."""
        named = self.columns
        t, sentence = stamps(self.cells, named.time, named.unit(named.time), named.date)
        self.said.append(sentence)
        if t is None:
            return own_epoch(self.cells.path), np.arange(float(len(self.cells.rows)))
        first = round(float(t[0]))
        if t[-1] >= LAST_STAMP:
            self.said.append(BEYOND)
        if not 0.0 <= t[0] <= t[-1] < LAST_STAMP:
            return own_epoch(self.cells.path), t - first
        return first * 1_000_000_000, t - first

    def _whole_motion(self, seen: JointMotion, units: Units) -> JointMotion:
        """Return the motion of all rows: where nothing was seen the joints may have turned round."""
        log, named = self.log, self.columns
        t, _ = stamps(log, named.time, named.unit(named.time), named.date)
        if t is None:
            return seen
        begin = log.lines.index(self.cells.lines[0])
        q = self._joints._replace(said=[]).angles(log, units)
        return JointMotion(t - t[begin] + seen.t[0], q)

    def _temperature(self, t: Array) -> Signal | None:
        name = self.columns.temperature
        if name is None:
            return None
        values = self.cells.numbers(name)
        there = np.isfinite(values)
        if not there.any():
            return None
        unit = self.columns.unit(name) or ('K' if np.median(values[there]) > _HOT else 'degC')
        scale = factor(_KELVINS, unit, name, 'the temperature')
        between = (
            '' if there.all() else f', and between {there.sum()} of {there.size} rows straight'
        )
        self.said.append(f'temperature is {name!r} in {unit}{between}')
        return Signal(t[there], (values[there] - _FREEZING[unit]) * scale)

    def _effort(self, t: Array) -> JointSignal | None:
        """Return the measured efforts; what cannot be used is left out, for few ask for it."""
        names = self.columns.effort
        if not names:
            return None
        units = [self.columns.unit(name) for name in names]
        if not {unit or 'N m' for unit in units} <= set(_TORQUES):
            self.said.append(
                f'the efforts {", ".join(names)} are in {units[0]} and left out: springs take N m'
            )
            return None
        values = self.cells.stack(names)
        empty = np.argwhere(~np.isfinite(values))
        if empty.size:
            line, name = self.cells.lines[empty[0][0]], names[empty[0][1]]
            self.said.append(f'the efforts are left out, for line {line} has none in {name!r}')
            return None
        unit = next((unit for unit in units if unit), 'N m, as the header names no unit')
        self.said.append(
            f'efforts are {", ".join(names)} in {unit}; --use-effort has springs take them'
        )
        values = values * [_TORQUES[unit or 'N m'] for unit in units]
        # A joint that is counted otherwise does the same work.
        other = counted(self.robot, self.options)
        return JointSignal(t, values if other is None else values @ np.linalg.inv(other.matrix))

    def _relative_misfit(self, q: Array) -> float:
        """Return how far joints and positions are from belonging together, as a share of the way."""
        position, _ = self._position(q)
        rows = np.unique(np.linspace(0, len(q) - 1, _JUDGED).astype(int))
        spread = float(np.linalg.norm(position[rows].std(axis=0)))
        return float(np.median(misfit(self.robot, q[rows], position[rows]))) / max(spread, 1e-9)

    def _position(self, q: Array) -> tuple[Array, str]:
        """Return measured positions (M, 3) [m] and the table's unit of length."""
        named = self.columns.position or self.columns.target
        off = () if self.columns.position else self.columns.difference
        sign = 1.0 if self.options.difference == 'add' else -1.0
        units = (self.options.length_unit, *map(self.columns.unit, named + off))
        own = next((unit for unit in units if unit), None)
        raw = self.cells.stack(named) + (sign * self.cells.stack(off) if off else 0.0)
        unit, sentence = length_unit(raw, self.robot, q, own)
        what = 'a measured position' if self.columns.position else 'a position'
        position = self._metres(named, unit, what)
        if self.columns.position:
            self.said.append('measured positions are ' + ', '.join(named))
            if any(set(tokens(name)) & OWN for name in named):
                self.said.append(
                    f'{named[0]} may be what the controller computes; only an instrument measures'
                )
        else:
            position = position + sign * self._metres(off, unit, what)
            word = 'plus' if sign > 0.0 else 'minus'
            self.said.append(
                f'measured = target ({", ".join(named)}) {word} difference '
                f'({", ".join(self.columns.difference)}); --difference decides'
            )
        if sentence:
            self.said.append(sentence)
        return position, unit

    def _metres(self, names: tuple[str, ...], usual: str, what: str) -> Array:
        """Return columns of lengths [m], each in its own unit where the header gives it one."""
        scale = [
            factor(
                METRES, self.options.length_unit or self.columns.unit(name) or usual, name, what
            )
            for name in names
        ]
        return np.asarray(self.cells.stack(names) * scale)

    def _rotation(self, q: Array) -> Array:
        values = self.cells.stack(self.columns.rotation)
        if values.shape[1] == 4:
            rotation = matrix_from_quaternion(values, 'measured quaternion')
            self.said.append('measured quaternions are ' + ', '.join(self.columns.rotation))
            off = disagreement(rotation, self.robot, q)
            if off > AGREES:
                self.said.append(
                    f'relative rotations disagree with the arm by {np.degrees(off):.3g} deg: the '
                    f'quaternion or joint columns may not be what they seem; check {COUNTING}'
                )
            return rotation
        own = [
            self.options.rotation_unit or self.columns.unit(name) for name in self.columns.rotation
        ]
        named = next((unit for unit in own if unit), None)
        unit, sentence = angle_unit(values, named, 'measured angles')
        if sentence:
            self.said.append(sentence)
        angles = values * [
            factor(RADIANS, each or unit, name, 'a measured angle')
            for each, name in zip(own, self.columns.rotation, strict=True)
        ]
        convention = self.options.rotation
        if convention is None:
            convention, sentence = find_convention(angles, self.robot, q)
            self.said.append(sentence)
        return rotations(angles, convention)

    def _sigma(self, unit: str) -> Array | None:
        values = self.cells.stack(self.columns.sigma) * [
            factor(METRES, self.columns.unit(name) or unit, name, 'a standard deviation')
            for name in self.columns.sigma
        ]
        names = ', '.join(self.columns.sigma)
        if values.min() <= 0.0:
            line = self.cells.lines[int(values.min(axis=1).argmin())]
            self.said.append(
                f'the standard deviations {names} are left out: those of line {line} are not above '
                'zero, and no instrument is so sure'
            )
            return None
        self.said.append(f'standard deviations are {names}, joined by mean square')
        return np.asarray(np.sqrt((values**2).mean(axis=1)))

    def _check(self, q: Array, position: Array) -> None:
        """
        Say how far the positions are from the nominal arm, and which rows stand out.

        A table that does not fit is refused where another reading does, or where the user said how to
        read it. Read by its own header it stays as it is: `diagnose` finds out which mistake was made.
        """
        if len(q) < 8:
            self.said.append('too few rows to check the positions against the arm')
            return
        off = misfit(self.robot, q, position)
        typical = float(np.median(off))
        reach = float(abs(self.robot.a).sum() + abs(self.robot.d).sum())
        self.said.append(
            f'with base and tool fitted, positions are {typical * 1e3:.3g} mm (median) from the '
            'nominal arm'
        )
        if typical < _TOO_GOOD:
            self.said.append(
                'no instrument agrees so well with an arm: these positions were computed, not measured, '
                'and a diagnosis of them will find no gap'
            )
        if typical > _WRONG * reach:
            sentence = (
                f'positions are {typical * 1e3:.3g} mm from where robot {self.robot.name!r} would be, '
                'with base and tool fitted'
            )
            remedy = self._remedy(q)
            if remedy:
                raise DataError(f'{sentence}; {remedy} they fit: import it so')
            sentence += (
                ': wrong robot, joint columns, or units; --joint-columns, '
                f'--angle-unit, --length-unit and {COUNTING} decide'
            )
            if self.options.joint_columns or self.options.angle_unit or self.options.length_unit:
                raise DataError(sentence)
            self.said.append(f'{sentence}, and weld-twin diagnose says what is wrong')
            return
        self._say_far(off, np.flatnonzero(off > _FAR * typical))

    def _say_far(self, off: Array, far: NDArray[np.intp]) -> None:
        """Say which rows stand out, by their distances [m]."""
        if far.size:
            worst = far[np.argsort(-off[far])]
            rows = [str(self.lines.index(self.cells.lines[k]) + 1) for k in worst[:_LISTED]]
            self.said.append(
                f'{far.size} rows stand out, most of all line {self.cells.lines[worst[0]]} with '
                f'{off[worst[0]] * 1e3:.3g} mm; they are kept, --skip-rows {",".join(rows)} leaves '
                f'{"them" if far.size <= _LISTED else "the worst"} out'
            )

    def _remedy(self, q: Array) -> str:
        """Return what brings positions and arm together, in words; empty where nothing does."""
        result = [(min(FITS, replace(self, said=[])._relative_misfit(q) / CLEARLY), '')]
        for words, other in self._others():
            with suppress(DataError):
                quiet = replace(other, said=[])
                result.append((quiet._relative_misfit(quiet._joints.angles(quiet.cells)), words))
        return min(result)[1]

    def _others(self) -> Iterator[tuple[str, '_Reading']]:
        """Return what else a table may mean, and how it is then to be read."""
        for option, values in (('length_unit', METRES), ('angle_unit', ('rad', 'deg'))):
            for unit in values:
                given: dict[str, Any] = {option: unit}
                yield (
                    f'with {flag_of(option)} {unit}',
                    replace(self, options=replace(self.options, **given)),
                )
        sign = '.' if self.cells.decimal == ',' else ','
        yield f"with --decimal '{sign}'", replace(self, cells=replace(self.cells, decimal=sign))
        seen = self.cells.stack(self.columns.position or self.columns.target)
        off = np.linalg.norm(seen - np.median(seen, axis=0), axis=1)
        near = off <= _FAR * np.median(off)
        if not near.all():
            far = [self.lines.index(self.cells.lines[k]) + 1 for k in np.flatnonzero(~near)]
            rows = ','.join(map(str, sorted({*far, *self.options.skip_rows})))
            cells = self.cells.taken(np.flatnonzero(near))
            yield f'with --skip-rows {rows}', replace(self, cells=cells)


def own_epoch(path: Path) -> int:
    """
    Return a date for a table without one, made from its content [ns].

    Before 2001, so that nobody takes it for real; two tables do not share it, so that neither is
    taken for a part of the other.
    """
    return 1_000_000_000_000 * (1 + crc32(path.read_bytes()) % 900_000)


def _of_one_target(cells: Cells, columns: Columns, marker: str | None, said: list[str]) -> Cells:
    """Return the rows of one of several targets on the tool that were seen from the same postures."""
    used = (*columns.joints, *columns.position, *columns.target, *columns.difference)
    name = cells.by_words({'target': _TARGETS}, used).get('target')
    if name is None or name not in cells.header:
        return cells
    labels, (posture, _) = cells.column(name), cells.alike(columns.joints)
    seen = np.bincount([at for at, _ in set(zip(posture.tolist(), labels, strict=True))])
    if np.median(seen) < 2.0:
        return cells  # each is one posture's own, or there is but one
    chosen = one_of(sorted(set(labels)), marker)
    said.append(f'measured is {chosen!r} of column {name!r}')
    return cells.taken(k for k, label in enumerate(labels) if label == chosen)


def _lost(cells: Cells, columns: Columns) -> NDArray[np.bool_]:
    """
    Return in which rows an instrument saw no target.

    A single zero may be the frame's origin, and so may all: a pin that was touched again and again.
    """
    if not columns.position:
        return np.zeros(len(cells.rows), bool)
    zero = (cells.stack(columns.position) == 0.0).all(axis=1)
    return zero if 1 < zero.sum() < zero.size else np.zeros_like(zero)


def _copies(
    cells: Cells, columns: Columns, needed: tuple[str, ...], said: list[str]
) -> NDArray[np.intp]:
    """
    Return the rows that were pasted twice: a diagnosis would take them for an instrument without noise.

    A posture that was measured again differs in its last digits, unless these are coarse; then other
    postures differ.
    """
    clock = tuple(name for name in (columns.date, columns.time) if name)
    _, first = cells.alike(needed + clock)
    copies = np.setdiff1d(np.arange(len(cells.rows)), first)
    if not copies.size or len(first) > len(cells.alike(columns.joints)[1]):
        return np.empty(0, np.intp)
    said.append(
        f'{copies.size} rows are others once more, digit by digit, and left out, the first in line '
        f'{cells.lines[copies[0]]}: what is measured again differs in its last digits'
    )
    return copies


def _usable(
    cells: Cells, columns: Columns, options: TableOptions, said: list[str]
) -> tuple[Cells, Cells]:
    """Return the rows with all that is needed, and those with all joints, those to skip in neither."""
    needed = columns.joints + columns.position + columns.target + columns.difference
    needed += columns.rotation + columns.sigma
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
    lost = whole & ~asked & _lost(cells, columns)
    if lost.any():
        said.append(
            f'{lost.sum()} rows whose measured position is exactly zero left out, the first in line '
            f'{cells.lines[int(lost.argmax())]}: instruments write it where they see no target; if it '
            'was there, count positions from another origin'
        )
    keep = np.flatnonzero(whole & ~asked & ~lost)
    keep = np.delete(keep, _copies(cells.taken(keep), columns, needed, said))
    if not keep.size:
        raise DataError(f"table '{cells.path}' has no complete row")
    for k, j in np.argwhere(np.abs(values[keep]) > _FARTHEST)[:1]:
        raise DataError(
            f"table '{cells.path}' line {cells.lines[keep[k]]}, column {needed[j]!r}: "
            f"{values[keep[k], j]:.3g} is far beyond any robot's; look for slipped columns or "
            'decimal signs, or leave the row out with --skip-rows'
        )
    joints = np.isfinite(cells.stack(columns.joints)).all(axis=1)
    return cells.taken(keep), cells.taken(np.flatnonzero(joints & ~asked))
