# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the campaigns with live nodes count and judge, on cases where the answer is known."""

import json
import os
import time
from importlib import import_module
from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from weld_twin_lab.campaigns import latency
from weld_twin_lab.campaigns.latency import Contender
from weld_twin_lab.campaigns.soak import BEGUN, EACH, cpu_ns, losses, rss_bytes, verdict
from weld_twin_lab.campaigns.soak import table as soak_table
from weld_twin_lab.cli.lab import CAMPAIGNS
from weld_twin_nodes.live.health import Health

ROOT = Path(__file__).parents[4]
RESULTS = ROOT / 'docs/results/robustness'


def test_cpu_time_and_memory_of_this_process_agree_with_its_own_account():
    before, own = cpu_ns(os.getpid()), time.process_time_ns()
    ballast = bytearray(50_000_000)
    ballast[::4096] = b'x' * len(ballast[::4096])
    while time.process_time_ns() - own < 200_000_000:
        pass
    assert cpu_ns(os.getpid()) - before == pytest.approx(time.process_time_ns() - own, rel=0.2)
    assert rss_bytes(os.getpid()) > len(ballast)


def test_one_disturbed_turn_does_not_decide_a_race():
    contender = Contender('x', ('m',), None, ())
    contender.turns = [[100_000] * 100, [110_000] * 100, [9_000_000] * 99]
    contender.cpu, contender.sent = 30_000_000, 300
    result = contender.result()
    assert result['p50_us'] == result['p99_us'] == 110.0
    assert result['p99_all_us'] == 9000.0
    assert result['cpu_us'] == 100.0
    assert result['lost'] == 1


def soak(**change):
    node = {'rss_slope_mib_per_h': 1.0}
    result = {
        'nodes': {'twin': node},
        'health': {'twin: /joint_states': {'refused': 0}},
        'recorded': {topic: {'messages': 5, 'missing': 0} for topic in EACH},
    }
    for key, value in change.items():
        result[key] = {**result[key], **value}
    return result


def test_a_soak_passes_only_flat_and_without_loss():
    assert verdict(soak(), flat=20.0)
    assert not verdict(soak(nodes={'twin': {'rss_slope_mib_per_h': 21.0}}), flat=20.0)
    assert not verdict(soak(health={'x': {'refused': 1}}), flat=20.0)
    assert not verdict(soak(health={'x': {'received': 4, 'missing': 1}}), flat=20.0)
    assert not verdict(soak(recorded={EACH[0]: {'messages': 4, 'missing': 1}}), flat=20.0)
    assert not verdict({**soak(), 'recorded': {}}, flat=20.0)


def test_what_a_bag_lacks_is_counted_by_topic():
    lost = losses(ROOT / 'bags/elbow_play', 226)
    assert lost['/twin/tool_pose'] == {'messages': 225, 'missing': 1}
    assert lost['/deviation'] == {'messages': 225}
    assert 'no bag' in losses(ROOT / 'nowhere', 1)['reason']


def test_the_kept_latency_result_is_within_its_limit():
    kept = json.loads((RESULTS / 'latency.json').read_text())
    worst = max(row[which][key] for row in kept['rates'] for which, key in latency.JUDGED)
    assert [row['rate_hz'] for row in kept['rates']] == list(latency.RATES)
    assert worst == kept['worst_ratio'] <= latency.LIMIT


@pytest.mark.parametrize('name', sorted(CAMPAIGNS))
def test_the_page_shows_the_table_of_the_kept_result(name):
    kept = json.loads((RESULTS / f'{name}.json').read_text())
    table = import_module(f'weld_twin_lab.campaigns.{name}').table(kept)
    assert table.count('|') > 20
    assert table in (ROOT / 'docs/robustness.md').read_text()


def test_a_soak_begins_with_what_a_recorder_tells_and_counts_what_a_node_missed():
    health = Health('/recorder', 1.0)
    health.watch('/deviation', required=True)
    name = health.statuses()[1].name
    assert name == BEGUN
    node = {'cpu_share': 0.1, 'rss_mib': 1.0, 'rss_slope_mib_per_h': 0.0}
    assert soak_table({'health': {name: {'missing': 7}}, 'nodes': {'recorder': node}}).endswith(
        '| 7 |\n'
    )
