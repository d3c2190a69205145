# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole check, small: made, diagnosed, scored, from the command line."""

from __future__ import annotations

import json

import numpy as np
import pytest

from weld_twin_core.arm import catalog
from weld_twin_core.effects import effects_from_list
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_core.twin.twin import Twin
from weld_twin_lab.blind import layout
from weld_twin_msgs_py.bags import BagReader

pytest.importorskip('mujoco')


@pytest.fixture(scope='module')
def checked(tmp_path_factory):
    """Return the directory of a whole check of two short cases."""
    from weld_twin_nodes.cli import main

    out = tmp_path_factory.mktemp('blind') / 'check'
    words = [
        '--cases',
        '2',
        '--seed',
        '3',
        '--kinds',
        'none,single',
        '--seconds',
        '6,8',
        '--workers',
        '1',
        '--out',
        str(out),
    ]
    assert main(['blind', 'run', *words]) == 0
    return out, words


def test_a_check_leaves_a_score_of_every_case(checked):
    score = json.loads((checked[0] / layout.SCORE).read_text())
    assert score['count'] == 2
    assert score['errors'] == {}
    assert {case['name'] for case in score['cases']} == {'case_0001', 'case_0002'}
    assert score['made']['truths_readable'] is True
    assert len(score['made']['seal']) == 64
    assert (checked[0] / layout.PAGE).stat().st_size > 10_000


def test_nothing_hinders_reading_the_scores(checked, browser):
    assert browser.hindrances((checked[0] / layout.PAGE).read_text(encoding='utf-8')) == []


def test_the_recordings_tell_nothing_of_the_truth(checked):
    cases, truths = checked[0] / 'cases', checked[0] / 'truths'
    for name in ('case_0001', 'case_0002'):
        for use in (layout.TRAIN, layout.HOLDOUT):
            with BagReader(cases / name / use) as bag:
                assert set(bag.provenance) <= {'version', 'robot', 'static', 'schema'}
        assert set(layout.read(cases / name / layout.CASE)) == {
            'schema',
            'name',
            'align',
            'exclude',
            'known',
        }
        assert not (cases / name / layout.TEST).exists()
        assert (truths / name / layout.TEST).exists()


def test_a_check_run_again_does_nothing_anew(checked):
    from weld_twin_nodes.cli import main

    out, words = checked
    files = sorted((out / 'verdicts' / layout.DONE).iterdir())
    before = [file.stat().st_mtime_ns for file in files]
    assert main(['blind', 'run', *words]) == 0
    assert sorted((out / 'verdicts' / layout.DONE).iterdir()) == files
    assert [file.stat().st_mtime_ns for file in files] == before


def test_another_seed_does_not_go_where_cases_are(checked, weld_twin):
    words = [('4' if word == '3' else word) for word in checked[1]]
    result = weld_twin('blind', 'run', *words)
    assert result.code == 2
    assert 'seed 3' in result.err


def test_a_cause_put_into_a_real_bag_moves_it_as_the_twin_says():
    from weld_twin_lab.blind.blind_cell import BlindCell, Take
    from weld_twin_lab.blind.real_motion import recorded_command, with_cause
    from weld_twin_lab.plant.tracker import Tracker

    robot = catalog.load('ur5')
    rng = np.random.default_rng(5)
    t = np.sort(rng.uniform(0.0, 8.0, 900))
    waves = np.sin(np.outer(t, np.arange(1, 7)) / 3.0)
    q = np.array([0.1, -1.2, 1.5, -1.0, -1.4, 0.3]) + 0.3 * waves
    measured_t = np.arange(0.5, 7.5, 0.02)
    bare = Recording('real', JointMotion(t, q))
    poses = Twin(robot).poses(bare, measured_t)
    noise = 1e-3 * rng.standard_normal(poses.position.shape)
    real = bare.with_measured(Measurements(measured_t, poses.position + noise, poses.rotation))
    cause = {'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': 1e-3}

    cell = BlindCell(robot, Tracker())
    mixed, size = with_cause(cell, cause, Take(recorded_command(real), 1), real)

    moved = Twin(robot, effects_from_list([cause], robot)).poses(bare, measured_t)
    off = moved.position - poses.position
    np.testing.assert_allclose(mixed.measured.position - real.measured.position, off, atol=1e-8)
    np.testing.assert_allclose(mixed.measured.rotation, moved.rotation, atol=1e-7)
    np.testing.assert_allclose(size, np.sqrt((off**2).sum(axis=1).mean()), rtol=1e-4)
