# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tasks: the same numbers wherever they run, and nothing run twice."""

import json
import time
from dataclasses import replace

import numpy as np
import pytest
from page_text import flat, page_text

from weld_twin_core import __version__
from weld_twin_core.arm import catalog
from weld_twin_core.effects import JointOffset
from weld_twin_core.errors import DataError, ModelError
from weld_twin_core.motion.paths import default_seam
from weld_twin_core.motion.planned_motion import plan
from weld_twin_core.recording import Measurements, Recording
from weld_twin_core.sensitivity import default_tolerances
from weld_twin_core.twin.twin import Twin
from weld_twin_nodes.offline.task_pool import (
    Cluster,
    Cores,
    Here,
    Runner,
    Task,
    available_cores,
    digest,
    pool_of,
)
from weld_twin_report.sensitivity_report import Effort, Setting
from weld_twin_report.sensitivity_report.figures import draw, drawable
from weld_twin_report.sensitivity_report.study_files import run_claims
from weld_twin_report.sensitivity_report.study_page import study_page
from weld_twin_report.sensitivity_report.work import run_study


def note_down(path, value):
    """Return a value, and leave a line for every time that was asked."""
    with open(path, 'a') as file:
        file.write('run\n')
    return {'value': np.asarray(value)}


@pytest.fixture(scope='module')
def setting():
    """Return a study small enough to run three times."""
    robot = catalog.load('ur5')
    tolerances = default_tolerances(robot, ('joint_offset', 'backlash'))
    path = default_seam(robot)
    return Setting(robot, tolerances, 'line', path, points=30, effort=Effort(64, 500, 4, 2))


def plain(study):
    return json.dumps(study, default=lambda a: a.tolist())


@pytest.fixture(scope='module')
def whole(setting, tmp_path_factory):
    """Return the study as this process makes it, and the folder of its results."""
    folder = tmp_path_factory.mktemp('whole')
    with Runner(Here(), folder) as runner:
        return plain(run_study(setting, runner)), folder


@pytest.fixture
def loopback():
    """Yield the address of a scheduler on this machine with two workers."""
    distributed = pytest.importorskip('distributed', reason='Dask is an extra')
    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host='127.0.0.1', dashboard_address=None
    )
    with cluster:
        yield cluster.scheduler_address


def test_who_is_interrupted_while_others_work_does_not_wait_for_them():
    def interrupted():
        raise KeyboardInterrupt

    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt), Runner(Cores(1, ahead='json')) as runner:
        runner.run([Task(time.sleep, (60.0,))] * 3, interrupted)
    assert time.monotonic() - start < 30.0


def test_this_process_works_while_others_do():
    done = []
    with Runner(Cores(1)) as runner:
        found = runner.run([Task(abs, (-3,))], lambda: done.append('drawn'))
    assert (found, done) == ([3], ['drawn'])


@pytest.mark.slow
def test_a_study_is_identical_here_on_two_cores_and_on_a_dask_cluster(setting, whole, loopback):
    for pool in (Cores(2), Cluster(loopback)):
        with Runner(pool) as runner:
            assert plain(run_study(setting, runner)) == whole[0]


def test_a_result_that_is_there_is_not_made_again(tmp_path):
    tasks = [Task(note_down, (str(tmp_path / 'log'), k)) for k in range(3)]
    told = []
    with Runner(Here(), tmp_path / 'kept', lambda *news: told.append(news)) as runner:
        first = runner.run(tasks[:2])
        again = runner.run(tasks)
    assert again[:2] == first
    assert [item['value'] for item in again] == [0, 1, 2]
    assert (tmp_path / 'log').read_text().count('run') == 3
    assert told[-1][:2] == (3, 3)


def test_a_study_that_was_stopped_resumes_to_the_same_result(setting, whole):
    study, folder = whole
    kept = sorted(folder.iterdir())
    for file in kept[::2]:
        file.unlink()
    with Runner(Here(), folder) as runner:
        assert plain(run_study(setting, runner)) == study
    assert sorted(folder.iterdir()) == kept


def test_a_study_is_as_it_was_kept(whole, kept):
    study = json.loads(whole[0])
    kept('study', both_forms(study_page(study, None, ()), study))


def test_what_was_recorded_stands_beside_what_tolerances_make(setting, kept):
    motion = plan(setting.robot, setting.path, 'smooth', rate_hz=50.0).motion
    commanded = Recording('seam', motion)
    real = Twin(setting.robot, [JointOffset('elbow_joint', offset=1e-3)]).poses(commanded)
    recording = commanded.with_measured(Measurements(motion.t, real.position))
    asked = replace(setting, recording=recording, effort=Effort(16, 100, 2, 1))
    with Runner(Here()) as runner:
        study = json.loads(plain(run_study(asked, runner)))
    rows = study['motions']['recorded']['local']['parameters']
    peak = next(row for row in rows if row['name'] == 'joint_offset.elbow_joint.offset')
    assert study['recorded']['max_m'] == pytest.approx(1e-3 * peak['S_analytic_peak_m'], rel=1e-3)
    drawn = replace(draw(asked, 'recorded'), svg='')
    kept('recorded', both_forms(study_page(study, None, [drawn]), study['recorded']))


def test_figures_are_as_they_were_kept(setting, kept):
    drawn = [replace(draw(setting, key), svg='') for key in drawable(setting)]
    tables = [{key: value.tolist() for key, value in each.table.items()} for each in drawn]
    kept('figures', both_forms(study_page(None, None, drawn), tables))


def test_claims_are_as_they_were_kept(setting, kept):
    with Runner(Here()) as runner:
        claims = run_claims(runner, [setting.robot], ['line'])
    kept('claims', both_forms(study_page(None, claims, ()), claims))


def both_forms(page, numbers):
    """Return what a page says, and every number of a file."""
    lines = [f'{at} {value}' for at, value in flat(numbers, '')]
    return '\n'.join([page_text(page).replace(__version__, 'VERSION'), *lines]) + '\n'


def test_a_damaged_result_is_named(tmp_path):
    task = Task(note_down, (str(tmp_path / 'log'), 1))
    (tmp_path / f'{task.key}.json').write_text('{"value": ')
    with pytest.raises(DataError, match='is damaged'):
        Runner(Here(), tmp_path).run([task])


def test_an_error_in_a_process_arrives_as_itself():
    with Runner(Cores(1)) as runner, pytest.raises(ModelError, match='nobody'):
        runner.run([Task(catalog.load, ('nobody',))])


def test_every_float_survives_the_way_back():
    values = np.random.default_rng(0).normal(size=100) * 10.0 ** np.arange(-50, 50)
    found = Runner(Here()).run([Task(np.asarray, (values,))])[0]
    np.testing.assert_array_equal(found, values)


def test_digests_tell_contents_apart_and_nothing_else(setting):
    assert digest(setting) == digest(setting)
    assert digest(np.zeros(2)) != digest(np.zeros(3))
    assert digest(np.zeros(2)) != digest(np.zeros(2, dtype=int))
    assert digest(1) != digest(1.0) != digest('1.0')
    assert digest(['ab', 'c']) != digest(['a', 'bc'])
    assert digest({'a': 1, 'b': 2}) == digest({'b': 2, 'a': 1})
    with pytest.raises(DataError, match='no content'):
        digest(object())


def test_a_pool_follows_the_options():
    assert isinstance(pool_of(), Cores)
    assert available_cores() >= 1
    with pytest.raises(DataError, match='negative'):
        pool_of(workers=-1)


@pytest.mark.slow
def test_a_scheduler_that_does_not_answer_is_an_error_of_one_line():
    pytest.importorskip('distributed', reason='Dask is an extra')
    with pytest.raises(DataError, match='no Dask scheduler answers'):
        Cluster('tcp://127.0.0.1:9')
