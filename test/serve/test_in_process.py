# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A conversation with the server in this process: every answer to it is as it was kept."""

import asyncio
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest
from page_text import page_text
from served import form

SHOWN = ('location', 'content-type', 'content-security-policy', 'set-cookie', 'cache-control')
TABLE = (('data.csv', b'a,b\n1,2\n'),)
FORM = 'application/x-www-form-urlencoded'
MASKS = (
    (r'\b[0-9a-f]{64}\b', 'USER'), (r'\b[0-9a-f]{32}\b', 'JOB'), (r'\d{4}-\d\d-\d\d \d\d:\d\d', 'WHEN'),
    (r'\[data-[^]]*\]|\[href=[^]]*\]', ''),
)  # fmt: skip


class Visitor:
    """Somebody who talks to the application, and keeps cookies."""

    def __init__(self, app, address='10.0.0.1', **headers):
        self.app, self.address, self.headers, self.cookies = app, address, headers, {}
        self.last = ''

    def ask(self, path, body=b'', kind='', *, method=None, **headers):
        """Return what is kept of an answer."""
        asked = self._ask(method or ('POST' if kind else 'GET'), path, body, kind, headers)
        # In a thread of its own: a browser that was driven before leaves its loop to this one.
        with ThreadPoolExecutor(1) as apart:
            return apart.submit(asyncio.run, asked).result()

    async def _ask(self, method, path, body, kind, headers):
        given = {'host': 'localhost:8765', **self.headers, **headers}
        given |= {'content-type': kind, 'content-length': str(len(body))} if kind else {}
        if self.cookies:
            given['cookie'] = '; '.join(f'{name}={value}' for name, value in self.cookies.items())
        place, _, query = path.partition('?')
        scope = {
            'type': 'http', 'http_version': '1.1', 'asgi': {'version': '3.0'}, 'scheme': 'http',
            'method': method, 'path': place, 'raw_path': place.encode(), 'root_path': '',
            'query_string': query.encode(), 'client': (self.address, 4711),
            'server': ('localhost', 8765),
            'headers': [(k.replace('_', '-').encode(), v.encode()) for k, v in given.items()],
        }  # fmt: skip
        parts, sent = [body], []

        async def receive():
            if parts:
                return {'type': 'http.request', 'body': parts.pop(), 'more_body': False}
            return {'type': 'http.disconnect'}

        async def send(message):
            sent.append(message)

        await self.app(scope, receive, send)
        head = [(name.decode(), value.decode()) for name, value in sent[0]['headers']]
        for name, value in head:
            if name == 'set-cookie':
                self.cookies.update([value.partition(';')[0].split('=', 1)])
        self.last = dict(head).get('location', self.last)
        text = b''.join(message.get('body', b'') for message in sent[1:]).decode()
        text = page_text(text) if text.startswith('<!doctype html>') else text
        lines = [
            f'{method} {path}: {sent[0]["status"]}',
            *(f'{k}: {v}' for k, v in head if k in SHOWN),
        ]
        whole = '\n'.join([*lines, *text.splitlines()[:40]])
        for pattern, name in MASKS:
            whole = re.sub(pattern, name, whole)
        return whole


@pytest.fixture
def settings(tmp_path):
    from weld_twin_report.serve import Settings

    return Settings(tmp_path, names=('cell.example',), token='right', workers=0, upload=8000,
                    own=3, proxy=True)  # fmt: skip


@pytest.fixture
def queue(settings):
    from weld_twin_report.serve.queue import Queue

    queue = Queue(settings)
    yield queue
    queue.stop()


@pytest.fixture
def app(settings, queue):
    """Return an application in which nobody works, so that everything waits."""
    from weld_twin_report.serve.access import Doors
    from weld_twin_report.serve.app import make_app

    return make_app(settings, queue, Doors())


def test_who_is_let_in(app, kept):
    who = Visitor(app)
    said = [
        who.ask('/'),
        who.ask('/?token=wrong'),
        who.ask('//elsewhere.example/?token=right&of=a'),
        who.ask('/live'),
        who.ask('/live', host='evil.example'),
        who.ask('/live', host='CELL.example:80'),
        who.ask('/live', host='[::1]:8765'),
        Visitor(app, authorization='Bearer right').ask('/live'),
        Visitor(app, authorization='Bearer wrong').ask('/live'),
        who.ask('/me', b'key=x', FORM, origin='http://evil.example'),
        who.ask('/me', b'key=x', FORM, origin='http://localhost:8765'),
        who.ask('/me', b'key=x', FORM, sec_fetch_site='cross-site'),
        who.ask('/me', b'key=x', FORM, origin='null'),
        *map(who.ask, ('/nothing/here', '/docs')),
        *map(who.ask, ('/recordings/../../etc/passwd', '/recordings/0/../job.json')),
    ]
    kept('let_in', '\n\n'.join(said) + '\n')


def test_what_is_dropped_waits_and_is_seen_by_nobody_else(app, tmp_path, kept):
    one, other = (Visitor(app, authorization='Bearer right') for _ in range(2))
    said = [one.ask('/recordings'), one.ask('/recordings', *form(files=TABLE, align='base'))]
    mine = one.last
    said += [one.ask(mine), other.ask(mine), other.ask('/recordings', *form(files=TABLE))]
    said += [
        other.ask(other.last),
        one.ask('/recordings', *form(robot='no_robot', files=TABLE)),
        one.ask('/recordings', *form(files=())),
        one.ask('/recordings', *form(files=TABLE, tolerance='-1')),
        one.ask('/recordings', *form(files=(('data.csv', b'x' * 9000),))),
        one.ask('/recordings', *form(files=(('data.exe', b'x'),))),
        one.ask(f'{mine}/report.html'),
        one.ask(f'{mine}/again', *form(files=(), robot='ur10')),
        one.ask(f'{mine}/history', b'', FORM),
        one.ask('/program'),
        one.ask('/program', *form(files=(('seam.src', b'DEF a()\nEND\n'),))),
        one.ask(
            '/program', *form(files=(('seam.src', b'DEF a()\nEND\n'),), of=mine.rpartition('/')[2])
        ),
        *(one.ask('/recordings', *form(files=TABLE)) for _ in range(3)),
        one.ask('/recordings'),
        other.ask(f'{mine}/delete', b'', FORM),
        one.ask(f'{mine}/delete', b'', FORM),
        one.ask(mine),
    ]
    kept('dropped', '\n\n'.join(said) + '\n')
    assert len(list((tmp_path / 'jobs').iterdir())) == 3  # nothing is left of what was refused


NO_RECORDINGS = (
    {'files': ()}, {'files': [('x.exe', b'MZ')]}, {'files': [('a.csv', b''), ('A/a.csv', b'')]},
    {'files': [('metadata.yaml', b'')]}, {'files': [(f'{k}.mcap', b'') for k in range(30)]},
    {'robot': '/etc/passwd'}, {'align': '--out'}, {'region': '../secret'}, {'at': 'Monday'},
    *({'files': [(name, b'a,b\n')]}
      for name in ('.csv', '-o.csv', 'a\u202egnp.csv', 'a\nb.csv', f'{"x" * 250}.csv')),
)  # fmt: skip


def test_what_is_no_recording_is_refused_in_a_sentence(app, tmp_path, kept):
    one = Visitor(app, authorization='Bearer right')
    said = [one.ask('/recordings', *form(**how)).splitlines()[:11] for how in NO_RECORDINGS]
    kept('no_recordings', '\n\n'.join('\n'.join(lines) for lines in said) + '\n')
    assert not list((tmp_path / 'jobs').iterdir())


@pytest.mark.parametrize(
    ('state', 'cell', 'asked'),
    [('done', 'line 3', True), ('done', '', False), ('waiting', 'line 3', False)],
)
def test_what_is_done_for_a_cell_goes_into_its_history_once_more(app, queue, state, cell, asked):
    one = Visitor(app, authorization='Bearer right')
    one.ask('/recordings', *form(files=TABLE, cell=cell))
    mine = one.last
    (job,) = queue._jobs.values()
    queue._put(replace(job, state=state))
    one.ask(f'{mine}/history', b'', FORM)
    assert queue.get(job.key, job.user).said.startswith('not in the history: ') is asked
    queue.remove(job)
    queue.into_history(job)  # what was deleted meanwhile does not come back
    assert queue.get(job.key, job.user) is None and not queue.folder(job).exists()


def test_two_diagnoses_for_one_program_are_refused_in_a_sentence(app, tmp_path):
    one = Visitor(app, authorization='Bearer right')
    files, model = (('seam.src', b'DEF a()\nEND\n'),), (('a.json', b'{}'), ('b.json', b'{}'))
    assert 'Two diagnoses were dropped' in one.ask('/program', *form(files=files, model=model))
    said = one.ask('/program', *form(files=files, model=model[:1], of='0' * 32))
    assert 'A diagnosis was chosen and another one dropped' in said
    assert not list((tmp_path / 'jobs').iterdir())


def test_who_one_is_goes_along_with_a_key(app, kept):
    one, other = (Visitor(app, address, authorization='Bearer right', x_forwarded_for='1.2.3.4')
                  for address in ('127.0.0.1', '10.0.0.2'))  # fmt: skip
    said = [one.ask('/recordings', *form(files=TABLE)), one.ask('/me'), one.ask('/history')]
    key = one.cookies['weld_twin_user']
    made_up = Visitor(app, authorization='Bearer right')
    made_up.cookies['weld_twin_user'] = key[:-1] + ('0' if key[-1] != '0' else '1')
    assert 'None yet' in made_up.ask('/recordings') and made_up.cookies['weld_twin_user'] != key
    said += [
        other.ask('/me', b'key=' + b'0' * 64, FORM),
        other.ask('/me', f'key= {key.upper()} '.encode(), FORM),
        other.ask('/recordings'),
        other.ask('/me/leave', b'', FORM),
        one.ask('/me/delete', b'sure=no', FORM),
        one.ask('/me/delete', b'sure=yes', FORM),
        one.ask('/recordings'),
        one.ask('/plant'),
        one.ask('/history/line%203'),
    ]
    kept('keys', '\n\n'.join(said) + '\n')


class Connection:
    """The server's side of a connection from a port of one address."""

    def __init__(self, port):
        self.port, self.said = port, []

    def get_extra_info(self, _):
        return '10.0.0.1', self.port

    def write(self, data):
        self.said.append(data.split(b'\r\n')[0].decode())

    def close(self):
        self.said.append('closed')

    def abort(self):
        self.said.append('gave way')


def test_who_says_nothing_in_time_is_told_and_who_waits_longest_gives_way(monkeypatch):
    from weld_twin_report.serve import access

    monkeypatch.setattr(access, 'GRACE', 0.0)
    silent, speaks, gone, first, second, third = (Connection(port) for port in range(1, 7))

    async def run():
        doors = access.Doors(of_address=3, of_all=100, head=0.05)
        for each in (silent, speaks, gone):
            doors.opened(each)
        doors.began(('10.0.0.1', 2))
        doors.closed(gone)
        await asyncio.sleep(0.2)
        doors.ended(('10.0.0.1', 2))  # its next request has its own time
        doors = access.Doors(of_address=2, of_all=100, head=5.0)
        for each in (first, second, third):
            doors.opened(each)
        await asyncio.sleep(0.2)

    with ThreadPoolExecutor(1) as apart:
        apart.submit(asyncio.run, run()).result()
    assert silent.said == ['HTTP/1.1 408 Request Timeout', 'closed']
    assert speaks.said == ['HTTP/1.1 408 Request Timeout', 'closed'] and gone.said == []
    assert (first.said, second.said, third.said) == (['gave way'], [], [])
