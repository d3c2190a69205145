# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Intervals of shares, held against cases whose true shares follow from how they were made."""

import re
from pathlib import Path

import numpy as np
import pytest

from weld_twin_lab.belief.rows import read_rows
from weld_twin_lab.belief.share_cover import told_and_true
from weld_twin_nodes.cli import main

CASES = Path(__file__).parents[4] / 'docs' / 'results' / 'belief' / 'cases.jsonl'


def row(share_ci90, ratios, gap):
    sites = [['backlash', f'joint_{k}'] for k in range(len(ratios))]
    name = [{'effect': 'backlash', 'joint': 'joint_0', 'probability': 0.9}]
    return {
        'error': '',
        'poor': False,
        'truth': {'align': [], 'ratios': ratios, 'sites': sites},
        'signs': {'gap': gap},
        'verdict': {'causes': [{'name': name, 'share_ci90': share_ci90}]},
    }


@pytest.mark.parametrize(
    ('interval', 'ratios', 'held'),
    [
        ((0.85, 0.95), [3.0], [True]),
        ((0.5, 0.6), [3.0], [False]),
        ((0.4, 0.5), [3.0, 3.0], [True]),
    ],
)
def test_a_share_is_the_square_of_its_cause_in_the_whole(interval, ratios, held):
    gap = 0.5 * np.log10(sum(r**2 for r in ratios) + 1.0)
    assert [item.held for item in told_and_true([row(interval, ratios, gap)])] == held


def test_causes_that_overlap_have_no_shares_to_be_held():
    assert not list(told_and_true([row((0.4, 0.5), [3.0, 3.0], np.log10(3.0))]))


def test_ninety_per_cent_intervals_cover_the_true_share_in_85_to_95_of_100_cases():
    held = [item.held for item in told_and_true(read_rows(CASES))]
    assert len(held) > 200
    assert 0.85 <= np.mean(held) <= 0.95


def test_the_command_prints_the_table(capsys):
    assert main(['lab', 'shares', str(CASES)]) == 0
    told = capsys.readouterr().out
    assert re.search(r'\| all \| \d+ \| \d+ % \|', told) and '| 1 |' in told
