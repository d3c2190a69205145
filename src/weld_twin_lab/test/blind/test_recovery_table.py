# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The recovery table over cases written by hand, and one case made, diagnosed and judged."""

from __future__ import annotations

import json

import pytest
from blind_verdicts import diagnosis, offset, truth

from weld_twin_lab.blind.judging import judge
from weld_twin_lab.blind.recovery_table import MARKS, mark, summary, table

A, B, C = ('joint_offset', 'a'), ('joint_offset', 'b'), ('gear_ratio', 'a')
MADE = {'seed': 1, 'motion': 'free', 'engine': 'e' * 64, 'version': '0'}


def row(verdict, size=3.0, arm='ur5', error=None):
    judged = judge(truth('single', [offset('a')], ratios=[size]), verdict)
    return {
        'family': 'joint_offset',
        'arm': arm,
        'size': size,
        'motion': 'free',
        'not_shown': None,
        'judged': judged.as_dict(),
        'shrink': None,
        'error': error,
        'seconds': 2.0,
        'processor_seconds': 1.0,
    }


def absent(size=10.0):
    return {
        'family': 'vibration',
        'arm': 'ur5',
        'size': size,
        'motion': 'free',
        'not_shown': 'too stiff',
    }


@pytest.mark.parametrize(
    ('verdict', 'name'),
    [
        (diagnosis('identified', [A]), 'exact'),
        (diagnosis('ambiguous', [A, C]), 'exact'),
        (diagnosis('identified', [A], [C]), 'more'),
        (diagnosis('identified', [B]), 'joint'),
        (diagnosis('identified', [C]), 'wrong'),
        (diagnosis('unknown'), 'unknown'),
        (diagnosis('none'), 'none'),
    ],
)
def test_a_mark_says_what_became_of_a_case(verdict, name):
    assert mark(row(verdict)) == name


def test_what_cannot_be_shown_or_fails_has_a_mark_of_its_own():
    assert mark(absent()) == 'not shown'
    assert mark(row(None, error='ValueError: x')) == 'error'


def test_shares_count_shown_cases_only():
    rows = [
        row(diagnosis('identified', [A])),
        row(diagnosis('identified', [B])),
        row(diagnosis('identified', [C]), arm='panda'),
        absent(),
    ]
    sums = summary(rows)
    assert sums['all']['cases'] == 3
    assert sums['all']['family']['value'] == pytest.approx(2 / 3)
    assert sums['all']['joint']['value'] == pytest.approx(2 / 3)
    assert sums['all']['exact']['value'] == pytest.approx(1 / 3)
    assert sums['arm']['panda']['family']['value'] == 0.0
    assert sums['all']['confidently_wrong'] == 2


def test_the_table_has_a_row_for_a_family_and_names_what_was_missed():
    rows = [row(diagnosis('identified', [A]), 1.0), row(diagnosis('none'), 3.0)]
    text = table(rows, MADE)
    assert f'| joint_offset | `{MARKS["exact"]}{MARKS["none"]}` | 1 of 2 | 1 of 2 |' in text
    assert '1 cases whose cause is not named' in text
    widths = {line.count('|') for line in text.splitlines() if line.startswith('| joint_offset')}
    assert len(widths) == 1


def test_a_cause_is_recovered_from_the_command_line(tmp_path, weld_twin):
    pytest.importorskip('mujoco')
    words = (
        'blind',
        'recovery',
        '--seed',
        '3',
        '--families',
        'drift',
        '--robots',
        'ur5',
        '--sizes',
        '10',
        '--motion',
        'stations',
        '--workers',
        '1',
        '--out',
        tmp_path,
    )
    first = weld_twin(*words)
    assert first.code == 0
    content = json.loads((tmp_path / 'recovery.json').read_text())
    (case,) = content['cases']
    assert case['judged']['said'] == 'drift'
    assert case['ratio'] == pytest.approx(10.0, rel=0.15)
    assert case['shrink']['ratio'] < 0.3
    assert (tmp_path / 'recovery.md').read_text() == first.out
    kept = [file.stat().st_mtime_ns for file in (tmp_path / 'done').iterdir()]
    assert weld_twin(*words).out == first.out
    assert [file.stat().st_mtime_ns for file in (tmp_path / 'done').iterdir()] == kept


def test_an_unknown_family_is_refused_by_name(tmp_path, weld_twin):
    pytest.importorskip('mujoco')
    result = weld_twin('blind', 'recovery', '--seed', '3', '--families', 'rust', '--out', tmp_path)
    assert result.code == 2
    assert 'rust' in result.err
