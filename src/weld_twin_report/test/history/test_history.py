# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A cell's history: diagnoses in, what changed out, in a real database."""

import json
import shutil
import sys
from dataclasses import replace
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest
from command_line import done, refused

import weld_twin_core as wt
from weld_twin_core.effects import REGISTRY
from weld_twin_core.errors import DataError
from weld_twin_core.history import Change, Moved
from weld_twin_core.twin.directions import GIVE
from weld_twin_msgs_py.bags import write_recording
from weld_twin_report.history import Database, entry_of
from weld_twin_report.history.entry import Entry
from weld_twin_report.history.words import changed, forecast, observations, sentence

pytest.importorskip('sqlalchemy', reason='the history is an extra')

OTHERS = REGISTRY.keys() - {
    'joint_offset',
    'joint_compliance',
    'transmission_ripple',
    'link_length',
}
"""Kinds that need not be tried beside those that the checks leave open: the fewer, the sooner."""
MONDAY = datetime(2026, 3, 2, 8, tzinfo=timezone.utc)


@pytest.fixture
def url(tmp_path):
    return str(tmp_path / 'history.db')


def test_a_diagnosis_is_added_once_and_shown(elbow_found, url):
    words = ('history', 'add', elbow_found, '--cell', 'line 3', '--at', '2026-03-02', '--db', url)
    assert 'added' in done(*words)
    assert 'was there already' in done(*words)
    shown = done('history', 'show', '--cell', 'line 3', '--db', url)
    assert '2026-03-02' in shown and 'backlash of elbow_joint' in shown
    assert done('history', 'show', '--db', url) == 'line 3\n'


def test_that_another_diagnosis_of_a_recording_is_not_taken_is_told(elbow_found, url, tmp_path):
    content = json.loads((Path(elbow_found) / 'diagnosis.json').read_text())
    content['verdict']['status'] = 'unknown'
    (tmp_path / 'anew.json').write_text(json.dumps(content))
    words = ['--cell', 'line 3', '--at', '2026-03-02', '--db', url]
    done('history', 'add', elbow_found, *words)
    said = done('history', 'add', tmp_path / 'anew.json', *words).splitlines()[-1]
    assert 'what was diagnosed then stays: identified: backlash of elbow_joint' in said


def test_a_date_that_would_be_lost_is_told(elbow_found, url):
    words = ('history', 'add', elbow_found, '--db', url, '--cell')
    done(*words, 'line 3', '--at', '2026-03-02')
    assert '2026-03-02' in refused(*words, 'line 3', '--at', '2026-04-02')
    assert '2926-03-02 is still to come' in done(*words, 'b', '--at', '2926-03-02')
    assert 'is no date of a recording' in refused(*words, 'line 3', '--at', '1026-03-02')


def test_what_cannot_be_added_is_refused_in_a_sentence(elbow_found, url, tmp_path):
    add = ('history', 'add', '--cell', 'a', '--db', url)
    assert 'are no dates' in refused(*add, elbow_found)
    assert "'Monday' is no date" in refused(*add, elbow_found, '--at', 'Monday')
    assert 'cannot be read' in refused(*add, tmp_path)
    old = tmp_path / 'old'
    shutil.copytree(elbow_found, old)
    file = old / 'diagnosis.json'
    data = json.loads(file.read_text())
    for each in data['posterior']['coordinates']:
        del each['prior_std']
    file.write_text(json.dumps(data))
    assert 'diagnose the recording again' in refused(*add, old, '--at', '2026-03-02')
    assert not Path(url).exists()


def test_without_sqlalchemy_a_sentence_says_how_to_install_it(url, monkeypatch):
    monkeypatch.setitem(sys.modules, 'sqlalchemy', None)
    monkeypatch.delitem(sys.modules, 'weld_twin_report.cli.commands.history', raising=False)
    assert "pip install 'weld-twin[history]'" in refused('history', 'show', '--db', url)


def test_another_robot_is_another_cell(elbow_found, url):
    entry = entry_of(elbow_found, MONDAY)
    database = Database(url)
    database.add('a', entry)
    other = replace(entry, kinematics='0' * 16, robot='ur10', recording='x')
    with pytest.raises(DataError, match="has the robot 'ur5', and this diagnosis is of 'ur10'"):
        database.add('a', other)
    with pytest.raises(DataError, match='another recording of'):
        database.add('a', replace(entry, recording='y'))
    with pytest.raises(DataError, match="no cell 'b' in the history; it has a"):
        database.entries('b')
    database.close()


ZERO = 'joint_offset elbow_joint 0'


def entry(week, names, value):
    tool, std = np.eye(4), np.full(len(names), 1e-6)
    of = ('ur5', '0' * 16, f'week {week}', 'none', 0.9, 1e-4, 3e-5, 1e-4, [])
    at = MONDAY + timedelta(weeks=week)
    return Entry(at, *of, names, np.array(value), 1e2 * std, np.diag(std**2), tool)


def test_what_moves_a_little_every_week_is_told_by_the_week_with_the_weeks_that_are_left():
    entries = [entry(week, (ZERO,), (2e-5 * week,)) for week in range(13)]
    seen = observations(entries)
    (change,) = result = changed(entries, seen)
    assert 'elbow_joint: moves by 0.0200' in sentence(change)
    until = forecast(change, seen, result, {'joint_offset': 2e-5 * 32.0})
    assert until['weeks'] == pytest.approx(20.0, abs=0.5)
    assert until['weeks_5'] <= until['weeks'] <= until['weeks_95']
    assert forecast(change, seen, result, {'tool_pose': 1.0}) is None


def test_wear_that_goes_on_is_told_of_a_time_that_begins_after_it_did(url):
    database = Database(url)
    for week in range(13):
        database.add('worn', entry(week, (ZERO,), (2e-5 * week,)))
        database.add('hit', entry(week, (ZERO,), (3e-4 * (week > 4),)))
    database.close()
    later = ('--db', url, '--since', '2026-05-01', '--limit', 'joint_offset=6.4e-4')
    said = done('history', 'changed', '--cell', 'worn', *later)
    assert 'moves by 0.0200' in said and 'reaches 0.64 mrad in' in said
    said = done('history', 'changed', '--cell', 'hit', *later)
    assert said == 'hit: nothing changed by more than chance after 2026-05-01 in 13 diagnoses\n'


def test_a_give_that_older_diagnoses_lack_is_no_change_of_the_arm():
    zero, give = ZERO, f'{GIVE}joint 3'
    entries = [entry(week, (zero,), (0.0,)) for week in range(3)]
    entries += [entry(week, (zero, give), (0.0, 5e-5)) for week in range(3, 6)]
    assert changed(entries, observations(entries)) == ()


def test_a_knocked_tool_is_told_along_each_axis_in_its_unit():
    moved = (Moved('tool_pose 0', 2.1e-4, 6e-6), Moved('tool_pose 2', -2.3e-4, 8e-6))
    far = (Moved('tool_pose 1', 1e-6, 6e-6), Moved('tool_pose 4', 3e-3, 1e-4))
    told = Change(
        *moved[0][:1], 'step', 20000.0, (19993.0, 20000.0), 2.1e-4, 6e-6, 50.0, ('base_pose *',)
    )
    assert sentence(replace(told, together=(*moved, *far))) == (
        'tool pose error: stepped by 0.2100 ± 0.0060 mm along x, −0.2300 ± 0.0080 mm along z, '
        '3.00 ± 0.10 mrad about y between 2024-09-27 and 2024-10-04; as well it may be base pose error.'
    )


def test_what_is_no_history_is_refused(tmp_path):
    (tmp_path / 'notes.txt').write_text('not a database, but long enough to look like one' * 40)
    assert 'cannot be used' in refused('history', 'show', '--db', tmp_path / 'notes.txt')


@pytest.fixture(scope='module')
def checked(tmp_path_factory):
    """Return the diagnoses of two checks of an arm; its elbow moves by 0.3 mrad between them."""
    place = tmp_path_factory.mktemp('checks')
    robot, rng = wt.load('ur5'), np.random.default_rng(11)
    sag = wt.effects.JointCompliance('elbow_joint', compliance=2e-6)
    for check, offset in enumerate((-1e-3, -1.3e-3)):
        twin = wt.Twin(robot, [sag, wt.effects.JointOffset('elbow_joint', offset=offset)])
        q = np.array([0.2, -1.3, 1.5, -1.8, -1.5, 0.1]) + rng.uniform(-1.2, 1.2, (50, 6))
        stations = wt.Recording('check', wt.JointMotion(10.0 * np.arange(50), q, static=True))
        true = twin.poses(stations).position
        seen = wt.Measurements(stations.joints.t, true + rng.normal(scale=2e-5, size=true.shape))
        write_recording(place / f'rec{check}', stations.with_measured(seen), robot)
        words = ('diagnose', place / f'rec{check}', '--robot', 'ur5', '--align', 'base,tool')
        done(*words, '--exclude-effect', *OTHERS, '--out', place / f'found{check}')
    return place


def test_a_zero_that_slipped_between_two_checks_is_as_sure_as_their_recordings_make_it(
    checked, url
):
    # Either diagnosis alone leaves it open what is a zero and what unevenness of the gear, by more
    # than the zero moved; but the gear is the same in both.
    for k, day in enumerate(('2026-01-05', '2026-03-05')):
        done('history', 'add', checked / f'found{k}', '--cell', 'c', '--at', day, '--db', url)
    said = done('history', 'changed', '--cell', 'c', '--db', url, '--json')
    (change,) = json.loads(said)['changes']
    assert (change['effect'], change['joint']) == ('joint_offset', 'elbow_joint')
    assert abs(change['size'] + 3e-4) < 3.0 * change['std'] and change['std'] < 3e-5
