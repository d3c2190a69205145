# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Nodes as programs, in domains of their own: how they start, stop, die, and what is kept then."""

import os
import signal
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from participants import participant
from rosgraph_msgs.msg import Clock

from weld_twin_core.errors import ModelError, TwinError
from weld_twin_msgs_py.bags import BagReader
from weld_twin_msgs_py.messages import from_messages
from weld_twin_nodes.harness import CellTimeout
from weld_twin_nodes.harness.process import DOMAINS, own_domain
from weld_twin_nodes.live.deviation_analyzer import DeviationAnalyzer
from weld_twin_nodes.live.error_injector import ErrorInjector
from weld_twin_nodes.live.forward_kinematics_twin import ForwardKinematicsTwin
from weld_twin_nodes.live.recorder import Recorder
from weld_twin_nodes.live.trajectory_generator import TrajectoryGenerator

pytestmark = pytest.mark.cells

S = 1_000_000_000


def wait_for_nodes(cell, names):
    cell.wait(lambda: set(names) <= set(cell.node.get_node_names()), f'{names} to be up')


OWN_WAYS = ('recorder', 'live_diagnosis')
"""Nodes that do more at their end than the others: one completes a bag, one has a process."""


def test_nodes_end_quietly_when_told_to_end(cell, tmp_path):
    """Ctrl-C ends all of them quietly, as they are installed: `test/install/test_colcon.py`."""
    processes = [
        cell.start(name, **({'out': str(tmp_path / 'bag')} if name == 'recorder' else {}))
        for name in OWN_WAYS
    ]
    wait_for_nodes(cell, OWN_WAYS)
    cell.trigger('/recorder/counts')
    for process in processes:
        process.signal(signal.SIGTERM)
    assert [process.end() for process in processes] == [0] * len(processes)
    for process in processes:
        assert 'Traceback' not in process.log, process.log
    assert (tmp_path / 'bag' / 'metadata.yaml').is_file()


TOLD_WHILE_A_CLASS_IS_MADE = """
import os, signal, sys
from weld_twin_nodes.live.recorder import Recorder
from weld_twin_nodes.live.run_node import run
TOLD = 'os.kill(os.getpid(), signal.SIGTERM); import json'
raise SystemExit(run(lambda: [*map(exec, [TOLD] * int(sys.argv[1])), Recorder()].pop()))
"""


@pytest.mark.parametrize('times', [1, 2])
def test_a_program_told_to_end_while_its_node_is_made_ends_quietly(tmp_path, times):
    """The node is made, and ends as any other does; told again, the program does not wait for it."""
    program = tmp_path / 'program.py'
    program.write_text(TOLD_WHILE_A_CLASS_IS_MADE)
    command = [sys.executable, '-m', program.stem, str(times)]  # as a node is started
    command += ['--ros-args', '-p', 'out:=bag', '-p', "topics:=['/joint_states']"]
    done = subprocess.run(command, check=False, capture_output=True, cwd=tmp_path)
    assert done.returncode == 0
    assert b'Traceback' not in done.stderr
    assert (tmp_path / 'bag/metadata.yaml').exists() == (times == 1)
    assert not (tmp_path / 'bag.unfinished').exists()


def test_a_recorder_that_cannot_record_leaves_nothing(cell, tmp_path):
    for wrong, sentence in (
        ({'topics': ['not a topic']}, "'not a topic' is no name"),
        ({'storage': 'tape'}, "got 'tape'"),
    ):
        with pytest.raises(TwinError, match=sentence):
            cell.add(Recorder, out=str(tmp_path / 'bag'), **wrong)
    assert not list(tmp_path.glob('*bag*'))


def test_simulated_time_drives_the_generator(cell):
    moving = {'profile': 'aggressive', 'rate': 100.0, 'wait_for_subscribers': 1}
    cell.add(TrajectoryGenerator, use_sim_time=True, **moving)
    states = cell.collect('/joint_states')
    clock = cell.node.create_publisher(Clock, '/clock', 10)
    cell.wait(lambda: clock.get_subscription_count() > 0, 'a subscriber of /clock')
    told = [5 * S]

    def tick(step):
        def condition_of(wanted):
            def condition():
                clock.publish(Clock(clock=cell.messages.time(told[0])))
                return len(states) >= wanted

            return condition

        told[0] += step
        return condition_of

    cell.wait(tick(0)(1), 'the first joint state')
    first = states.stamps[0]
    assert first >= 5 * S
    cell.wait(tick(S // 5)(15), 'joint states of a fifth of a second')
    assert states.stamps[-1] <= told[0]
    spacing = np.diff(states.stamps)
    np.testing.assert_array_equal(spacing, 10_000_000)


def test_the_harness_says_which_node_died_and_why(cell):
    cell.start('error_injector', robot='ur99')
    with pytest.raises(CellTimeout, match=r"(?s)error_injector, ended with 2.*'ur99'"):
        cell.wait(lambda: False, 'what cannot happen')
    cell.processes.clear()


def test_a_remap_onto_what_the_node_has_already_is_refused(cell):
    itself, another = 'which this node publishes itself', 'which is another input of this'
    for kind, remap, sentence in (
        (ForwardKinematicsTwin, 'joint_states:=twin/tool_pose', itself),
        (ErrorInjector, 'actual/joint_states:=joint_states', itself),
        (DeviationAnalyzer, 'measured/tool_pose:=twin/tool_pose', another),
    ):
        with pytest.raises(ModelError, match=sentence):
            kind(context=cell.node.context, cli_args=['--ros-args', '-r', remap])


def test_a_bag_is_played_into_the_cell(cell, robot):
    bag = Path(__file__).parents[4] / 'bags/elbow_play'
    cell.add(DeviationAnalyzer, reliable_inputs=True)
    deviations = cell.collect('/deviation')
    with BagReader(bag) as reader:
        recorded = [m for _, _, _, m in reader.messages(['/deviation'])]
    cell.play(bag, ['/measured/tool_pose', '/twin/tool_pose'], speed=8.0)
    cell.wait(lambda: len(deviations) == len(recorded), 'every deviation')
    np.testing.assert_allclose(
        [from_messages.vector3(m) for m in deviations.messages],
        [from_messages.vector3(m) for m in recorded],
        rtol=0.0,
        atol=1e-15,
    )


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
