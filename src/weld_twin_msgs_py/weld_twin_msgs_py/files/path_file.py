# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Path files: a seam, its torch and, if it has one, its weave."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path as FilePath

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import PathError
from weld_twin_core.motion.inverse import rest
from weld_twin_core.motion.paths import Path, Torch, from_mapping

from .yaml_file import read_text, read_yaml


def read_path(path: FilePath | str) -> tuple[Path, Torch]:
    """Return the seam of a YAML file, or the spline through the x, y, z [m] of a CSV file."""
    try:
        if FilePath(path).suffix.lower() == '.csv':
            rows = csv.DictReader(read_text(path, 'path file').splitlines(), skipinitialspace=True)
            points = []
            for row in _whole(rows):
                try:
                    points.append([float(row[axis]) for axis in 'xyz'])
                except (KeyError, TypeError, ValueError):
                    raise PathError(
                        f'line {rows.line_num} must have numbers in the columns x, y, z'
                    ) from None
            return from_mapping({'kind': 'points', 'points': points}), Torch()
        data = read_yaml(path, 'path file')
        torch = data.get('torch') if isinstance(data, dict) else None
        return from_mapping(data), Torch.from_mapping(torch or {})
    except PathError as error:
        raise PathError(f"path file '{path}': {error}") from None


def read_external(path: FilePath | str, robot: Robot) -> Array | None:
    """
    Return where a path file says that external axes stand along the seam, shape (K, m) [rad or m].

    ``external`` names joints of a positioner or a track, each with one position or with as many
    as the others, spread evenly along the seam. Joints of the chain before them stand at zero.
    """
    data = None if FilePath(path).suffix.lower() == '.csv' else read_yaml(path, 'path file')
    given = data.get('external') if isinstance(data, dict) else None
    if given is None:
        return None
    where = f"path file '{path}': external"
    if not isinstance(given, dict) or not set(map(str, given)) <= set(robot.joint_names):
        raise PathError(f'{where} must have positions by joint: {", ".join(robot.joint_names)}')
    try:
        knots = {str(k): np.atleast_1d(np.asarray(v, dtype=np.float64)) for k, v in given.items()}
        columns = np.broadcast_arrays(*knots.values())
    except (TypeError, ValueError):
        raise PathError(
            f'{where} needs one number for each joint, or lists of one length'
        ) from None
    last = max(robot.index(name) for name in knots)
    external = np.zeros((columns[0].size, max(last + 1, robot.behind)))
    external[:, : robot.behind] = rest(robot)
    for name, column in zip(knots, columns, strict=True):
        external[:, robot.index(name)] = column
    if columns[0].ndim != 1 or not np.isfinite(external).all() or external.shape[1] >= robot.n:
        raise PathError(f'{where} needs finite numbers, and a joint that is left to the arm')
    still = np.clip(np.zeros((len(external), robot.n)), robot.lower, robot.upper)
    robot.check_positions(np.concatenate([external, still[:, external.shape[1] :]], axis=1))
    return external


def _whole(rows: csv.DictReader[str]) -> Iterator[dict[str, str]]:
    """Yield the rows; what the reader of tables cannot take is reported with its line."""
    try:
        yield from rows
    except csv.Error as error:
        raise PathError(f'line {rows.line_num} is no row of a table: {error}') from None
