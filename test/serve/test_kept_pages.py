# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every page that the server makes, of every state of what was dropped, is as it was kept."""

import time

import pytest

from weld_twin_report.serve import pages
from weld_twin_report.serve.job import Asked, Job

SITE = pages.Site(plant=True, live=True)
ASKED = Asked('ur5', True, 'line 3', '2026-03-02', {'align': 'base', 'tolerance': '0.3'})
UNSOUND = {'unsound': [{'sentence': 'Joint 4 and joint 6 are swapped.', 'remedy': 'Swap them.'}]}


def job(state, said='', *names, kind='recording', asked=ASKED, **more):
    """Return something that was dropped on a day in 2026."""
    names = names or ('run.mcap', 'cell.yaml', 'notes.txt')
    return Job(
        'ab' * 16, 'me', names, asked, state, said, since=1_772_438_400.0, kind=kind, seconds=12.4,
        **more,
    )  # fmt: skip


JOBS = {
    'waiting': (job('waiting'), 2, None, ()),
    'next': (job('waiting'), 0, None, ()),
    'running': (job('running', 'reading the bag'), 0, None, ()),
    'done': (job('done'), 0, None, ('report.html', 'diagnosis.json', 'robot.urdf')),
    'not_added': (job('done', pages.NOT_ADDED), 0, None, ('report.html',)),
    'corrected': (
        job('done', 'It leaves 0.03 mm', 'seam.src', kind='program'), 0, None,
        ('report.html', 'correction.json', 'seam.src'),
    ),
    'unsound': (job('unsound'), 0, UNSOUND, ()),
    'refused': (job('refused', '--tolerance 0: give millimetres above 0'), 0, None, ()),
    'no_robot': (job('refused', pages.NO_ROBOT, asked=Asked('')), 0, None, ()),
    'failed': (job('failed', 'the disk is full', 'seam.src', kind='program'), 0, None, ()),
}  # fmt: skip


@pytest.fixture(autouse=True)
def in_utc(monkeypatch):
    monkeypatch.setenv('TZ', 'UTC')
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@pytest.mark.parametrize('name', JOBS)
def test_the_page_of_what_was_dropped(name, kept):
    kept(f'job_{name}', pages.job_page(*JOBS[name], SITE))


def test_pages_of_the_site(kept):
    every = [each[0] for each in JOBS.values()]
    kept('recordings', pages.recordings_page(every, SITE))
    kept('recordings_done', pages.recordings_page([JOBS['done'][0]], pages.Site()))
    kept('recordings_none', pages.recordings_page([], SITE))
    kept('program', pages.program_page(every, 'ab' * 16, SITE, 'Choose a program.'))
    kept('program_none', pages.program_page([], '', SITE))
    kept('me', pages.me_page('a key', SITE, 'That is no key.'))
    kept('message', pages.message_page('Not found', 'There is <nothing> here.', SITE))
    kept('live', pages.live_page({'sentence': 'Backlash of joint_2.', 'sure': '97 %'}, SITE))
    kept('live_none', pages.live_page(None, SITE))
    start = pages.start_page(SITE, 'The file is too large.')
    kept('start', start)
