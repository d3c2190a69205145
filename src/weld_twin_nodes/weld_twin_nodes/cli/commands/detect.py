# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Find a board in images: a table of pixels for weld-twin import.

OpenCV finds the corners. The table goes to weld-twin import with --camera and --target. --joints
has a row for every image, in their order, or a column 'image' that names it.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from weld_twin_core.errors import DataError

from ..options import file_output, output_file

EXAMPLE = 'weld-twin detect images --board board.yaml --joints joints.csv --out pixels.csv'
SUFFIXES = ('.png', '.jpg', '.jpeg', '.tif', '.tiff', '.bmp', '.pgm')
"""Images of a folder that are looked at."""
OPTIONS = (
    """
IMAGE ...                images, or a folder of them
--board FILE.yaml, required  charuco, chessboard or tags: kind, squares, their side, and markers, as
                         docs/cameras.md has it
--camera NAME            what the table calls the camera [default: camera]
--joints FILE.csv        joint angles of every image
""",
    file_output('table to write'),
)


def run(args: argparse.Namespace) -> int:
    """Write the table, and say in how many images the board was found."""
    from weld_twin_msgs_py.files.csv_text import csv_text
    from weld_twin_msgs_py.tables.camera_files import read_board

    from ...offline.board_detection import detector

    find = detector(read_board(args.board))
    paths = _paths(args.image)
    header, beside = _joints(args.joints, paths)
    rows, result = list[tuple[str, ...]](), 0
    for path, own in zip(paths, beside, strict=True):
        labels, where = find(path)
        result += bool(labels)
        for label, (u, v) in zip(labels, where.tolist(), strict=True):
            rows.append((path.name, args.camera, label, f'{u:.4f}', f'{v:.4f}', *own))
    if not rows:
        raise DataError(
            f'no image of {len(paths)} shows the board; check squares and dictionary in '
            f"'{args.board}'"
        )
    columns = ('image', 'camera', 'point', 'u [px]', 'v [px]', *header)
    with output_file(args) as out:
        out.write_text(csv_text(columns, rows), encoding='utf-8')
    print(f'{args.out}: the board is in {result} of {len(paths)} images, {len(rows)} points')
    return 0


def _paths(given: list[str]) -> list[Path]:
    out = list[Path]()
    for text in given:
        path = Path(text)
        if path.is_dir():
            out += sorted(one for one in path.iterdir() if one.suffix.lower() in SUFFIXES)
        elif path.is_file():
            out.append(path)
        else:
            raise DataError(f"there is no image or folder '{path}'")
    if not out:
        raise DataError(f"there is no image in '{given[0]}'")
    return out


def _joints(file: str, paths: list[Path]) -> tuple[list[str], list[list[str]]]:
    """Return the columns beside the pixels, and their cells for every image."""
    if not file:
        return [], [[] for _ in paths]
    from weld_twin_msgs_py.tables.cells import read_cells

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
