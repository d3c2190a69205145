# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a node tells of its inputs, look by look."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from weld_twin_core import DataError, load
from weld_twin_msgs_py.assembly.joint_states import JointStates
from weld_twin_msgs_py.messages.to_messages import bag_messages
from weld_twin_msgs_py.messages.topics import BY_NAME
from weld_twin_nodes.live.deviation_markers import DeviationLines, colors
from weld_twin_nodes.live.goals import GoalAudit
from weld_twin_nodes.live.health import ERROR, OK, STALE, WARN, Health, Input
from weld_twin_nodes.live.telling_node import OVER, Losses

CONFIG = Path(__file__).parents[4] / 'src/weld_twin_nodes/config'
ROBOT = load('ur5')
NAMES = ROBOT.joint_names
Q = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
NS = 5_000_000_000


@pytest.fixture
def clock(monkeypatch):
    """Time in the hand of the test [s]."""
    now = [100.0]
    monkeypatch.setattr('weld_twin_nodes.live.health.time.monotonic', lambda: now[0])
    return now


class Watched:
    """One input, a second at a time."""

    def __init__(self, clock, **options):
        self.clock = clock
        self.health = Health('twin', 1.0)
        self.input = self.health.watch('/joint_states', **{'required': True, **options})

    def second(self, received=0, refused=0, others=0, reason=''):
        self.clock[0] += 1.0
        if received:
            self.input.last = self.clock[0] - 0.01
        self.input.received += received
        self.input.refused += refused
        self.input.others += others
        self.input.last_reason = reason or self.input.last_reason
        status = self.health.statuses()[1]
        assert status.name == 'twin: /joint_states'
        return status.level, status.message


def test_an_input_goes_from_nothing_over_good_and_bad_to_silence_and_back(clock):
    watched = Watched(clock)
    assert watched.second() == (STALE, 'nothing received yet')
    for _ in range(4):
        assert watched.second(500) == (OK, '500/s')
    assert watched.second(500, refused=100, reason='NaN') == (WARN, '100 of 500 refused: NaN')
    assert watched.second(500, refused=500) == (ERROR, '500 of 500 refused: NaN')
    assert watched.second(500, others=500)[0] == WARN
    assert watched.second(50) == (WARN, '50/s where 500/s is usual')
    assert watched.second(5000) == (WARN, '5000/s where 500/s is usual')
    assert watched.second()[0] == STALE
    assert watched.second() == (STALE, 'silent for 2.0 s')
    assert watched.second(500) == (OK, '500/s')


def test_a_second_publisher_of_the_same_is_told_and_one_of_other_joints_is_not(clock):
    watched = Watched(clock)
    watched.input.publishers = 2
    assert watched.second(200) == (WARN, '2 publishers send the same')
    assert watched.second(200, others=100) == (OK, '200/s')


def test_an_input_nobody_needs_may_be_missing_and_slow_ones_are_waited_for(clock):
    assert Watched(clock, required=False).second() == (OK, 'not in use')
    rare = Watched(clock, required=False, steady=False)
    assert rare.second(1)[0] == OK
    for _ in range(60):
        assert rare.second()[0] == OK


def test_a_thermometer_read_every_ten_seconds_is_silent_when_it_misses_one(clock):
    watched = Watched(clock, required=False)
    told = []
    for _ in range(4):
        watched.input.arrived()
        told.append([watched.second()[0] for _ in range(10)])
    assert STALE in told[0]  # nobody knows yet that it is slow
    assert set(told[3]) == {OK}
    for _ in range(9):
        assert watched.second()[0] == OK
    assert watched.second()[0] == OK
    assert watched.second()[0] == STALE


def test_the_node_itself_tells_what_lasts_each_time_and_what_happened_once():
    health = Health('twin', 1.0)
    health.lasting['/x'] = 'nobody hears'
    health.say('nobody hears')
    health.say('time went back')
    assert health.statuses()[0][:3] == ('twin', WARN, 'nobody hears; time went back')
    assert health.statuses()[0][:3] == ('twin', WARN, 'nobody hears')
    health.lasting.clear()
    assert health.statuses()[0][:3] == ('twin', OK, 'running')


def state(names, q, ns=NS, qd=None):
    return bag_messages().joint_state(ns, list(names), np.asarray(q), qd)


def test_a_loss_is_told_with_its_number_and_at_its_end_or_that_of_the_node():
    state = Input('/joint_states', True, 1.0)
    losses, came = Losses(state), [k for k in range(1000) if not 500 <= k < 600]
    for k in came:
        state.stamps.add(NS + 4_000_000 * k, 0.004 * k)
    assert losses.ended() == []
    told = losses.look(4.0) + losses.look(5.0)
    assert told == [losses.telling] and '100 missing messages' in losses.telling
    assert 'one is due every 4 ms' in losses.telling
    assert losses.ended() == ['/joint_states: 100 messages are missing in all']
    over = losses.look(4.1 + OVER)
    assert over == ['/joint_states: no more messages go missing; 100 are missing in all']
    assert losses.ended() == []


def test_a_goal_that_goes_nowhere_is_warned_of_and_what_becomes_of_others_is_no_warning():
    levels, told, sent = [], [], []
    logger = SimpleNamespace(
        warning=lambda _: levels.append('warning'), info=lambda _: levels.append('info')
    )
    node = SimpleNamespace(
        offer=lambda *_, **__: SimpleNamespace(publish=lambda each: sent.append(each.data)),
        setting=lambda _: '',
        get_logger=lambda: logger,
        health=SimpleNamespace(say=told.append),
    )
    audit = GoalAudit(node)
    audit.settle('m', None, 'passed', '')
    audit.settle('m', None, 'refused', 'too far')
    audit.settle('m', None, 'corrected', '', below='no controller')
    assert levels == ['info', 'warning', 'warning']
    assert told == ['goal refused: too far', 'goal rejected by the controller: no controller']
    assert [json.loads(line)['why'] for line in sent] == ['', 'too far', 'no controller']


def test_joints_spread_over_publishers_are_put_together_by_equal_stamps():
    joints = JointStates(ROBOT)
    with pytest.raises(DataError, match="no joint 'wrist_1_joint'"):
        joints.take(state(NAMES[:3], Q[:3]))
    out = [joints.take(state(NAMES[3:][::-1], Q[3:][::-1], qd=np.ones(3)))]
    out += [joints.take(state(NAMES[k : k + 3], Q[k : k + 3], NS + 1)) for k in (0, 3)]
    assert [sample and sample.stamp for sample in out] == [NS, None, NS + 1]
    for sample in (out[0], out[2]):
        assert sample.qd is None
        np.testing.assert_array_equal(sample.q, Q)
    assert joints.parts == 1


def test_deviations_are_drawn_at_their_place_magnified_and_by_colour():
    lines = DeviationLines(magnification=100.0, tolerance=1e-3, spacing=0.01, points=3)
    for k in range(6):
        lines.measured(k, np.array([0.005 * k, 0.0, 1e-3]))
        lines.deviation(k, np.array([0.0, 0.0, 1e-3]))
    lines.deviation(99, np.ones(3))
    seam, strokes = lines.drawn()
    np.testing.assert_allclose(seam.points[:, 0], [0.0, 0.01, 0.02])
    np.testing.assert_allclose(seam.points[:, 2], 0.0, atol=1e-15)
    np.testing.assert_allclose(strokes.points[1::2] - strokes.points[::2], [[0, 0, 0.1]] * 3)
    np.testing.assert_allclose(seam.colors, [[1.0, 0.0, 0.0]] * 3)
    np.testing.assert_allclose(colors(np.array([0.0, 0.5])), [[0, 1, 0], [1, 1, 0]])


def test_the_views_show_topics_that_exist():
    rviz = yaml.safe_load((CONFIG / 'cell.rviz').read_text())
    shown = {
        item[key]['Value']
        for item in rviz['Visualization Manager']['Displays']
        for key in ('Topic', 'Description Topic')
        if key in item
    }
    layout = json.loads((CONFIG / 'cell.foxglove.json').read_text())
    panels = layout['configById']
    shown |= set(panels['3D!cell']['topics']) | {panels['RawMessages!verdict']['topicPath']}
    shown |= {'/' + p['value'].split('.')[0][1:] for p in panels['Plot!deviation']['paths']}
    assert len(shown) == 7
    assert shown <= set(BY_NAME)
