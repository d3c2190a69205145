# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Years whose every check is simulated by the plant, written as a bag and diagnosed by the command."""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_report.history import Entry, observations
from weld_twin_report.history.words import likely, named

from .life import Year, cause, moved, year
from .scoring import WEEK, score
from .yearly_cell import Cause, diagnosed, draw, set_up

FIRST = datetime(2026, 1, 5, tzinfo=timezone.utc)
"""Monday of week 0."""
CHECKS = 2
"""Sets of stations of a cell."""


def base(seed: int, number: int, check: int) -> dict[str, Any]:
    """Return the entry of one check of a cell on its first day."""
    rng = np.random.default_rng([seed, number, check])
    yearly = draw(seed, number)
    causes = [*yearly.as_built, set_up(rng)]
    drawn = int(rng.integers(2**31))
    with tempfile.TemporaryDirectory(prefix='years-') as place:
        entry = diagnosed(yearly, causes, check, drawn, Path(place) / 'check', FIRST)
    return entry.plain()


def lived(seed: int, number: int, first: Mapping[str, Any]) -> Year:
    """Return what happens on a cell in the year that is diagnosed in full."""
    return year(Entry.of_plain(first), np.random.default_rng([seed, 2_000_000 + number]))


def check(seed: int, number: int, week: int, set_up_number: int, first: Mapping[str, Any]) -> Any:
    """Return the entry of one week's check."""
    yearly = draw(seed, number)
    off = moved(lived(seed, number, first).events, week)
    stands = set_up(np.random.default_rng([seed, number, 3, set_up_number]))
    causes = [*_together([*yearly.as_built, *(cause(n, v) for n, v in off.items())]), stands]
    drawn = int(np.random.default_rng([seed, number, 4, week]).integers(2**31))
    at = FIRST + timedelta(weeks=week)
    with tempfile.TemporaryDirectory(prefix='years-') as place:
        stations = set_up_number % CHECKS
        entry = diagnosed(yearly, causes, stations, drawn, Path(place) / 'check', at)
    return entry.plain()


def _together(causes: Sequence[Cause]) -> list[Cause]:
    """Return flaws with those of one kind at one place added up."""
    out: dict[tuple[str, str | None], Cause] = {}
    for each in causes:
        key = str(each['effect']), each.get('joint')
        before = out.get(key)
        if before is None:
            out[key] = dict(each)
            continue
        for name, value in each.items():
            if isinstance(value, float):
                before[name] += value
            elif isinstance(value, list):
                before[name] = [a + b for a, b in zip(before[name], value, strict=True)]
    return list(out.values())


def scored(
    seed: int, number: int, first: Mapping[str, Any], kept: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    """Return what the weekly looks at a year of diagnoses came to."""
    entries = [Entry.of_plain(each) for each in kept]
    start = FIRST.timestamp() / 86_400.0
    seen = [replace(o, day=o.day - start) for o in observations(entries)]
    yearly = draw(seed, number)
    truth = {
        f'{each["effect"]} {each["joint"]} 0': float(
            next(v for k, v in each.items() if k not in ('effect', 'joint'))
        )
        for each in yearly.as_built
    }
    joints = yearly.cell.robot.joint_names
    scores = score(
        seen, lived(seed, number, first), named(entries), likely(entries), joints, truth
    )
    status = dict(Counter(each.status for each in entries))
    return {**scores, 'status': status, 'weeks': len(entries), 'unit': WEEK}
