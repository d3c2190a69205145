# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The command: files it writes, how it fails, a recorded motion, and how fast it is."""

import csv
import json
import re
from contextlib import redirect_stdout
from io import StringIO

import pytest

from weld_twin_nodes.cli import main

SMALL = [
    '--samples',
    '32',
    '--runs',
    '200',
    '--trajectories',
    '2',
    '--placements',
    '2',
    '--points',
    '40',
    '--workers',
    '1',
]


@pytest.fixture(scope='module')
def two_effects(tmp_path_factory):
    """Return the path of a tolerance file."""
    path = tmp_path_factory.mktemp('asked') / 'tolerances.yaml'
    path.write_text('- {effect: joint_offset, std: 3e-4}\n- {effect: link_length, std: 1e-4}\n')
    return str(path)


def test_a_recorded_motion_is_drawn_and_its_bag_says_of_which_robot(tmp_path, capsys):
    effects = tmp_path / 'effects.yaml'
    effects.write_text('- {effect: joint_offset, joint: elbow_joint, offset: 1e-3}\n')
    bag, out = str(tmp_path / 'bag'), tmp_path / 'out'
    words = ['--robot', 'ur5', '--effects', str(effects), '--rate', '50', '--out', bag]
    assert main(['simulate', *words]) == 0
    most = float(re.search(r'max ([\d.]+) mm', capsys.readouterr().out)[1])
    assert main(['sensitivity', bag, '--figure', 'recorded', '--out', str(out)]) == 0
    with (out / 'figures' / 'figure-recorded.csv').open() as file:
        rows = list(csv.DictReader(file))
    assert max(float(row['recorded_m']) for row in rows) == pytest.approx(1e-3 * most, rel=1e-3)


@pytest.fixture(scope='module')
def studied(tmp_path_factory, two_effects):
    """Return the directory of a small study, and what was printed."""
    out = tmp_path_factory.mktemp('study') / 'out'
    words = ['sensitivity', '--robot', 'ur5', '--out', str(out), '--tolerances', two_effects]
    with redirect_stdout(StringIO()) as told:
        assert main([*words, *SMALL]) == 0
    return out, told.getvalue()


@pytest.mark.slow
def test_nothing_hinders_reading_a_study(studied, browser):
    page = (studied[0] / 'sensitivity.html').read_text(encoding='utf-8')
    assert browser.hindrances(page) == []


@pytest.mark.slow
def test_one_command_writes_figures_indices_and_a_page(studied):
    out, told = studied
    assert re.search(r'smooth: \S.* first: from .*° .*gains [\d.]+ mm', told), told
    assert '[' not in told and 'what drives the largest deviation' in told
    for number in range(6, 15):
        assert (out / 'figures' / f'figure-{number:02}.svg').read_text().startswith('<svg')
        head, *rows = (out / 'figures' / f'figure-{number:02}.csv').read_text().splitlines()
        assert ' ' not in head and len(rows) > 19
    result = json.loads((out / 'sensitivity.json').read_text())
    assert set(result['motions']) == {'smooth', 'aggressive'}
    page = (out / 'sensitivity.html').read_text(encoding='utf-8')
    given, *others = (row['expected_m'] for row in result['advice']['placement'])
    assert others and min(others) < given
    for expected in others:
        assert f'{100.0 - 100.0 * expected / given:.1f} %' in page
    assert {row['motion'] for row in csv.DictReader((out / 'indices.csv').open())} == {
        'smooth',
        'aggressive',
    }


def test_one_figure_is_drawn_alone_and_alike_every_time(tmp_path):
    texts = []
    for name in ('a', 'b'):
        out = tmp_path / name
        assert main(['sensitivity', '--robot', 'ur5', '--figure', '12', '--out', str(out)]) == 0
        assert sorted(p.name for p in (out / 'figures').iterdir()) == [
            'figure-12.csv',
            'figure-12.svg',
        ]
        texts.append((out / 'figures' / 'figure-12.svg').read_text())
    assert texts[0] == texts[1]


@pytest.mark.parametrize(
    ('words', 'message'),
    [
        ([], 'give --robot R or a BAG'),
        (['--robot', 'ur5', '--samples', '100'], 'power of two'),
        (['--robot', 'ur5', '--figure', '3'], "no figure is called '3'"),
        (['--robot', 'ur5', '--figure', 'recorded'], 'cannot be drawn of a planned seam'),
        (['--robot', 'ur5', '--across', '0'], 'weld tolerances must be positive'),
        (['--robot', 'ur5', '--points', '1'], 'at least 2 path points'),
        (['--robot', 'ur5', '--tolerances', 'nowhere.yaml'], 'nowhere.yaml'),
    ],
)
def test_a_wrong_question_is_one_line_and_code_two(tmp_path, capsys, words, message):
    assert main(['sensitivity', *words, '--out', str(tmp_path / 'out')]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count('\n') == 1


def test_a_directory_of_something_else_is_left_alone(tmp_path, capsys):
    (tmp_path / 'thesis.tex').write_text('')
    assert main(['sensitivity', '--robot', 'ur5', '--out', str(tmp_path)]) == 2
    assert 'holds something else' in capsys.readouterr().err
    assert [p.name for p in tmp_path.iterdir()] == ['thesis.tex']
