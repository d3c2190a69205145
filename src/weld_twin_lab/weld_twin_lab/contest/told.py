# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of a contest: both tables, and where other methods are better than the diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from weld_twin_core.arrays import Array

from .arms import Errors, arm_table
from .course import Run
from .scores import Sealed, point

OWN = 'weld_twin'
"""The diagnosis, which all others are held against."""
SCALE = ('zero_offset', 'never_knows')
"""Methods that always say the same: they mark the scale, and are better than nobody."""
CLEARLY = 0.9
"""Part of the error of the diagnosis below which another prediction is told as better; nearer than
that are ties, and they would fill the page."""
MEASURES: dict[str, tuple[str, int, str, float]] = {
    'detected': ('detected', 1, '{:.0f} %', 100.0),
    'false_alarm': ('false alarms', -1, '{:.0f} %', 100.0),
    'family': ('family', 1, '{:.0f} %', 100.0),
    'joint': ('joint', 1, '{:.0f} %', 100.0),
    'belief': ('belief', 1, '{:.2f}', 1.0),
    'sure_wrong': ('sure and wrong', -1, '{:.1f} %', 100.0),
    'left': ('gap left', -1, '{:.2f}', 1.0),
    'over_floor': ('over the floor', -1, '{:.2f}', 1.0),
    'worse_than_nominal': ('cases worse than nominal', -1, '{:.0f}', 1.0),
    'seconds': ('processor time', -1, '{:.1f} s', 1.0),
    'memory_bytes': ('memory', -1, '{:.0f} MB', 1e-6),
}
"""Of what a method is worth: its name, whether more (1) or less (-1) is better, and how it is told:
its form, and the unit in which."""


def closer(
    runs: Mapping[str, Mapping[str, Run]], cases: Mapping[str, Sealed]
) -> dict[str, list[str]]:
    """
    Return the sealed cases whose motion a method predicts clearly better than the diagnosis.

    Parameters
    ----------
    runs : mapping of method to mapping of case to Run
    cases : mapping of case to Sealed

    Returns
    -------
    dict of str to list of str
        Names of cases by method; empty without the diagnosis.

    """
    left = {
        method: {
            name: point(run.answer, cases[name]).left
            for name, run in said.items()
            if run.answer is not None
        }
        for method, said in runs.items()
    }
    own = left.get(OWN, {})
    return {
        method: [name for name, gap in gaps.items() if name in own and gap < CLEARLY * own[name]]
        for method, gaps in left.items()
        if method not in (OWN, *SCALE) and own
    }


def page(
    table: str,
    methods: Mapping[str, Mapping[str, Any]],
    near: Mapping[str, list[str]],
    errors: Errors,
    measured: Mapping[str, Array],
) -> str:
    """
    Return the page in Markdown.

    Parameters
    ----------
    table : str
        All methods on the sealed cases, as `scores.page` gives it.
    methods : mapping of method to mapping
        As `scores.summary` gives them.
    near : mapping of method to list of str
        As `closer` gives them.
    errors : mapping
        On the measured arms, as `arms.lefts` gives them; empty where these were not asked.
    measured : mapping of case to array, shape (M, 3) [m]
        What was measured there.

    """
    parts = [f'## On sealed cases\n\n{table}']
    if errors:
        parts.append(_on_arms(errors, measured))
    if OWN not in methods:
        return '\n'.join(parts)
    told = [*_by_measure(methods), *_by_case(near, methods), *_by_arm(errors)]
    lines = '\n'.join(f'- {line}' for line in told) or '- Nowhere.'
    parts.append(
        f'## Where others are better\n\nHeld against `{OWN}`; those that always say the same are '
        f'left out.\n\n{lines}\n'
    )
    return '\n'.join(parts)


def _on_arms(errors: Errors, measured: Mapping[str, Array]) -> str:
    asked = ', '.join(f'{name} {len(rows)}' for name, rows in measured.items())
    return (
        '## On two measured arms\n\nMean error [mm] on the stations asked for; the least on every '
        'split is bold. `n30` is thirty stations, `wrist_10deg` and `octant_0` are narrow regions '
        f'asked about outside of them, `odd` is every second station.\n\n'
        f'{arm_table(errors, list(measured))}\nStations asked for: {asked}.\n'
    )


def _by_measure(methods: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return a sentence for each measure by which somebody is better."""
    own, out = methods.get(OWN, {}), []
    for key, (words, sign, form, unit) in MEASURES.items():
        mine = own.get(key)
        if mine is None:  # the question does not arise in these cases
            continue
        ahead = [
            f'`{name}` {form.format(found[key] * unit)}'
            for name, found in _rivals(methods).items()
            if found[key] is not None and sign * (found[key] - mine) > 0.0
        ]
        if ahead:
            out.append(f'{words}: {", ".join(ahead)}; `{OWN}` {form.format(mine * unit)}.')
    return out


def _by_case(near: Mapping[str, list[str]], methods: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return a sentence for each method that predicts motions of some cases better."""
    count = methods.get(OWN, {}).get('cases', 0)
    return [
        f'`{method}` leaves less than {CLEARLY:.1f} of the gap on {len(names)} of {count} cases: '
        f'{", ".join(names)}.'
        for method, names in near.items()
        if names
    ]


def _by_arm(errors: Errors) -> list[str]:
    """Return a sentence for each split of a measured arm that somebody predicts better."""
    out = []
    for name, mine in errors.get(OWN, {}).items():
        ahead = [
            f'`{method}` {1e3 * found[name]:.3f} mm'
            for method, found in _rivals(errors).items()
            if name in found and found[name] < CLEARLY * mine
        ]
        if ahead:
            out.append(f'{name}: {", ".join(ahead)}; `{OWN}` {1e3 * mine:.3f} mm.')
    return out


def _rivals(found: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in found.items() if name not in (OWN, *SCALE)}
