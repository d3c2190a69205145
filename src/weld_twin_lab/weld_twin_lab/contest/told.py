# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of a contest: both tables."""

from __future__ import annotations

from collections.abc import Mapping

from weld_twin_core.arrays import Array

from .arms import Errors, arm_table


def page(table: str, errors: Errors, measured: Mapping[str, Array]) -> str:
    """
    Return the page in Markdown.

    table: all methods on the sealed cases, as `scores.page` gives it.
    errors: on the measured arms, as `arms.lefts` gives them; empty where these were not asked.
    measured: what was measured there, shape (M, 3) [m].
    """
    parts = [f'## On sealed cases\n\n{table}']
    if errors:
        parts.append(_on_arms(errors, measured))
    return '\n'.join(parts)


def _on_arms(errors: Errors, measured: Mapping[str, Array]) -> str:
    asked = ', '.join(f'{name} {len(rows)}' for name, rows in measured.items())
    return (
        '## On two measured arms\n\nMean error [mm] on the stations asked for; the least on every '
        'split is bold. `n30` is thirty stations, `wrist_10deg` and `octant_0` are narrow regions '
        f'asked about outside of them, `odd` is every second station.\n\n'
        f'{arm_table(errors, list(measured))}\nStations asked for: {asked}.\n'
    )
