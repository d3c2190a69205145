# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""All splits one after the other, each kept as soon as it is done."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from ..study import Parts
from .judging import judge
from .servo_axis import judge_axis
from .splits import all_splits

NAME, PARTS = 'transfer', 'splits'


def entries_of(ur5: Path, ur10: Path, emps: Path, only: str, part: Parts) -> list[dict[str, Any]]:
    """
    Return what came of every split.

    ur5, ur10, emps: directories with the published data.
    only: part of the names of the splits to run; all when empty.
    part: keeps every split.

    Raises DataError: data are missing.
    """
    chosen = [split for split in all_splits(ur5, ur10) if only in split.name]
    entries = [part(split.name, partial(judge, split)) for split in chosen]
    if only in 'servo_axis':
        entries.append(part('servo_axis', partial(judge_axis, emps)))
    return entries
