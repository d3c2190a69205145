# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Targets of joints in RAPID: a list of postures, and no program of moves."""

import re
from pathlib import Path

from ...files.csv_text import is_number
from ..formats import Form, Rank, Read, form

_JOINT_TARGET = re.compile(r'\[\s*\[([^\[\]]*)\]\s*,\s*\[([^\[\]]*)\]\s*\]')
_AXES = 6
"""Axes of an arm, and axes beside it, in a target of RAPID."""
_NO_AXIS = 1e8
"""9E9 stands for an external axis that is not there."""


def is_joint_targets(text: str) -> bool:
    """Return whether a text holds targets of joints in RAPID, and is no program of moves."""
    lines = [line for line in text.splitlines() if line.strip()]
    result = sum(1 for line in lines if _joints(line))
    return result > 0 and ('jointtarget' in text.lower() or 2 * result >= len(lines))


def read_joint_targets(path: Path, text: str, marker: str | None) -> Read:
    """Return the targets of joints in the order in which they stand."""
    result = [
        (k, *axes) for k, line in enumerate(text.splitlines(), start=1) for axes in _joints(line)
    ]
    here = [k for k in range(_AXES) if all(abs(float(ext[k])) < _NO_AXIS for _, _, ext in result)]
    header = [f'rax_{k + 1} [deg]' for k in range(_AXES)] + [f'eax_{"abcdef"[k]}' for k in here]
    rows = [[*arm, *(ext[k] for k in here)] for _, arm, ext in result]
    said = ['read as targets of joints in RAPID, in the order of the file']
    return Read(header, rows, [k for k, _, _ in result], said)


def _joints(line: str) -> list[tuple[list[str], list[str]]]:
    out = []
    for match in _JOINT_TARGET.finditer(line):
        arm, ext = ([cell.strip() for cell in part.split(',')] for part in match.groups())
        if len(arm) == len(ext) == _AXES and all(map(is_number, (*arm, *ext))):
            out.append((arm, ext))
    return out


form(Form('joint targets of ABB', Rank.TARGETS, is_joint_targets, read_joint_targets))
