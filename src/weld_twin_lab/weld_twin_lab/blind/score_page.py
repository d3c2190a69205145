# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The score of a blind check as Markdown."""

from __future__ import annotations

from weld_twin_msgs_py.files import markdown

from .measures import measure_table
from .scoring import Score

MISSED = ('case', 'kind', 'truth (RMS over noise)', 'verdict', 'confidence', 'why there is none')


def page(score: Score) -> str:
    """Return measures, cases that were missed, and what a diagnosis costs."""
    made, costs = score.made, score.costs
    seen = 'could be read' if made['truths_readable'] else 'could not be read'
    missed = [
        (
            case.name,
            f'{case.kind}, {case.robot}, {case.motion}',
            f'{case.truth} ({case.stratum:.1f})',
            f'{case.status}: {case.said or "-"}',
            f'{case.confidence:.2f}',
            score.errors.get(case.name, ''),
        )
        for case in score.cases
        if not case.right
    ]
    return '\n'.join(
        [
            f'# {len(score.cases) - len(missed)} of {len(score.cases)} cases answered rightly\n',
            f'Seed {made["seed"]}, seal {made["seal"]}, engine {made["engine"][:16]} of version '
            f'{made["version"]}. Truths {seen} from where the cases were diagnosed.\n',
            measure_table([measure.as_dict() for measure in score.measures]),
            f'A diagnosis took {costs["median_seconds"]:.1f} s in the median, '
            f'{costs["most_seconds"]:.1f} s at most, and {costs["most_memory_mib"]:.0f} MiB.\n',
            *([markdown.table(MISSED, *missed)] if missed else []),
        ]
    )
