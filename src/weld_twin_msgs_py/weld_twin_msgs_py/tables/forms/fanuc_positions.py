# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Current positions of a FANUC controller, ``MD:CURPOS.DG``, one after the other in a file.

The controller makes it by FTP or web page. Where it takes its own tool to be is no measurement.
"""

import re
from pathlib import Path

from weld_twin_core.errors import DataError

from ..formats import Form, Rank, Read, form

_MARK = re.compile(r'^CURRENT JOINT POSITION', re.MULTILINE)
_GROUP = re.compile(r'^Group #:\s*(\d+)', re.MULTILINE)
_JOINT = re.compile(r'^Joint\s+(\d+):\s*(-?\d*\.?\d+)', re.MULTILINE)
_FIRST_LINES = 8000
"""Characters at the top by which such a file is recognised: a page of the controller has a heading."""
_ARM = '1'
"""Group of motion that is the arm; others are positioners and tables."""


def is_positions(text: str) -> bool:
    """Return whether a text holds current positions of a FANUC controller."""
    return bool(_MARK.search(text[:_FIRST_LINES]) and _JOINT.search(text[:_FIRST_LINES]))


def read_positions(path: Path, text: str, marker: str | None) -> Read:
    """Return the joints of the arm, a row for each time that they were fetched."""
    rows, lines = list[list[str]](), list[int]()
    starts = [result.start() for result in _MARK.finditer(text)]
    for start, end in zip(starts, [*starts[1:], len(text)], strict=True):
        groups = _GROUP.findall(text[:start])
        if groups and groups[-1] != _ARM:
            continue
        result = dict(_JOINT.findall(text[start:end]))
        rows.append([result[number] for number in sorted(result, key=int)])
        lines.append(text.count('\n', 0, start) + 1)
    if len({len(row) for row in rows}) != 1:
        raise DataError(
            f"'{path}' holds positions of {' and '.join(sorted({str(len(r)) for r in rows}))} "
            'joints; copy files of one arm into it'
        )
    said = ['read as current positions of FANUC (CURPOS.DG), joints to 0.01 deg']
    return Read([f'J{k} [deg]' for k in range(1, len(rows[0]) + 1)], rows, lines, said)


form(Form('current positions of FANUC', Rank.MARK, is_positions, read_positions))
