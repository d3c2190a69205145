# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Find a board in images, and write the table that `import` reads."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.errors import DataError, ModelError
from weld_twin_msgs_py.files.csv_text import csv_text
from weld_twin_msgs_py.messages.image_points import label
from weld_twin_msgs_py.tables.cameras import board_points, read_board
from weld_twin_msgs_py.tables.cells import read_cells

from ..given import Given

DICTIONARY = 'DICT_5X5_100'
"""Markers of a ChArUco board of which nothing is said."""
APRILTAG = 'DICT_APRILTAG_36h11'
"""Tags of which nothing is said: the family that apriltag_ros looks for first."""
MARKED = 0.75
"""Side of a marker in that of its square, where nothing is said: what OpenCV's samples print."""
WINDOW = (11, 11)
"""Half the window [px] in which a corner is refined; less than half a square of boards in use."""
REFINED = (3, 40, 1e-3)
"""OpenCV's criteria of an end: a count of steps and a shift [px], whichever comes first."""

Corners = tuple[list[str], np.ndarray]
"""Labels of the points found, and where, shape (N, 2) [px]."""


def detector(board: Mapping[str, Any]) -> Callable[[Path], Corners]:
    """Return what finds the corners of a board in an image file; of its numbers, `read_board`."""
    try:
        import cv2  # an extra of its own: few need it, and it weighs 60 MB
    except ImportError:
        raise ModelError(
            "weld-twin detect needs OpenCV: install it with pip install 'weld_twin[camera]'"
        ) from None
    result = _finder(cv2, board)

    def corners(path: Path) -> Corners:
        image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        if image is None:
            raise DataError(f"image '{path}' cannot be read; OpenCV reads PNG, JPEG, TIFF and BMP")
        labels, where = result(image)
        return [str(each) for each in labels], np.asarray(where, dtype=float).reshape(-1, 2)

    return corners


def _finder(cv2: Any, board: Mapping[str, Any]) -> Callable[[Any], Any]:
    if board['board'] == 'tags':
        return _tags(cv2, board)
    columns, rows = (int(count) for count in board['squares'])
    if board['board'] == 'chessboard':
        return _chessboard(cv2, columns - 1, rows - 1)
    return _charuco(cv2, columns, rows, board)


def _markers(cv2: Any, board: Mapping[str, Any], usual: str) -> Any:
    name = str(board.get('dictionary', usual))
    if not hasattr(cv2.aruco, name):
        raise ModelError(f'OpenCV has no dictionary {name!r}; one is {usual}')
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


def _tags(cv2: Any, board: Mapping[str, Any]) -> Callable[[Any], Any]:
    known = set(board_points(board))
    finely = cv2.aruco.DetectorParameters()
    finely.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    finder = cv2.aruco.ArucoDetector(_markers(cv2, board, APRILTAG), finely)

    def find(image: Any) -> Any:
        where, numbers, _ = finder.detectMarkers(image)
        labels = [] if numbers is None else numbers.ravel().tolist()
        each = [
            (label(tag, k), place)
            for tag, four in zip(labels, where, strict=True)
            for k, place in enumerate(four.reshape(-1, 2))
            if label(tag, k) in known
        ]
        return [text for text, _ in each], [place for _, place in each]

    return find


def _charuco(cv2: Any, columns: int, rows: int, board: Mapping[str, Any]) -> Callable[[Any], Any]:
    markers = _markers(cv2, board, DICTIONARY)
    side = float(board['square'])
    marker = float(board.get('marker', MARKED * side))
    made = cv2.aruco.CharucoBoard((columns, rows), side, marker, markers)
    finder = cv2.aruco.CharucoDetector(made)

    def find(image: Any) -> Any:
        where, labels, _, _ = finder.detectBoard(image)
        return ([], []) if labels is None else (labels.ravel().tolist(), where)

    return find


def _chessboard(cv2: Any, wide: int, high: int) -> Callable[[Any], Any]:
    def find(image: Any) -> Any:
        seen, where = cv2.findChessboardCorners(image, (wide, high))
        if not seen:
            return [], []
        return range(wide * high), cv2.cornerSubPix(image, where, WINDOW, (-1, -1), REFINED)

    return find


SUFFIXES = ('.png', '.jpg', '.jpeg', '.tif', '.tiff', '.bmp', '.pgm')
"""Images of a folder that are looked at."""


def run(given: Given) -> int:
    """Write the table, and say in how many images the board was found."""
    find = detector(read_board(given.board))
    paths = _paths(given.image)
    header, beside = _joints(given.joints, paths)
    rows, result = list[tuple[str, ...]](), 0
    for path, own in zip(paths, beside, strict=True):
        labels, where = find(path)
        result += bool(labels)
        for point, (u, v) in zip(labels, where.tolist(), strict=True):
            rows.append((path.name, given.camera, point, f'{u:.4f}', f'{v:.4f}', *own))
    if not rows:
        raise DataError(
            f'no image of {len(paths)} shows the board; check squares and dictionary in '
            f"'{given.board}'"
        )
    columns = ('image', 'camera', 'point', 'u [px]', 'v [px]', *header)
    with given.output_file() as out:
        out.write_text(csv_text(columns, rows), encoding='utf-8')
    print(f'{given.out}: the board is in {result} of {len(paths)} images, {len(rows)} points')
    return 0


def _paths(texts: list[str]) -> list[Path]:
    out = list[Path]()
    for text in texts:
        path = Path(text)
        if path.is_dir():
            out += sorted(one for one in path.iterdir() if one.suffix.lower() in SUFFIXES)
        elif path.is_file():
            out.append(path)
        else:
            raise DataError(f"there is no image or folder '{path}'")
    if not out:
        raise DataError(f"there is no image in '{texts[0]}'")
    return out


def _joints(file: str, paths: list[Path]) -> tuple[list[str], list[list[str]]]:
    """Return the columns beside the pixels, and their cells for every image."""
    if not file:
        return [], [[] for _ in paths]
    cells = read_cells(file, None, None)
    if 'image' not in cells.header:
        if len(cells.rows) != len(paths):
            raise DataError(
                f"table '{file}' has {len(cells.rows)} rows for {len(paths)} images; name the "
                "images in a column 'image'"
            )
        return cells.header, cells.rows
    at = cells.header.index('image')
    rows = {Path(row[at]).stem: row[:at] + row[at + 1 :] for row in cells.rows}
    for path in paths:
        if path.stem not in rows:
            raise DataError(f"table '{file}' has no row of image '{path.name}'")
    header = cells.header[:at] + cells.header[at + 1 :]
    return header, [rows[path.stem] for path in paths]
