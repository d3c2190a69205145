# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole check of one case: made, diagnosed, scored, from the command line."""

import json

import pytest
from command_line import refused

from weld_twin_lab.blind import seal
from weld_twin_lab.study import DONE
from weld_twin_msgs_py.bags import BagReader
from weld_twin_nodes.offline import task_pool

pytest.importorskip('mujoco')


@pytest.fixture(scope='module')
def checked(tmp_path_factory):
    """Return the directory of a whole check of a short case."""
    from weld_twin_nodes.cli import main

    out = tmp_path_factory.mktemp('blind') / 'check'
    words = ['--cases', '1', '--seed', '3', '--kinds', 'single', '--seconds', '6,8']
    words += ['--out', str(out)]
    with pytest.MonkeyPatch.context() as changed:
        changed.setattr(task_pool, 'pool_of', lambda *_: task_pool.Here())
        assert main(['blind', 'run', *words]) == 0
    return out, words


def test_a_check_leaves_a_score_of_every_case(checked):
    score = json.loads((checked[0] / seal.SCORE).read_text())
    assert score['count'] == 1
    assert score['errors'] == {}
    assert {case['name'] for case in score['cases']} == {'case_0001'}
    assert score['made']['truths_readable'] is True
    assert len(score['made']['seal']) == 64
    assert 'of 1 cases answered rightly' in (checked[0] / 'score.md').read_text()


def test_the_recordings_tell_nothing_of_the_truth(checked):
    cases, truths = checked[0] / 'cases', checked[0] / 'truths'
    for use in (seal.TRAIN, seal.HOLDOUT):
        with BagReader(cases / 'case_0001' / use) as bag:
            assert set(bag.provenance) <= {'version', 'robot', 'static', 'schema'}
    told = seal.read(cases / 'case_0001' / seal.CASE)
    assert set(told) == {'schema', 'name', 'align', 'exclude', 'known'}
    assert not (cases / 'case_0001' / seal.TEST).exists()
    assert (truths / 'case_0001' / seal.TEST).exists()


def test_a_check_run_again_does_nothing_anew(checked):
    from weld_twin_nodes.cli import main

    out, words = checked
    files = sorted((out / 'verdicts' / DONE).glob('*/*'))
    assert files
    before = [file.stat().st_mtime_ns for file in files]
    assert main(['blind', 'run', *words]) == 0
    assert sorted((out / 'verdicts' / DONE).glob('*/*')) == files
    assert [file.stat().st_mtime_ns for file in files] == before


def test_another_seed_does_not_go_where_cases_are(checked):
    words = [('4' if word == '3' else word) for word in checked[1]]
    assert 'seed 3' in refused('blind', 'run', *words)
