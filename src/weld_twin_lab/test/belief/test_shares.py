# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Intervals of shares, held against cases whose true shares follow from how they were made."""

import json
from pathlib import Path

import numpy as np

from weld_twin_core.diagnosis.levels.causes import covering
from weld_twin_core.diagnosis.result import Cause

CASES = Path(__file__).parents[4] / 'docs' / 'results' / 'belief' / 'cases.jsonl'


def told_and_true():
    """Yield interval and true share of lone causes that were named, frames known."""
    for line in CASES.read_text(encoding='utf-8').splitlines():
        case = json.loads(line)
        truth = case['truth']
        if case['error'] or case['poor'] or truth['align'] or len(truth['ratios']) != 1:
            continue
        # The ratio is that of the cause to the noise, as RMS of the whole deviation.
        square = truth['ratios'][0] ** 2
        for cause in case['verdict']['causes']:
            if [truth['sites'][0]] == [[n['effect'], n['joint']] for n in cause['name']][:1]:
                yield cause['share_ci90'], square / (square + 1.0)


def test_ninety_per_cent_intervals_cover_the_true_share_in_85_to_95_of_100_cases():
    held = []
    for (low, high), true in told_and_true():
        low, high = covering(Cause((), (), (), true, (low, high))).share_ci90
        held.append(low <= true <= high)
    assert len(held) > 60
    assert 0.85 <= np.mean(held) <= 0.95
