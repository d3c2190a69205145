# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Path files: a seam, its torch and, if it has one, its weave."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path as FilePath

from weld_twin_core.errors import PathError
from weld_twin_core.motion.paths import Path, Torch, from_mapping

from .yaml_file import read_text, read_yaml


def read_path(path: FilePath | str) -> tuple[Path, Torch]:
    """
    Return the seam of a YAML file, or the spline through the points of a CSV file.

    A CSV file has the columns x, y, z [m] with a header line.

    Raises
    ------
    ModelError
        The file cannot be read.
    PathError
        It does not describe a seam.

    """
    try:
        if FilePath(path).suffix.lower() == '.csv':
            return from_mapping({'kind': 'points', 'points': _points(path)}), Torch()
        data = read_yaml(path, 'path file')
        torch = data.get('torch') if isinstance(data, dict) else None
        return from_mapping(data), Torch.from_mapping(torch or {})
    except PathError as error:
        raise PathError(f"path file '{path}': {error}") from None


def _points(path: FilePath | str) -> list[list[float]]:
    rows = csv.DictReader(read_text(path, 'path file').splitlines(), skipinitialspace=True)
    points = []
    for row in _whole(rows):
        try:
            points.append([float(row[axis]) for axis in 'xyz'])
        except (KeyError, TypeError, ValueError):
            raise PathError(
                f'line {rows.line_num} must have numbers in the columns x, y, z'
            ) from None
    return points


def _whole(rows: csv.DictReader[str]) -> Iterator[dict[str, str]]:
    """Yield the rows; what the reader of tables cannot take is told with its line."""
    try:
        yield from rows
    except csv.Error as error:
        raise PathError(f'line {rows.line_num} is no row of a table: {error}') from None
