# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Years whose diagnoses are drawn: how sure each is comes from real diagnoses, the values are drawn.

Two checks of every cell are simulated by the plant and diagnosed by the command. Each week's values
are then what such a diagnosis says of the arm as it is that week, its noise drawn anew. So two
hundred years cost as much as two dozen diagnoses; what a diagnosis gets wrong of itself is in the
years that are diagnosed in full.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.history import Observation
from weld_twin_report.history import Entry, observations
from weld_twin_report.history.words import likely, named

from .life import Year, moved, year
from .scoring import WEEK, score


def cheap_year(seed: int, number: int, bases: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """
    Return what a year of weekly looks came to.

    seed, number: of the year; the same numbers give the same year.
    bases: entries of the cell's checks.
    """
    rng = np.random.default_rng([seed, 1_000_000 + number])
    checks = _common([Entry.of_plain(base) for base in bases])
    lived = year(checks[0], rng)
    # What the first check leaves open, the arm may have: its values are drawn from what it says.
    arm = rng.multivariate_normal(checks[0].value, checks[0].covariance, method='eigh')
    truth = dict(zip(checks[0].names, map(float, arm), strict=True))
    seen = drawn(checks, lived, truth, rng)
    return score(seen, lived, named(checks), likely(checks), _joints(checks[0]), truth)


def _common(entries: Sequence[Entry]) -> list[Entry]:
    """Return entries with only the coordinates that all have, in the same order."""
    names = [n for n in entries[0].names if all(n in each.names for each in entries)]
    out = []
    for each in entries:
        at = [each.names.index(name) for name in names]
        out.append(
            replace(
                each,
                names=tuple(names),
                value=each.value[at],
                prior_std=each.prior_std[at],
                covariance=each.covariance[np.ix_(at, at)],
            )
        )
    return out


def drawn(
    checks: Sequence[Entry], lived: Year, truth: Mapping[str, float], rng: np.random.Generator
) -> list[Observation]:
    """Return the observations of a year: the arm as it is each week, seen through a check."""
    seen = observations(checks)
    shown = [each.information()[0] for each in seen]
    roots = [_root(each) for each in shown]
    out = []
    for week, set_up in zip(lived.weeks, lived.set_ups, strict=True):
        k = set_up % len(checks)
        check = seen[k]
        off = moved(lived.events, week)
        theta = np.array([truth[name] + off.get(name, 0.0) for name in check.names])
        information = shown[k] @ theta + roots[k] @ rng.normal(size=theta.size)
        value = check.covariance @ information
        out.append(replace(check, day=WEEK * week, value=value))
    return out


def _root(precision: Array) -> Array:
    known, axes = np.linalg.eigh(precision)
    return np.asarray(axes * np.sqrt(np.maximum(known, 0.0)))


def _joints(check: Entry) -> list[str]:
    """Return the arm's joints in their order."""
    family = 'joint_offset '
    return [name.split(' ')[1] for name in check.names if name.startswith(family)]
