# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Experiments and seams as programs: read by another reader, they lead where they are to lead."""

import re

import numpy as np
import pytest
import yaml
from command_line import done, refused

import weld_twin_core as wt
from weld_twin_lab.programs import plain as readers
from weld_twin_lab.programs.plain import joints_for, tool_pose

CELLS = {
    'krl': ('kuka_kr16_2', 'src', readers.krl, 1e-7),
    'rapid': ('abb_irb1600', 'mod', readers.rapid, 1e-7),
    'urscript': ('ur5', 'script', readers.urscript, 1e-7),
    'inform': ('yaskawa_ma1440', 'jbi', readers.inform, 1.3e-5),
    'fanuc-ls': ('fanuc_m10ia', 'ls', readers.fanuc, 2e-5),
    'joint-trajectory': ('ur5', 'yaml', readers.trajectory, 1e-9),
    'csv': ('ur5', 'csv', readers.table, 1e-9),
}
PULSES = ('--pulses-per-degree', '1000,-1200,1100,900,-800,700')


def exported(language, path, tmp_path, *more, name='measure'):
    robot, suffix, reader, rounding = CELLS[language]
    out = tmp_path / f'{name}.{suffix}'
    words = ('export', 'program', path, '--robot', robot, '--controller', language)
    done(*words, *(PULSES if language == 'inform' else ()), *more, '--out', out)
    text = out.read_bytes().decode('latin-1')
    moves = reader([text, ''] if language == 'krl' else [text])
    return wt.load(robot), text, [places[-1] for _, places in moves], rounding


def stations(robot, tmp_path):
    middle = 0.5 * (np.maximum(robot.lower, -2.0) + np.minimum(robot.upper, 2.0))
    q = middle + np.random.default_rng(3).uniform(-0.4, 0.4, (5, 6)).round(6)
    return write_stations(tmp_path / 'next_experiment.yaml', q), q


def write_stations(path, q):
    content = {'kind': 'joints', 'stations': True, 't': [0.0, 9.0, 18.0, 27.0, 36.0]}
    path.write_text(yaml.safe_dump({**content, 'q': q.tolist()}))
    return path


@pytest.mark.parametrize('language', CELLS)
def test_every_station_is_reached_and_the_instrument_told(language, tmp_path, kept):
    robot = wt.load(CELLS[language][0])
    path, q = stations(robot, tmp_path)
    _, text, places, rounding = exported(language, path, tmp_path, '--trigger', 7)
    if language == 'joint-trajectory':  # a stay is two points
        places = places[::2]
    np.testing.assert_allclose(places, q, atol=rounding)
    triggers = re.findall(
        r'set_digital_out\(7, True\)|\$OUT\[7\] = TRUE|doTracker7, 1|OT#\(7\) ON|DO\[7\]=ON', text
    )
    assert len(triggers) == (0 if language in ('joint-trajectory', 'csv') else 5)
    notes = (tmp_path / f'measure.{CELLS[language][1]}.md').read_text(encoding='utf-8')
    kept(f'stations_{language}', f'{text}\n{notes}'.replace(str(tmp_path), ''))


@pytest.mark.parametrize('language', CELLS)
def test_a_seam_is_followed_by_straight_pieces_to_a_twentieth_of_a_millimetre(
    language, tmp_path, kept
):
    robot, text, places, _ = exported(language, 'arc', tmp_path)
    lines = text.splitlines()
    kept(f'seam_{language}', '\n'.join([*lines[:25], '...', *lines[-8:]]) + '\n')
    tool = robot.T_flange_tool
    poses = [tool_pose(robot, p, tool) if p.ndim == 1 else p for p in places]
    points = np.array([pose[:3, 3] for pose in poses])
    seam = wt.default_seam(robot, 'arc')
    wanted = seam.sample(np.linspace(0.0, seam.length, 401)).position
    starts, ways = points[:-1], np.diff(points, axis=0)
    size = np.maximum((ways**2).sum(axis=1), 1e-18)
    along = ((wanted[:, None] - starts) * ways).sum(axis=2) / size
    nearest = starts + np.clip(along, 0.0, 1.0)[..., None] * ways
    off = np.linalg.norm(wanted[:, None] - nearest, axis=2).min(axis=1)
    assert off.max() < 8e-5
    assert len(points) < 100


@pytest.mark.parametrize('language', CELLS)
def test_a_name_is_a_comment_and_no_statement(language, tmp_path):
    name = 'a\nDO[1]=ON ;x.yaml'
    path, _ = stations(wt.load(CELLS[language][0]), tmp_path)
    _, text, _, _ = exported(language, path.rename(tmp_path / name), tmp_path)
    assert not re.search(r'^\W*DO\[1\]', text.replace(';', '\n'), re.M)


@pytest.mark.parametrize('language', CELLS)
def test_a_program_has_the_letters_that_controllers_have(language, tmp_path):
    path, _ = stations(wt.load(CELLS[language][0]), tmp_path)
    _, text, _, _ = exported(language, path, tmp_path, name='Prüfung 日本')
    assert text.isascii()


def test_names_that_would_end_a_line_are_refused(tmp_path):
    content = wt.load('ur5').to_mapping() | {'name': 'a\n$OUT[1]=TRUE'}
    (tmp_path / 'robot.yaml').write_text(yaml.safe_dump(content))
    words = ('--robot', tmp_path / 'robot.yaml', '--controller', 'urscript')
    said = refused('export', 'program', 'line', *words, '--out', tmp_path / 'p.script')
    assert 'control character' in said
    assert not (tmp_path / 'p.script').exists()


def test_the_first_run_is_slow_and_a_later_one_within_its_cap(tmp_path):
    def fastest(*more):
        _, text, _, _ = exported('krl', 'line', tmp_path, *more)
        (tmp_path / 'measure.src').unlink()
        return [
            max(map(float, re.findall(p, text))) for p in (r'VEL_PTP,([\d.]+)', r'CP = ([\d.]+)')
        ]

    assert fastest('--speed', '0.5m/s') == [10.0, 0.05]
    assert fastest('--speed', '100mm/s', '--full-speed') == [50.0, 0.1]
    assert fastest('--speed', '0.5m/s', '--full-speed')[1] == 0.25


def test_the_controller_comes_to_the_posture_that_was_meant(tmp_path):
    robot, _, places, _ = exported('urscript', 'line', tmp_path)
    q = places[0]
    for pose in places[1:]:
        q = joints_for(robot, pose, robot.T_flange_tool, q)
    plan = wt.plan(robot, wt.default_seam(robot, 'line'))
    np.testing.assert_allclose(q, plan.motion.q[-1], atol=1e-5)


@pytest.mark.parametrize(
    ('words', 'what'),
    [
        (('--controller', 'plc'), 'no language'),
        (('--controller', 'inform'), '--pulses-per-degree'),
        (('--controller', 'krl', '--dwell', '-1'), '--dwell'),
        (('--controller', 'krl', '--speed', 'fast'), '--speed'),
    ],
)
def test_what_cannot_be_written_is_refused_in_one_sentence(words, what, tmp_path):
    asked = ('export', 'program', 'line', '--robot', 'ur5', *words)
    assert what in refused(*asked, '--out', tmp_path / 'p.src')
    assert not list(tmp_path.iterdir())


def test_a_station_beyond_the_limits_is_refused(tmp_path):
    path, q = stations(wt.load('kuka_kr16_2'), tmp_path)
    q[2, 1] = 2.0
    write_stations(path, q)
    words = ('export', 'program', path, '--robot', 'kuka_kr16_2', '--controller', 'krl')
    said = refused(*words, '--out', tmp_path / 'p.src')
    assert 'limits' in said and not (tmp_path / 'p.src').exists()
