# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A table of joint angles and what cameras saw, in pixels, to a recording of stations."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.bundle import seen_by
from weld_twin_core.cameras import Camera, Sightings, Target
from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion, Recording

from .build import Table, own_epoch
from .cells import Cells, read_cells
from .header import joint_columns, time_columns, unit_of
from .joint_readings import counted, station_joints
from .unit_guess import stamps
from .words import TableOptions, shortened

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
    q = station_joints(stations, robot, joints, options, said)
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
    for k, (which, label) in enumerate(zip(target, cells.column(columns['point']), strict=True)):
        if label not in labels[which]:
            raise DataError(
                f"table '{cells.path}' line {cells.lines[k]}: target {targets[which].name!r} has "
                f'no point {label!r}; it has {shortened(labels[which])}'
            )
        point[k] = labels[which].index(label)
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
