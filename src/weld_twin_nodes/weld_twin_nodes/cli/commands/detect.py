# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Find a board in images, and write the table that `import` reads."""

from pathlib import Path

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.csv_text import csv_text
from weld_twin_msgs_py.tables.cameras import read_board
from weld_twin_msgs_py.tables.cells import read_cells

from ...offline.board_detection import detector
from ..given import Given

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
        for label, (u, v) in zip(labels, where.tolist(), strict=True):
            rows.append((path.name, given.camera, label, f'{u:.4f}', f'{v:.4f}', *own))
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
