# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The server as people use it: Chromium from drop to sheet, two users, a kill and a new start."""

import os
import shutil
import time
from contextlib import contextmanager
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path

import numpy as np
import pytest
from command_line import done
from served import Person, Server, fill, small_disk, until

from weld_twin_core import JointMotion, Recording, Twin, load
from weld_twin_msgs_py.bags import read_recording
from weld_twin_report.history import Database
from weld_twin_report.serve import Settings
from weld_twin_report.serve.job import Asked, Job
from weld_twin_report.serve.queue import Queue

BROWSERS = ('chromium', 'chromium-browser', 'google-chrome')
BAG = Path(__file__).parents[2] / 'bags/elbow_play'


def bag_files():
    return sorted(str(file) for file in BAG.iterdir())


def drop_in(page, files, at):
    page.set_input_files('#files', files)
    page.get_by_text('Table units, and history').click()
    page.fill('#cell', 'line <3>')
    page.fill('#at', at)
    page.get_by_role('button', name='Diagnose').click()


def the_history_grows(page, server):
    """One diagnosis is no history yet; with the next one there are control charts."""
    page.goto(server.root + '/history')
    page.get_by_role('link', name='line <3>').first.click()
    assert 'One diagnosis so far' in page.locator('h1').inner_text()
    page.get_by_role('link', name='New recording').click()
    page.select_option('#robot', 'ur5')
    drop_in(page, [name for name in bag_files() if name.endswith('.mcap')], '2026-03-09')
    until(page, 'iframe')
    page.goto(server.root + '/history')
    page.get_by_role('link', name='line <3>').first.click()
    until(page, '.chart canvas')
    assert page.locator('.chart canvas').count() == 2


@pytest.fixture(scope='module')
def week(tmp_path_factory):
    """Return a server on a disk of its own, and why it has none."""
    place = tmp_path_factory.mktemp('week') / 'disk'
    with small_disk(place, 60) as why:
        made = Server(place)
        made.disk, made.no_disk = place, why
        yield made
        made.kill()


@contextmanager
def browser_of(chromium, folder):
    """Yield a page of somebody's own browser; what it keeps when it is closed is in the folder."""
    program = next(filter(None, map(shutil.which, BROWSERS)))
    context = chromium.browser_type.launch_persistent_context(
        str(folder), executable_path=program, args=['--no-sandbox']
    )
    yield context.pages[0]
    context.close()


def test_from_drop_to_sheet_and_into_a_history_of_ones_own(week, chromium, tmp_path):
    """A week: dropped, closed, come back, compared; a full disk, a kill and a restart, two people."""
    with browser_of(chromium, tmp_path / 'mine') as page:
        address = monday(page, week)
        assert page.evaluate('document.cookie') == ''  # no script reads a key
        page.goto(week.root + '/me')
        key = page.locator('#own').inner_text()
    with browser_of(chromium, tmp_path / 'mine') as page:  # the next day, from the bookmark
        the_history_grows(page, week)
        page.goto(week.root + '/recordings')
        assert page.locator('#mine tbody tr').count() == 2
        failed = None if week.no_disk else wednesday(page, week)
        thursday(page, week, address, failed)
    other = chromium.new_context()
    theirs = other.new_page()
    # Nobody else sees any of it, with its address either.
    theirs.goto(week.root)
    for path in (address, f'{address}/report.html', f'{address}/diagnosis.json'):
        assert theirs.goto(week.root + path).status == 404
    theirs.goto(week.root + '/history')
    assert 'Nothing yet' in theirs.locator('#message').inner_text()
    friday(theirs, week, key)
    other.close()
    week.kill()
    after(lambda: not any(str(week.disk).encode() in _command(pid) for pid in os.listdir('/proc')))


def monday(page, week):
    """Drop a recording, answer a question, read the sheet, fetch a file; return its address."""
    console = []
    page.on('console', lambda message: console.append(message.text))
    page.goto(week.address)
    drop_in(page, bag_files(), '2026-03-02T08:00+02:00')
    # The robot was forgotten: it is asked for, and the recording need not come again.
    assert 'Which robot is it?' in until(page, '#refused').inner_text()
    page.select_option('#robot', 'ur5')
    page.locator('details summary').click()
    page.fill('#tolerance', '0,3')
    page.select_option('#controller', 'ur')
    page.get_by_role('button', name='Try again').click()
    until(page, 'iframe')
    assert 'elbow_play' in page.frame_locator('iframe').locator('.subject').inner_text()
    sheet = page.frame_locator('iframe').locator('h1')
    assert 'backlash of elbow_joint' in sheet.inner_text()
    assert 'ISO 14253-1' in page.frame_locator('iframe').locator('main').inner_text()
    with page.expect_download() as fetched:
        page.get_by_text('the diagnosis as data').click()
    told = fetched.value.path().read_text()
    assert '"status": "identified"' in told and str(week.disk) not in told
    assert console == []
    return page.url.removeprefix(week.root)


def dropped(page, week):
    """Drop the recording; return the address it has while it waits."""
    page.goto(week.root)
    page.set_input_files('#files', bag_files())
    page.select_option('#robot', 'ur5')
    page.get_by_role('button', name='Diagnose').click()
    page.wait_for_url('**/recordings/*')
    return page.url.removeprefix(week.root)


def wednesday(page, week):
    """The disk is full while a recording is in work, and when another one comes; return the first."""
    failed = dropped(page, week)
    ballast = fill(week.disk)
    assert 'disk of the server is full' in until(page, '#refused').inner_text()
    page.goto(week.root)
    page.set_input_files('#files', bag_files())
    page.get_by_role('button', name='Diagnose').click()
    assert 'disk of the server is full' in until(page, '#message').inner_text()
    ballast.unlink()
    return failed


def thursday(page, week, address, failed):
    """A kill loses no verdict, and what waited, or had no room, goes on."""
    waiting = dropped(page, week)
    verdict = week.disk / 'jobs' / address.rpartition('/')[2] / 'found/diagnosis.json'
    before = verdict.stat().st_mtime_ns
    week.kill()
    week.start()
    page.goto(week.root + address)
    assert page.locator('iframe').count() == 1
    assert verdict.stat().st_mtime_ns == before
    page.goto(week.root + waiting)
    until(page, 'iframe')
    if failed:
        page.goto(week.root + failed)
        # The restart took it up again by itself, unless its end was written in time.
        if until(page, 'iframe, #refused').first.get_attribute('id') == 'refused':
            page.get_by_role('button', name='Try again').click()
        until(page, 'iframe')


def go_on_with(page, week, key):
    page.goto(week.root + '/me')
    page.fill('input[name=key]', key)
    page.get_by_role('button', name='Go on with it').click()


def friday(page, week, key):
    """Who has the key goes on elsewhere, deletes one recording, logs out, comes back, deletes all."""
    go_on_with(page, week, key)
    count = page.locator('#mine tbody tr').count()
    assert count >= 2
    page.get_by_role('button', name='Delete').first.click()
    page.wait_for_load_state()
    assert page.locator('#mine tbody tr').count() == count - 1
    page.goto(week.root + '/history')
    page.get_by_role('link', name='line <3>').first.click()
    assert '2026-03-02' in page.locator('#diagnoses').inner_text()
    database = Database(str(next((week.disk / 'users').glob('*/history.db'))), make=False)
    monday = database.entries('line <3>')[0].at
    assert monday == datetime(2026, 3, 2, 6, tzinfo=timezone.utc)  # 08:00+02:00
    database.close()
    page.goto(week.root + '/me')
    page.get_by_role('button', name='Log out').click()
    page.goto(week.root + '/recordings')
    assert 'None yet' in page.locator('#mine').inner_text()
    go_on_with(page, week, key)
    page.goto(week.root + '/me')
    page.check('#sure')
    page.get_by_role('button', name='Delete all that is mine').click()
    until(page, '#message')
    assert list((week.disk / 'jobs').iterdir()) == []
    assert list((week.disk / 'users').iterdir()) == []


def test_what_the_gate_asks_is_answered_in_the_browser(server, chromium, tmp_path):
    """A table with two joints swapped: the page says so, and one click corrects it."""
    lines, rng = ['J1,J2,J3,J4,J5,J6,X,Y,Z'], np.random.default_rng(4)
    q = np.array([0.3, -1.2, 1.4, -1.0, -1.5, 0.2]) + 0.4 * rng.standard_normal((60, 6))
    t = np.arange(60.0)
    poses = Twin(load('ur5')).poses(Recording('made', JointMotion(t, q, None, True)), t)
    noise = 2e-5 * rng.standard_normal((60, 3))
    swapped = q[:, [0, 1, 2, 4, 3, 5]]
    for angles, point in zip(np.degrees(swapped), 1e3 * (poses.position + noise), strict=True):
        lines.append(','.join(f'{v:.5f}' for v in (*angles, *point)))
    (tmp_path / 'stations.csv').write_text('\n'.join(lines) + '\n')
    page = chromium.new_context().new_page()
    page.goto(server.address)
    page.set_input_files('#files', str(tmp_path / 'stations.csv'))
    page.select_option('#robot', 'ur5')
    page.locator('details summary').click()
    page.select_option('#length_unit', 'mm')
    page.select_option('#angle_unit', 'deg')
    page.get_by_role('button', name='Diagnose').click()
    asked = until(page, '#question, #refused')
    assert 'wrist_1' in asked.inner_text() and 'wrist_2' in asked.inner_text()
    page.get_by_role('button', name='Correct it and go on').click()
    until(page, 'iframe')
    page.context.close()


def stretch_of_the_recording(file):
    """Write a program: the motion that was recorded, from one turn of the elbow to the next."""
    robot = load('ur5')
    joints = read_recording(BAG, robot).joints
    rows = np.searchsorted(joints.t, joints.t[0] + np.linspace(1.66, 2.14, 8))
    lines = [f'joint_names: [{", ".join(robot.joint_names)}]', 'points:']
    for row in rows:
        place = ', '.join(f'{angle:.6f}' for angle in joints.q[row])
        after = round(1e9 * (joints.t[row] - joints.t[rows[0]]))
        lines += [f'- positions: [{place}]', f'  time_from_start: {{sec: 0, nanosec: {after}}}']
    file.write_text('\n'.join(lines) + '\n')


def test_a_program_is_corrected_in_the_browser_as_on_the_command_line(server, tmp_path):
    person, program = Person(server), tmp_path / 'seam.yaml'
    stretch_of_the_recording(program)
    person.get()
    files = [(Path(name).name, Path(name).read_bytes()) for name in bag_files()]
    _, address, _ = person.drop(files=files)
    key = address.rpartition('/')[2]
    assert '<iframe' in person.end_of(address)
    assert f'value="{key}" selected' in person.get(f'/program?of={key}')[2]
    told = {'robot': '', 'files': [(program.name, program.read_bytes())], 'of': key}
    _, made, _ = person.drop('/program', **told, max_length='1,5')
    assert '<iframe' in person.end_of(made)
    corrected = person.get(f'{made}/{program.name}')[2]
    model = tmp_path / 'diagnosis.json'
    model.write_text(person.get(f'{address}/diagnosis.json')[2])
    words = ('--model', model, '--max-correction', '1.5mm', '1deg', '--out', tmp_path / 'out')
    done('correct', program, '--robot', 'ur5', *words)
    assert corrected == (tmp_path / 'out' / program.name).read_text() != program.read_text()
    back = {**told, 'files': [('seam (1).yaml', corrected.encode())]}
    _, again, _ = person.drop('/program', **back)
    assert 'was corrected already' in person.end_of(again)
    # What is wrong is told at once, or asked again, in the words of the fields.
    status, _, text = person.drop('/program', **told, start='up')
    assert status == 422 and '“Joints before the first move” cannot be' in text
    _, made, _ = person.drop('/program', **told, start='0,0')
    text = person.end_of(made)
    assert 'It could not be corrected' in text and '“Joints before the first move” needs 6' in text
    assert person.get(f'{made}/job.json')[0] == person.get(f'{made}/diagnosis.json')[0] == 404


def test_what_is_asked_while_a_recording_is_in_work_is_done_afterwards(tmp_path):
    queue = Queue(Settings(tmp_path))
    job = replace(Job.new('a' * 64), names=('elbow_play.mcap',))
    place = job.uploads(queue.folder(job))
    place.mkdir(parents=True)
    shutil.copy(BAG / 'elbow_play.mcap', place)
    try:
        queue.add(job.ask(Asked('ur5')))
        after(lambda: queue.get(job.key, job.user).state == 'running')
        queue.again(job, Asked('no_robot'))
        after(lambda: queue.get(job.key, job.user).state not in ('waiting', 'running'))
        now = queue.get(job.key, job.user)
        assert (now.state, now.asked.robot) == ('refused', 'no_robot')
        # What is deleted in work leaves nothing, and the worker goes on.
        queue.again(job, Asked('ur5'))
        after(lambda: queue.get(job.key, job.user).state == 'running')
        queue.remove(job)
        assert queue.of(job.user) == []
        # What its command writes on the way to its end goes with it.
        after(lambda: list((tmp_path / 'jobs').iterdir()) == [])
    finally:
        queue.stop()


def test_who_has_most_gives_way_and_nobody_for_another_one(tmp_path):
    """A disk of a hundred kilobytes: one user fills it, another one still has his recording."""
    queue = Queue(Settings(tmp_path, disk=100_000, kept=6, own=99))
    few, many = '1' * 64, '2' * 64

    def keep(user):
        job = replace(Job.new(user), names=('a.csv',))
        place = job.uploads(queue.folder(job))
        place.mkdir(parents=True)
        (place / 'a.csv').write_bytes(bytes(9_000))
        queue.add(job.ask(Asked('no_robot')))
        after(lambda: queue.get(job.key, user).state == 'refused')
        return job

    try:
        mine = keep(few)
        theirs = [keep(many) for _ in range(8)]
        assert queue.get(mine.key, few) is not None
        assert [queue.get(job.key, many) is not None for job in theirs] == [False] + [True] * 7
        assert len(list((tmp_path / 'jobs').iterdir())) == 8
        others = [keep(f'{k:064d}') for k in range(6)]  # nobody else has more than his share
        assert queue.get(mine.key, few) is not None
        assert all(queue.get(job.key, job.user) is not None for job in others)
        assert sum(queue.get(job.key, many) is not None for job in theirs) == 3
    finally:
        queue.stop()


def after(true, seconds=60.0):
    until = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < until
        time.sleep(0.02)


def _command(pid):
    try:
        return Path(f'/proc/{pid}/cmdline').read_bytes()
    except OSError:
        return b''
