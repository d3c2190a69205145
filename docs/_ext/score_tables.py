# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""``{blind-score} FILE``: a score of the blind check as tables, from the JSON that is kept."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.parsers.rst import Directive
from page_table import page_table
from sphinx.application import Sphinx

COUNTED = {'z_spread', 'over_floor', 'brier', 'ece', 'ece_library'}
"""Measures told as numbers; the others are shares."""


class BlindScore(Directive):
    """Measures of a blind check with their intervals, and the cases that were missed."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return two tables."""
        env = self.state.document.settings.env
        path = Path(env.srcdir, env.docname).parent / self.arguments[0]
        env.note_dependency(str(path))
        score = json.loads(path.read_text(encoding='utf-8'))
        missed = [case for case in score['cases'] if not case['right']]
        return [
            page_table(
                ('measure', 'got', '95 % interval', 'of', 'wanted'),
                [
                    _measure(row)
                    for row in score['measures']
                    if row['estimate']['value'] is not None
                ],
            ),
            nodes.paragraph(text=f'The {len(missed)} cases of {score["count"]} that were missed:'),
            page_table(
                ('case', 'robot', 'motion', 'truth', 'said', 'sure', 'why'),
                [_case(case, score['reasons']) for case in missed],
            ),
        ]


def _measure(row: dict[str, Any]) -> tuple[str, ...]:
    found = row['estimate']
    as_number = row['key'] in COUNTED or row['key'].startswith('shrink_off')
    value, low, high = (
        f'{found[k]:.3f}' if as_number else f'{found[k]:.1%}' for k in ('value', 'low', 'high')
    )
    goal = ''
    if row['goal'] is not None:
        goal = f'{row["goal"]:g}' if as_number else f'{row["goal"]:.0%}'
        goal = f'{"at least" if row["at_least"] else "at most"} {goal}'
    return row['title'], value, f'{low} to {high}', str(found['cases']), goal


def _case(case: dict[str, Any], reasons: dict[str, str]) -> tuple[str, ...]:
    said = case['said'] or case['status']
    return (
        case['name'],
        case['robot'],
        case['motion'],
        case['truth'] or 'no cause',
        said,
        f'{case["confidence"]:.2f}',
        reasons.get(case['name'], ''),
    )


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the directive."""
    app.add_directive('blind-score', BlindScore)
    return {'parallel_read_safe': True}
