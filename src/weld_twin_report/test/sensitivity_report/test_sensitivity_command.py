# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The command: files it writes, how it fails, a recorded motion, and how fast it is."""

import csv
import json
import re

import pytest
from command_line import done, refused

SMALL = ('--samples', 32, '--runs', 200, '--trajectories', 2, '--placements', 2, '--points', 40)


def test_a_recorded_motion_is_drawn_and_its_bag_says_of_which_robot(tmp_path):
    effects, bag, out = tmp_path / 'effects.yaml', tmp_path / 'bag', tmp_path / 'out'
    effects.write_text('- {effect: joint_offset, joint: elbow_joint, offset: 1e-3}\n')
    words = ('--robot', 'ur5', '--effects', effects, '--rate', 50, '--out', bag)
    most = float(re.search(r'max ([\d.]+) mm', done('simulate', *words))[1])
    done('sensitivity', bag, '--figure', 'recorded', '--out', out)
    with (out / 'figures' / 'figure-recorded.csv').open() as file:
        rows = list(csv.DictReader(file))
    assert max(float(row['recorded_m']) for row in rows) == pytest.approx(1e-3 * most, rel=1e-3)


@pytest.fixture(scope='module')
def studied(tmp_path_factory):
    """Return the directory of a small study of two effects, and what was printed."""
    place = tmp_path_factory.mktemp('study')
    asked, out = place / 'tolerances.yaml', place / 'out'
    asked.write_text('- {effect: joint_offset, std: 3e-4}\n- {effect: link_length, std: 1e-4}\n')
    words = ('--robot', 'ur5', '--tolerances', asked, *SMALL, '--workers', 1)
    return out, done('sensitivity', *words, '--out', out)


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
    rows = csv.DictReader((out / 'indices.csv').open())
    assert {row['motion'] for row in rows} == {'smooth', 'aggressive'}


def test_one_figure_is_drawn_alone_and_alike_every_time(tmp_path):
    texts = []
    for name in ('a', 'b'):
        out = tmp_path / name
        done('sensitivity', '--robot', 'ur5', '--figure', '12', '--out', out)
        names = sorted(p.name for p in (out / 'figures').iterdir())
        assert names == ['figure-12.csv', 'figure-12.svg']
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
def test_a_wrong_question_is_one_line_and_code_two(tmp_path, words, message):
    assert message in refused('sensitivity', *words, '--out', tmp_path / 'out')


def test_a_directory_of_something_else_is_left_alone(tmp_path):
    (tmp_path / 'thesis.tex').write_text('')
    said = refused('sensitivity', '--robot', 'ur5', '--out', tmp_path)
    assert 'holds something else' in said
    assert [p.name for p in tmp_path.iterdir()] == ['thesis.tex']
