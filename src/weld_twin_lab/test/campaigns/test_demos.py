# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the campaign of demos counts, on runs where the answer is known."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from weld_twin_lab.campaigns.demos import fault, summary

RESULTS = Path(__file__).parents[4] / 'docs/results/robustness'
EACH = ('/joint_states', '/measured/tool_pose', '/twin/tool_pose', '/deviation')


def demo(busy=0, **change):
    row = {
        'busy': busy,
        'seconds': 10.0,
        'code': 0,
        'messages': {**dict.fromkeys(EACH, 1209), '/deviation/metrics': 25},
        'incomplete': [],
        'digests': {'deviation.csv': 'a', 'summary.txt': 'b'},
        'headline': 'The gap of 0.3 mm comes from play.',
    }
    return {**row, **change}


def test_runs_that_agree_pass():
    result = summary([demo(), demo(6), demo(), demo(6)], 6)
    assert result['passed']
    assert result['alone']['runs'] == result['crowded']['runs'] == 2
    assert result['headline'] == 'The gap of 0.3 mm comes from play.'


@pytest.mark.parametrize(
    ('bad', 'counted', 'words'),
    [
        ({'code': 2, 'said': 'waited 40 s for the recorder'}, 'failed', 'waited 40 s'),
        ({'incomplete': ["'/joint_states' lacks 3"]}, 'incomplete', 'lacks 3'),
        (
            {'messages': {**dict.fromkeys(EACH, 1209), '/measured/tool_pose': 704}},
            'incomplete',
            'unequal counts',
        ),
        ({'digests': {'deviation.csv': 'z', 'summary.txt': 'b'}}, 'different', 'deviation.csv'),
    ],
)
def test_a_run_that_fails_or_lacks_something_or_differs_is_counted(bad, counted, words):
    rows = [demo(), demo(6, **bad), demo()]
    result = summary(rows, 6)
    assert not result['passed']
    assert result['crowded'][counted] == 1
    assert result['alone'][counted] == 0
    assert words in fault(rows[1], rows[0])


def test_the_kept_runs_are_whole_and_alike():
    kept = json.loads((RESULTS / 'demos.json').read_text())
    assert kept['passed']
    assert summary(kept['demos'], 6) == {
        key: kept[key] for key in ('passed', 'messages', 'headline', 'alone', 'crowded')
    }
    assert kept['alone']['runs'] - kept['crowded']['runs'] in (0, 1)
    assert len({json.dumps(row['digests']) for row in kept['demos']}) == 1
