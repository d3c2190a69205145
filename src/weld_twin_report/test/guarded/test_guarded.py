# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Commands in processes of their own: what goes wrong in one is told, and harms no other."""

import json
import os
import signal
import time
from contextlib import suppress
from pathlib import Path

import pytest

from weld_twin_core.effects import REGISTRY
from weld_twin_report.guarded import Guarded, Limits

BAG = Path(__file__).parents[4] / 'bags/elbow_play'
FEW = ('--exclude-effect', *(REGISTRY.keys() - {'backlash', 'joint_offset'}))
"""Of these commands it matters that they run, not what they look for."""
DIAGNOSE = ('diagnose', BAG, '--robot', 'ur5', *FEW, '--out')


@pytest.fixture(scope='module')
def warm():
    with Guarded() as guarded:
        yield guarded


def children(pid):
    return Path(f'/proc/{pid}/task/{pid}/children').read_text().split()


def test_a_command_runs_and_tells_its_steps(warm, tmp_path):
    steps = []
    done = warm.run([*DIAGNOSE, tmp_path / 'found'], steps.append)
    assert (done.code, done.said) == (0, steps[-1])
    assert steps[0] == f'reading {BAG}' and len(steps) > 3
    assert 50e6 < done.memory < 2e9
    told = json.loads((tmp_path / 'found/diagnosis.json').read_text())
    assert told['verdict']['effects'][0]['effect'] == 'backlash'


def test_a_refusal_is_its_sentence(warm):
    done = warm.run(['bag', '/nowhere/at/all'])
    assert done.code == 2 and "'/nowhere/at/all'" in done.said
    assert warm.run(['bag', '--robots']).code == 0


def test_what_takes_too_much_is_ended_and_the_next_one_runs(warm, tmp_path, monkeypatch):
    for limits, said in (
        (Limits(memory=250_000_000), 'more memory'),
        (Limits(wall_s=0.05), 'more than 0.05 s'),
    ):
        monkeypatch.setattr(warm, '_limits', limits)
        done = warm.run([*DIAGNOSE, tmp_path / 'found'])
        assert done.code != 0 and said in done.said
        assert not (tmp_path / 'found').exists()
    monkeypatch.undo()
    assert warm.run(['bag', '--robots']).code == 0


def test_a_command_that_is_killed_from_outside_is_told_so(warm, tmp_path):
    assert warm.run(['bag', '--robots']).code == 0

    def kill(step):
        os.kill(int(children(warm._process.pid)[0]), signal.SIGKILL)

    done = warm.run([*DIAGNOSE, tmp_path / 'found'], kill)
    assert 'killed from outside' in done.said and '600' not in done.said  # no limit is to blame
    assert warm.run(['bag', '--robots']).code == 0


def test_a_process_that_is_killed_is_told_and_started_again(warm, tmp_path):
    assert warm.run(['bag', '--robots']).code == 0
    killed = warm._process.pid

    def kill(step):
        with suppress(ProcessLookupError):  # a later step, told before
            os.kill(killed, signal.SIGKILL)

    assert 'has ended' in warm.run([*DIAGNOSE, tmp_path / 'found'], kill).said
    assert warm.run(['bag', '--robots']).code == 0
    end = time.monotonic() + 60.0
    while Path(f'/proc/{killed}').exists():
        assert time.monotonic() < end
        time.sleep(0.02)
