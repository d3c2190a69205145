# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The corners of a board in images, as OpenCV finds them."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.errors import DataError, ModelError
from weld_twin_msgs_py.messages.image_points import label
from weld_twin_msgs_py.tables.cameras import board_points

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
        return [str(label) for label in labels], np.asarray(where, dtype=float).reshape(-1, 2)

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
