# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A campaign that is stopped or killed ends its nodes and leaves what was sent."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from weld_twin_lab.campaigns.kill import Trial, try_once

pytest.importorskip('rclpy', reason='needs ROS 2')


pytestmark = pytest.mark.cells

LIMIT = 600.0
"""Seconds after which a wait is given up for lost; what is waited for are events."""
NODES = 7


def marked(mark: str) -> list[int]:
    """Return the living processes that inherited a mark in their environment."""
    found = []
    for entry in Path('/proc').iterdir():
        if entry.name.isdigit():
            try:
                if mark.encode() in (entry / 'environ').read_bytes():
                    found.append(int(entry.name))
            except OSError:  # it has just ended, or is somebody else's
                continue
    return found


def until(condition, what: str) -> None:
    end = time.monotonic() + LIMIT
    while not condition():
        assert time.monotonic() < end, f'waited in vain for {what}'
        time.sleep(0.1)


@pytest.fixture
def in_the_background() -> Iterator[None]:
    """Start processes as a script's job in the background: deaf to SIGINT, unlike a terminal's."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures('in_the_background')
def test_sigterm_ends_the_nodes_too(tmp_path: Path) -> None:
    out = tmp_path / 'soak.json'
    words = ['campaign', 'soak', '--minutes', '5', '--rate', '50', '--out', str(out)]
    mark = f'CAMPAIGN_OF={tmp_path}'
    process = subprocess.Popen(
        [sys.executable, '-m', 'weld_twin_nodes', *words],
        env={**os.environ, 'CAMPAIGN_OF': str(tmp_path)},
    )
    try:
        until(lambda: len(marked(mark)) >= NODES + 1, 'the nodes')
        process.send_signal(signal.SIGTERM)
        assert process.wait(LIMIT) == 130
        until(lambda: not marked(mark), 'the nodes to end')
    finally:
        for pid in marked(mark):
            with suppress(ProcessLookupError):  # it has just ended
                os.kill(pid, signal.SIGKILL)
        process.wait()
    assert not out.exists()


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_a_kill_leaves_a_prefix_of_what_was_sent(storage):
    row = try_once(Trial(storage, moment=1.0, closing=False, split_mb=0.1, wait=0.0))
    assert row['fault'] == ''
    assert row['sent'] > 0
