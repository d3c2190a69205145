# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""C3D of motion capture: markers of any maker."""

import io
import warnings
from pathlib import Path

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from ..formats import Form, Rank, Read, form, one_of

C3D_MARK = b'\x50'
"""The second byte of every C3D file."""


def is_c3d(data: bytes) -> bool:
    """Return whether the first bytes are those of a C3D file."""
    return len(data) > 512 and data[1:2] == C3D_MARK and b'\0' in data[:512]


def read_c3d(path: Path, data: bytes, marker: str | None) -> Read:
    """Return time and place of one marker of a C3D file."""
    try:
        import c3d
    except ImportError:
        raise DataError(
            f"'{path}' is C3D; install its reader with: pip install 'weld-twin[mocap]'"
        ) from None
    try:
        with io.BytesIO(data) as file, warnings.catch_warnings():
            warnings.simplefilter('ignore')  # that a file has no force plates is no news here
            reader = c3d.Reader(file)
            labels = [str(label).strip() for label in reader.point_labels]
            unit = reader.get('POINT.UNITS').string_value.strip() or 'mm'
            rate, first = float(reader.point_rate), int(reader.first_frame)
            frames = [(number, points) for number, points, *_ in reader.read_frames()]
    except (AttributeError, AssertionError, ValueError, KeyError, EOFError) as error:
        raise DataError(f"'{path}' cannot be read as C3D: {error}") from None
    at = labels.index(one_of(labels, marker))
    rows = [_row((number - first) / rate, points[at]) for number, points in frames]
    header = ['time [s]', *(f'{axis} [{unit}]' for axis in 'xyz')]
    said = [f'read as C3D; measured is {labels[at]!r}']
    return Read(header, rows, list(range(1, len(rows) + 1)), said)


def _row(time: float, point: Array) -> list[str]:
    """Return a row; a residual below zero says that the marker was not seen."""
    seen = point[3] >= 0.0 and bool(np.isfinite(point[:3]).all())
    return [f'{time:.9g}', *(f'{v:.9g}' if seen else '' for v in point[:3])]


form(Form('C3D of any maker', Rank.BYTES, is_c3d, read_c3d))
