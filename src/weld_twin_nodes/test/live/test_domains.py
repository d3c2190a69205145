# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Two cells of one machine never share a ROS domain, and none is put among somebody else's nodes."""

import os
import subprocess
import sys
import tempfile
from contextlib import ExitStack

import pytest
from participants import participant

from weld_twin_nodes.harness.process import DOMAINS, own_domain

pytestmark = pytest.mark.cells

OTHER = 102
"""A domain that no cell of a test is given."""

HOLD = """
import os, sys
os.getpid = lambda: int(sys.argv[1])
from weld_twin_nodes.harness.process import own_domain
with own_domain() as domain:
    print(domain, flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def same_start(monkeypatch):
    """All processes of a test begin to look at one domain, as those do whose numbers are so apart."""
    number = os.getpid()
    monkeypatch.setattr(os, 'getpid', lambda: number)
    return number


def test_another_process_has_another_domain_which_is_free_again_once_that_is_killed(
    same_start, tmp_path
):
    """Its folder for temporary files is another, too, as it is for other users."""
    assert str(tmp_path) != tempfile.gettempdir()
    for _ in range(5):  # somebody else on this machine may take it first
        other = subprocess.Popen(
            [sys.executable, '-c', HOLD, str(same_start)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, 'TMPDIR': str(tmp_path)},
        )
        theirs = int(other.stdout.readline())
        try:
            with own_domain() as ours:
                assert ours != theirs
        finally:
            other.kill()
            other.communicate()
        with own_domain() as ours:
            if ours == theirs:
                return
    pytest.fail('no domain of a holder that was killed was given again')


@pytest.mark.parametrize('elsewhere', [0, 6])
def test_a_domain_in_which_somebody_speaks_who_holds_no_lock_is_passed_over(same_start, elsewhere):
    with ExitStack() as strangers:
        for _ in range(elsewhere):  # a process numbers its participants of all domains in one row
            strangers.enter_context(participant('stranger', OTHER))
        with own_domain() as free:
            pass
        strangers.enter_context(participant('stranger', free))
        with own_domain() as ours:
            assert ours in DOMAINS
            assert ours != free
