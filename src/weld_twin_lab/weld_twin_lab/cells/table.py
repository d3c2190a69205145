# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What came of whole cells and of pixels, as a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from weld_twin_msgs_py.files import markdown

CellResult = Mapping[str, Any]
AS_TRACKED = 0.8
"""Goal: share of the causes named beside a tracker that pixels name, too."""


def page(
    cases: Sequence[CellResult], pixels: Sequence[CellResult], real: Sequence[CellResult]
) -> str:
    """Return the page of sealed cells, of cases beside a camera, and of a real arm's pixels."""
    lines = ['# Whole cells, and cameras', '']
    if cases:
        lines += ['One cause of 3 to 8 noises, told with the frames of base and tool fitted:', '']
        lines += [_cells(cases), '']
    if pixels:
        lines += ['The same stations told from pixels of two cameras, and from a tracker:', '']
        lines += [_beside(pixels), '']
    if real:
        lines += ['A real arm told from pixels alone, and judged by a tracker [mm RMS]:', '']
        lines += [_real(real), '']
    return '\n'.join(lines)


def named_as_tracked(pixels: Sequence[CellResult]) -> float:
    """Return the share of causes named beside a tracker that pixels name, too."""
    both = [one['pixels']['named'] for one in pixels if one['tracker']['named']]
    return float(np.mean(both)) if both else 1.0


def _cells(cases: Sequence[CellResult]) -> str:
    rows = []
    for kind in dict.fromkeys(case['kind'] for case in cases):
        own = [case for case in cases if case['kind'] == kind]
        rows.append((kind, *_counts(own)))
    return markdown.table(
        ('cell', 'cases', 'named', 'nothing else', 'sure', 'sure and wrong'), *rows
    )


def _beside(pixels: Sequence[CellResult]) -> str:
    rows = [(way, *_counts([one[way] for one in pixels])) for way in ('tracker', 'pixels')]
    head = ('told from', 'cases', 'named', 'nothing else', 'sure', 'sure and wrong')
    share = f'Of what the tracker names, pixels name {100.0 * named_as_tracked(pixels):.0f} %.'
    return f'{markdown.table(head, *rows)}\n{share}'


def _counts(cases: Sequence[CellResult]) -> tuple[str, ...]:
    wrong = sum(one['sure'] and not one['right'] for one in cases)
    each = (sum(bool(one[key]) for one in cases) for key in ('named', 'right', 'sure'))
    return str(len(cases)), *map(str, each), str(wrong)


def _real(real: Sequence[CellResult]) -> str:
    keys = ('frames', 'pixels', 'tracker')
    rows = [(str(k + 1), *(f'{fold[key]:.3f}' for key in keys)) for k, fold in enumerate(real)]
    means = [float(np.mean([fold[key] for fold in real])) for key in keys]
    rows.append(('mean', *(f'{mean:.3f}' for mean in means)))
    rows.append(('over frames', *(f'{mean / means[0]:.2f}' for mean in means)))
    head = ('part', 'frames alone', 'told from pixels', 'told from the tracker itself')
    return markdown.table(head, *rows)
