# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The server as people use it: Chromium from drop to sheet, two users, a kill and a new start."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest

for needed in ('fastapi', 'uvicorn', 'python_multipart', 'sqlalchemy'):
    pytest.importorskip(needed, reason="the server is an extra: pip install 'weld-twin[serve]'")

BAG = Path(__file__).parents[2] / 'bags/elbow_play'


class Server:
    """A server in a process of its own."""

    def __init__(self, folder, *words):
        self.words = [sys.executable, '-m', 'weld_twin_nodes', 'serve', '--port', '0', *words]
        self.words += ['--dir', str(folder)]
        self.start()

    def start(self):
        self.process = subprocess.Popen(self.words, stdout=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().removeprefix('open ').strip()
        assert self.address.startswith('http://'), self.process.wait()
        self.root = re.match(r'http://[^/]+', self.address)[0]

    def kill(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        self.process.stdout.close()

    def get(self, path='/', *, data=None, **headers):
        """Return status and text of an answer."""
        request = urllib.request.Request(self.root + path, data=data)
        for name, value in headers.items():
            request.add_header(name.replace('_', '-'), value)
        try:
            with urllib.request.urlopen(request, timeout=20) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as error:
            return error.code, error.read().decode()


@pytest.fixture(scope='module')
def server(tmp_path_factory):
    made = Server(tmp_path_factory.mktemp('served'))
    yield made
    made.kill()


def form(robot='ur5', files=(('data.csv', b'a,b\n1,2\n'),), **fields):
    """Return the body of a form and its type."""
    parts = []
    for name, value in {'robot': robot, **fields}.items():
        parts.append(f'Content-Disposition: form-data; name="{name}"\r\n\r\n{value}'.encode())
    for name, content in files:
        head = f'Content-Disposition: form-data; name="files"; filename="{name}"\r\n'
        parts.append((head + 'Content-Type: application/octet-stream\r\n\r\n').encode() + content)
    body = b''.join(b'--edge\r\n' + part + b'\r\n' for part in parts) + b'--edge--\r\n'
    return body, 'multipart/form-data; boundary=edge'


def drop(server, **how):
    body, kind = form(**how)
    return server.get('/recordings', data=body, Content_Type=kind)


def bag_files():
    return sorted(str(file) for file in BAG.iterdir())


def until(page, selector, seconds=60):
    page.wait_for_selector(selector, timeout=1000 * seconds)
    return page.locator(selector)


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


def test_from_drop_to_sheet_and_into_a_history_of_ones_own(server, chromium):
    mine, other = chromium.new_context(), chromium.new_context()
    page = mine.new_page()
    console = []
    page.on('console', lambda message: console.append(message.text))
    page.goto(server.address)
    drop_in(page, bag_files(), '2026-03-02')
    # The robot was forgotten: it is asked for, and the recording need not come again.
    assert 'Which robot is it?' in until(page, '#refused').inner_text()
    page.select_option('#robot', 'ur5')
    page.get_by_role('button', name='Try again').click()
    until(page, 'iframe')
    assert 'elbow_play' in page.frame_locator('iframe').locator('.subject').inner_text()
    sheet = page.frame_locator('iframe').locator('h1')
    assert 'backlash of elbow_joint' in sheet.inner_text()
    address = page.url
    with page.expect_download() as fetched:
        page.get_by_text('the diagnosis as data').click()
    assert '"status": "identified"' in fetched.value.path().read_text()
    the_history_grows(page, server)
    page.goto(server.root + '/recordings')
    assert page.locator('#mine tbody tr').count() == 2
    # Nobody else sees any of it, with its address either.
    theirs = other.new_page()
    theirs.goto(server.address)
    for path in (address, f'{address}/report.html', f'{address}/diagnosis.json'):
        assert theirs.goto(path).status == 404
    theirs.goto(server.root + '/history')
    assert 'Nothing yet' in theirs.locator('#message').inner_text()
    assert console == []
    mine.close()
    other.close()


def test_what_the_gate_asks_is_answered_in_the_browser(server, chromium, tmp_path):
    """A table with two joints swapped: the page says so, and one click corrects it."""
    lines = ['J1,J2,J3,J4,J5,J6,X,Y,Z']
    import numpy as np

    from weld_twin_core.arm import catalog
    from weld_twin_core.recording import JointMotion, Recording
    from weld_twin_core.twin.twin import Twin

    robot = catalog.load('ur5')
    rng = np.random.default_rng(4)
    q = np.array([0.3, -1.2, 1.4, -1.0, -1.5, 0.2]) + 0.4 * rng.standard_normal((60, 6))
    t = np.arange(60.0)
    poses = Twin(robot).poses(Recording('made', JointMotion(t, q, None, True)), t)
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


def test_who_does_not_come_from_a_page_of_ours_changes_nothing(server):
    assert server.get('/')[0] == 200
    assert server.get('/', Host='evil.example')[0] == 403
    body, kind = form()
    for headers in (
        {'Origin': 'http://evil.example'},
        {'Origin': 'null'},
        {'Sec_Fetch_Site': 'cross-site'},
    ):
        assert server.get('/recordings', data=body, Content_Type=kind, **headers)[0] == 403
    assert server.get('/recordings/../../etc/passwd')[0] == 404
    assert server.get('/recordings/0/%2e%2e%2fjob.json')[0] == 404
    assert server.get('/docs')[0] == 404


@pytest.mark.parametrize(
    ('how', 'said'),
    [
        ({'files': ()}, 'Choose a recording first'),
        ({'files': [('x.exe', b'MZ')]}, 'neither a bag, a table nor a robot file'),
        ({'files': [('a.csv', b''), ('A/a.csv', b'')]}, 'same name'),
        ({'files': [('metadata.yaml', b'')]}, 'No recording is among these'),
        ({'files': [(f'{k}.mcap', b'') for k in range(30)]}, ''),
        ({'robot': '/etc/passwd'}, 'is none of those bundled'),
        ({'align': '--out'}, '“What is not known?” cannot be'),
        ({'at': 'Monday'}, 'is no date'),
    ],
)
def test_what_is_no_recording_is_refused_in_a_sentence(server, how, said):
    status, text = drop(server, **how)
    assert status in (400, 422) and said in text


def test_a_token_is_needed_where_others_can_come_and_uploads_are_bounded(tmp_path):
    made = Server(tmp_path, '--host', '127.0.0.2', '--upload', '0.0001')
    try:
        assert '?token=' in made.address
        assert made.get('/')[0] == 401
        assert made.get('/?token=wrong')[0] == 401
        token = made.address.partition('token=')[2]
        assert made.get('/', Authorization=f'Bearer {token}')[0] == 200
        body, kind = form(files=[('big.mcap', bytes(200_000))])
        told = {'Content_Type': kind, 'Authorization': f'Bearer {token}'}
        assert made.get('/recordings', data=body, **told)[0] == 413
        assert list((tmp_path / 'jobs').iterdir()) == []
    finally:
        made.kill()


def test_a_kill_loses_no_verdict_and_what_waited_goes_on(tmp_path, chromium):
    made = Server(tmp_path)
    try:
        context = chromium.new_context()
        page = context.new_page()
        page.goto(made.address)
        addresses = []
        for _ in range(2):
            page.goto(made.root)
            page.set_input_files('#files', bag_files())
            page.select_option('#robot', 'ur5')
            page.get_by_role('button', name='Diagnose').click()
            page.wait_for_url('**/recordings/*')
            addresses.append(page.url.removeprefix(made.root))
        page.goto(made.root + addresses[0])
        until(page, 'iframe')
        made.kill()
        first = tmp_path / 'jobs' / addresses[0].rsplit('/', 1)[-1]
        before = (first / 'found/diagnosis.json').stat().st_mtime_ns
        made.start()
        page.goto(made.root + addresses[0])
        assert page.locator('iframe').count() == 1
        assert (first / 'found/diagnosis.json').stat().st_mtime_ns == before
        page.goto(made.root + addresses[1])
        until(page, 'iframe')
        context.close()
    finally:
        made.kill()
    time.sleep(0.2)
    left = [
        pid
        for pid in os.listdir('/proc')
        if pid.isdigit() and str(tmp_path).encode() in _command(pid)
    ]
    assert left == []
    shutil.rmtree(tmp_path)


def _command(pid):
    try:
        return Path(f'/proc/{pid}/cmdline').read_bytes()
    except OSError:
        return b''
