# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What goes missing between running nodes is counted and told, by processes that stand still."""

import signal
import time

import numpy as np
import pytest

from weld_twin_msgs_py.messages.topics import JOINT_STATES
from weld_twin_nodes.harness import Cell
from weld_twin_nodes.harness.cell import HealthListener

pytestmark = pytest.mark.cells

S = 1_000_000_000
Q = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
STEP = 4_000_000
"""Stamps of a controller at 250 Hz [ns]."""
KEPT = 200
"""What the queues of this cell keep: eight tenths of a second."""
BURST = 5 * KEPT
"""Sent while a node stands still: more than its queue and the middleware's (512) keep, and within four
seconds, for who stands still for ten is given up."""
SOON = 2.7
"""Seconds within which a node ends that waits 2 s for who stands still."""
TWIN, ANALYZER = 'forward_kinematics_twin', 'deviation_analyzer'


class Bench:
    """A twin and an analyzer in their own processes, and a controller that says what it sent."""

    def __init__(self, cell, robot):
        self.cell, self.robot = cell, robot
        self.begin()
        self.health = HealthListener(cell.node)
        self.poses = cell.collect('/twin/tool_pose')
        self.out = cell.publisher(JOINT_STATES)
        self.stamp, self.sent = S, 0

    def begin(self):
        self.twin, self.analyzer = (
            self.cell.start(
                node,
                qos_overrides={
                    topic: {'subscription': {'reliability': 'best_effort', 'depth': KEPT}}
                },
            )
            for node, topic in ((TWIN, JOINT_STATES.name), (ANALYZER, '/twin/tool_pose'))
        )

    def send(self, count):
        for _ in range(count):
            self.stamp += STEP
            self.sent += 1
            names = self.robot.joint_names
            self.out.publish(self.cell.messages.joint_state(self.stamp, names, Q))

    def values(self, node, topic):
        return self.health.values.get(f'/{node}: {topic}', {})

    def number(self, node, topic, key):
        return int(self.values(node, topic).get(key, 0))

    def lost(self, node, topic):
        return self.number(node, topic, 'lost')

    def apart(self):
        """Return how many poses came here, and are not counted by the analyzer as received."""
        return len(self.poses) - self.number(ANALYZER, '/twin/tool_pose', 'received')

    def unheard(self):
        """Return how many joint states were sent, and are not counted by the twin as received."""
        return self.sent - self.number(TWIN, JOINT_STATES.name, 'received')

    def settled(self, number):
        """Return a number once three reports have left it as it was."""
        seen = [None, 0.0]

        def still():
            if number() != seen[0]:
                seen[:] = [number(), time.monotonic()]
            return time.monotonic() - seen[1] > 3.0

        self.cell.wait(still, 'a number that stays')
        return seen[0]

    def wait_said(self, process, sentence):
        self.cell.wait(lambda: sentence in process.log, sentence)

    def steady(self, count):
        """Send at most in real time: stamps that run ahead of it are those of a clock that was set."""
        last = self.sent + count

        def over():
            self.send(10)
            time.sleep(10 * STEP / S)
            return self.sent >= last

        self.cell.wait(over, 'some time')

    def overrun(self, process, node, topic):
        """Send more than its queue keeps while a node stands still, and on until it hears again."""
        before = self.number(node, topic, 'received')
        process.signal(signal.SIGSTOP)
        self.steady(BURST)
        process.signal(signal.SIGCONT)

        def heard():  # whoever stood still for long on a busy machine has to be met anew
            self.steady(10)
            return self.number(node, topic, 'received') > before

        self.cell.wait(heard, 'the node that stood still')
        self.steady(KEPT // 2)


@pytest.fixture(scope='module')
def bench(tmp_path_factory, robot):
    with Cell(tmp_path_factory.mktemp('losses')) as cell:
        yield Bench(cell, robot)


def test_a_burst_that_overruns_a_node_is_told_with_the_number_and_its_end(bench):
    bench.steady(KEPT)
    topic = JOINT_STATES.name
    # What was sent before the two had met is none of what is lost, be it on a busy machine.
    bench.early = bench.settled(lambda: bench.unheard() - bench.lost(TWIN, topic))
    bench.overrun(bench.twin, TWIN, topic)
    bench.wait_said(bench.twin, 'missing messages, by the gaps between its stamps')
    told = bench.health.told[f'/{TWIN}']
    due = 'one is due every 4 ms'
    bench.cell.wait(lambda: any(due in text for level, text in told if level == 'warn'), due)


def test_what_one_node_of_the_project_sends_and_another_does_not_get_is_counted(bench):
    topic = '/twin/tool_pose'
    # One of the two may have met the twin a little later, and a burst of it may have been too much.
    before = bench.settled(lambda: bench.apart() - bench.lost(ANALYZER, topic))
    had = bench.lost(ANALYZER, topic)
    bench.overrun(bench.analyzer, ANALYZER, topic)
    bench.wait_said(bench.analyzer, f'messages that /{TWIN} sent did not arrive')

    def counted():  # the tap of this process keeps up, and has all that was sent
        return bench.lost(ANALYZER, topic) == bench.apart() - before > had

    bench.cell.wait(counted, 'the number')


def test_the_end_of_a_loss_is_told_with_what_is_missing_in_all(bench):
    topic = JOINT_STATES.name

    def over():
        # Each loss is told when it begins and when it is over, however many a busy machine has.
        log, lost = bench.twin.log, bench.lost(TWIN, topic)
        all_there = lost == bench.unheard() - bench.early > BURST // 4
        ends = log.count(f'{topic}: no more messages go missing')
        return (
            all_there
            and ends == log.count('by the gaps') > 0
            and f'no more messages go missing; {lost:,} are missing in all' in log
        )

    bench.cell.wait(over, lambda: f'the end: {bench.unheard()}, {bench.values(TWIN, topic)}')


def ended(process):
    """Return how long a process takes to end when it is asked to [s]."""
    begun = time.monotonic()
    process.interrupt()
    assert process.end() == 0
    return time.monotonic() - begun


def longer_for_it(bench):
    """Return how much longer the twin takes to end with an analyzer that stands still [s]."""
    bench.analyzer.signal(signal.SIGSTOP)
    bench.send(100)
    try:
        spent = ended(bench.twin)
    finally:
        bench.analyzer.signal(signal.SIGCONT)
    assert 'without waiting for it any longer' in bench.twin.log
    # How long a node takes to end with nobody in its way is the machine's own, and its load's.
    return spent - ended(bench.analyzer)


def test_a_node_ends_soon_though_who_listens_to_it_stands_still(bench):
    longer = longer_for_it(bench)
    for _ in range(9):  # a busy machine makes an end longer, and none shorter
        if longer < SOON:
            break
        bench.begin()
        bench.cell.meet()
        bench.steady(KEPT)
        longer = longer_for_it(bench)
    assert longer < SOON
