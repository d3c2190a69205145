# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Files of cameras (camera_info as ROS writes it) and targets; a table of what was seen, in pixels."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.bundle import seen_by
from weld_twin_core.cameras import Camera, Lens, Sightings, Target
from weld_twin_core.cameras.sightings import PLACED
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Recording

from ..files.yaml_file import read_yaml
from ..messages.image_points import label
from .build import Table, own_epoch
from .cells import Cells, read_cells
from .header import joint_columns, time_columns, unit_of
from .joint_readings import JointColumns, counted
from .unit_guess import METRES, factor, stamps
from .words import TableOptions, shortened

LENSES = ('plumb_bob', 'rational_polynomial')
"""Models of distortion that are understood; coefficients in the order of OpenCV."""
BOARDS = ('charuco', 'chessboard', 'tags')
"""Boards whose points follow from a few numbers."""
_A_BOARD = f'board: {" | ".join(BOARDS)}'
ROUND = ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))
"""Corners of a tag in its side, clockwise from the upper left: x to the right, y down."""
AXES = ('x', 'y', 'z')


def read_camera(name: str, path: Path | str) -> Camera:
    """
    Return the camera of a ``camera_info`` file, with `mount: tool` or `mount: world` added.

    Parameters
    ----------
    name : str
        What tables and messages call it.
    path : Path or str
        YAML with ``camera_matrix``, ``distortion_model`` and ``distortion_coefficients``.

    Raises
    ------
    DataError, ModelError
        The file cannot be read, or something in it is missing; the message names both.

    """
    entry = read_yaml(path, 'camera file')
    needs = 'camera_matrix with nine numbers under data, and distortion_coefficients'
    with _understood(f"camera file '{path}'", 'is no camera_info', needs):
        matrix = _numbers(entry['camera_matrix'], 9)
        bent = _numbers(entry.get('distortion_coefficients', []), None)
        model = str(entry.get('distortion_model', LENSES[0]))
        if model not in LENSES and bent.any():
            raise DataError(
                f'distortion_model is {model!r}; only {" and ".join(LENSES)} are understood: '
                'calibrate with one of them'
            )
        lens = Lens(matrix[[0, 4]], matrix[[2, 5]], bent)
        size = (int(entry.get('image_width', 0)), int(entry.get('image_height', 0)))
        mount = str(entry.get('mount', 'world'))
        return Camera(name, lens, mount, size if min(size) > 0 else None)


def read_target(name: str, path: Path | str, mount: str | None = None) -> Target:
    """
    Return the target of a file.

    Parameters
    ----------
    path : Path or str
        YAML with ``points`` (label to x, y, z, or a list of them) or the numbers of a board
        (`board_points`), and where they apply ``mount`` and ``sigma``; or a table whose first
        column is the label, with columns x, y and z.
    mount : str, optional
        'tool' or 'world', where the file does not say it.

    Raises
    ------
    DataError, ModelError
        The file cannot be read or understood; the message names it.

    """
    path = Path(path)
    if path.suffix.lower() not in ('.yaml', '.yml', '.json'):
        return _of_table(name, path, mount or 'tool')
    entry = read_yaml(path, 'target file')
    needs = f'points, or {_A_BOARD} with squares: [columns, rows] and square: in metres'
    with _understood(f"target file '{path}'", 'cannot be understood', needs):
        points = _points(entry)
        sigma, own = float(entry.get('sigma', PLACED)), str(entry.get('mount', mount or 'tool'))
        places = np.array([*points.values()], dtype=float)
        return Target(name, tuple(points), places, own, sigma, facing='board' in entry)


def read_board(path: Path | str) -> Mapping[str, Any]:
    """Return the numbers of a board: ``board``, ``squares``, ``square`` and what else the file has."""
    entry = read_yaml(path, 'board file')
    needs = (
        f'{_A_BOARD}, squares: [columns, rows] and square: in metres, or of tags their size: and '
    )
    with _understood(f"board file '{path}'", 'cannot be understood', f'{needs}tags: by number'):
        board_points(entry)
        return dict(entry)


def board_points(entry: Mapping[str, Any]) -> dict[str, Array]:
    """
    Return the points of a board in its own frame by their labels [m].

    Inner corners have the numbers that OpenCV gives them, corners of tags those of `label`.

    entry: ``board`` (charuco or chessboard), ``squares`` (columns and rows of squares) and
    ``square`` (their side [m]); or ``board: tags``, ``tags`` (the middle of each by its number
    [m], or a single number) and ``size`` (side of the black square [m]).
    """
    if entry['board'] not in BOARDS:
        raise DataError(f'board is {entry["board"]!r}; a board is {" or ".join(BOARDS)}')
    if entry['board'] == 'tags':
        return _tag_points(entry['tags'], float(entry['size']))
    columns, rows = (int(count) for count in entry['squares'])
    side = float(entry['square'])
    if min(columns, rows) < 3 or not side > 0.0:
        raise DataError('a board has three squares at least each way, of a positive side [m]')
    wide = columns - 1
    return {
        str(k): np.array([k % wide + 1.0, k // wide + 1.0, 0.0]) * side
        for k in range(wide * (rows - 1))
    }


def _tag_points(tags: Any, size: float) -> dict[str, Array]:
    """Return the corners of tags in one plane, upright, by their labels [m]."""
    if not size > 0.0:
        raise DataError('size of the tags must be a positive side of the black square [m]')
    middles = tags if isinstance(tags, Mapping) else {tags: [0.0, 0.0, 0.0]}
    return {
        label(int(tag), k): np.array(middle, dtype=float) + size * np.array([*corner, 0.0])
        for tag, middle in middles.items()
        for k, corner in enumerate(ROUND)
    }


def _points(entry: Any) -> dict[str, Any]:
    if 'board' in entry:
        return board_points(entry)
    points = entry['points']
    pairs = points.items() if isinstance(points, Mapping) else enumerate(points)
    return {str(label): place for label, place in pairs}


def _of_table(name: str, path: Path, mount: str) -> Target:
    cells = read_cells(path, None, None)
    columns: dict[str, str] = {}
    for column in cells.header:
        first = column.lower().replace('[', ' ').split()[0] if column.strip() else ''
        if first in AXES:
            columns.setdefault(first, column)
    if len(columns) < len(AXES):
        raise DataError(f"target file '{path}' needs a column of labels, and columns x, y and z")
    scales = [factor(METRES, unit_of(columns[a]) or 'm', columns[a], 'a length') for a in AXES]
    places = cells.stack(tuple(columns[axis] for axis in AXES)) * scales
    return Target(name, tuple(cells.column(cells.header[0])), places, mount)


def _numbers(entry: Any, count: int | None) -> Array:
    """Return the numbers of a matrix as ROS writes it, or of a plain list."""
    out = np.array(entry['data'] if isinstance(entry, Mapping) else entry, dtype=float).ravel()
    if count is not None and out.size != count:
        raise ValueError(f'{out.size} numbers where {count} belong')
    return out


@contextmanager
def _understood(file: str, wrong: str, needs: str) -> Iterator[None]:
    """Report what a file lacks, or has of another kind, in a sentence: what is wrong, what it needs."""
    try:
        yield
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        why = f'{error} is missing' if isinstance(error, KeyError) else error
        raise DataError(f'{file} {wrong}: {why}; it needs {needs}') from None
    except DataError as error:
        raise DataError(f'{file}: {error}') from None


WORDS = {
    'camera': {'camera', 'cam', 'kamera'},
    'target': {'target', 'board', 'tafel'},
    'point': {'point', 'corner', 'marker', 'face', 'id', 'punkt', 'ecke'},
    'u': {'u', 'px'},
    'v': {'v', 'py'},
    'sigma': {'sigma', 'std'},
    'image': {'image', 'pose', 'station', 'frame', 'stamp', 'time', 't', 'bild', 'zeit'},
}
"""Names of the columns besides the joints."""


def read_pixels(
    path: Path | str,
    robot: Robot,
    cameras: Sequence[Camera],
    targets: Sequence[Target],
    options: TableOptions | None = None,
) -> Table:
    """
    Read a table of joint angles and pixels, a row for every point that a camera saw.

    Parameters
    ----------
    path : Path or str
        Columns ``u``, ``v`` [px], ``point``, those of the joints; ``camera`` and ``target`` where
        there are several; a stamp or a number of the image. Rows of one image share the joints.
    cameras, targets : sequence of Camera, Target
        Called as the table calls them; one alone may have any name.

    Raises
    ------
    DataError
        The table cannot be read, or names a camera, target or point that nobody described.

    """
    options = options or TableOptions()
    if not cameras or not targets:
        lacking = '--target' if cameras else '--camera'
        raise DataError(f"pixels of table '{path}' need {lacking} NAME=FILE beside the other")
    cells = read_cells(path, options.delimiter, options.decimal)
    said = list(cells.said)
    columns = _columns(cells, options)
    joints = joint_columns(cells.header, robot, options)
    said.append('joint columns are ' + ', '.join(joints))
    image, first = cells.alike([*joints, *([columns['image']] if 'image' in columns else [])])
    stations = cells.taken(first)
    q = JointColumns(robot, joints, options, said).stations(stations)
    t = _clock(stations, said)
    seen = _sightings(cells, columns, cameras, targets, image, t)
    recording = Recording(
        cells.path.stem,
        JointMotion(t, q, static=True),
        epoch_ns=own_epoch(cells.path),
        notes=tuple(said),
        counted=counted(robot, options),
    )
    try:
        recording = seen_by(recording, seen)
    except DataError as error:
        raise DataError(f"table '{path}': {error}") from None
    return Table(recording, recording.notes)


def _columns(cells: Cells, options: TableOptions) -> dict[str, str]:
    out = cells.by_words(WORDS, but=options.joint_columns or ())
    for use in ('u', 'v', 'point'):
        if use not in out:
            raise DataError(
                f"table '{cells.path}' has no column {use!r}; pixels need u, v and point; its "
                f'columns are {shortened(cells.header)}'
            )
    return out


def _clock(stations: Cells, said: list[str]) -> np.ndarray:
    date, clock = time_columns(stations.header)
    t, sentence = stamps(stations, clock, None if clock is None else unit_of(clock), date)
    said.append(sentence)
    return np.arange(float(len(stations.rows))) if t is None else t - t[0]


def _sightings(
    cells: Cells,
    columns: dict[str, str],
    cameras: Sequence[Camera],
    targets: Sequence[Target],
    image: np.ndarray,
    t: np.ndarray,
) -> Sightings:
    pixel = cells.stack((columns['u'], columns['v']))
    camera = _places(cells, columns.get('camera'), [c.name for c in cameras], 'camera')
    target = _places(cells, columns.get('target'), [one.name for one in targets], 'target')
    labels = [one.labels for one in targets]
    point = np.empty(len(image), dtype=int)
    for k, (which, called) in enumerate(zip(target, cells.column(columns['point']), strict=True)):
        if called not in labels[which]:
            raise DataError(
                f"table '{cells.path}' line {cells.lines[k]}: target {targets[which].name!r} has "
                f'no point {called!r}; it has {shortened(labels[which])}'
            )
        point[k] = labels[which].index(called)
    sigma = cells.numbers(columns['sigma']) if 'sigma' in columns else None
    kept = np.asarray(np.isfinite(pixel).all(axis=1))
    whole = Sightings(
        tuple(cameras),
        tuple(targets),
        t,
        image,
        camera,
        target,
        point,
        np.nan_to_num(pixel),
        sigma,
    )
    return whole if kept.all() else whole.take(kept)


def _places(cells: Cells, column: str | None, names: list[str], what: str) -> np.ndarray:
    if column is None:
        if len(names) > 1:
            raise DataError(
                f"table '{cells.path}' has no column {what!r}, and {len(names)} are described"
            )
        return np.zeros(len(cells.rows), dtype=int)
    texts = cells.column(column)
    for k, text in enumerate(texts):
        if text not in names:
            raise DataError(
                f"table '{cells.path}' line {cells.lines[k]}: {what} {text!r} is not described; "
                f'give it with --{what} {text}=FILE'
            )
    return np.array([names.index(text) for text in texts], dtype=int)
