# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""All nodes together for a long time; what their processes, health topic and bag tell."""

from __future__ import annotations

import os
import time
from collections import defaultdict
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.bags import BagReader
from weld_twin_nodes.cli.given import Given
from weld_twin_nodes.harness import Cell
from weld_twin_nodes.harness.cell import HealthListener
from weld_twin_nodes.offline.seam_motion import plan_motion

from ..study import shown, tabled

PROC = Path('/proc')
PAGE = os.sysconf('SC_PAGE_SIZE')


def cpu_ns(pid: int) -> int:
    """Return the time a process has been on a CPU, all threads that live [ns]."""
    total = 0
    for task in (PROC / str(pid) / 'task').iterdir():
        with suppress(OSError):  # the thread has ended
            total += int((task / 'schedstat').read_text().split()[0])
    return total


def rss_bytes(pid: int) -> int:
    return int((PROC / str(pid) / 'statm').read_text().split()[1]) * PAGE


def children(pid: int) -> list[int]:
    out: list[int] = []
    for task in (PROC / str(pid) / 'task').iterdir():
        with suppress(OSError):
            out += map(int, (task / 'children').read_text().split())
    return out


MIB = 2.0**20
"""Bytes."""
ROBOT, PATH = 'ur5', 'polyline'
BEGUN = '/recorder: /deviation'
"""Status of the last node's input, which brings something once the cell works."""
COMPLETE = 300.0
"""Seconds the recorder has to complete its bag."""
SPLIT = 300.0
"""Seconds a file of the bag spans."""
EACH = ('/joint_states', '/actual/joint_states', '/measured/tool_pose', '/twin/tool_pose')
"""Topics with one message for each joint state."""
COUNTED = (*EACH, '/deviation')
"""Inputs of which a node should have had as many messages as joint states were sent."""


class Usage(NamedTuple):
    """Time since the start [s], resident memory [bytes] and time on a CPU [ns] of a process."""

    t: float
    rss: int
    cpu: int


class Soak:
    """All nodes of a cell in processes of their own."""

    def __init__(self, cell: Cell, bag: Path, rate: float, seconds: float) -> None:
        self._cell, self._rate = cell, rate
        samples = plan_motion(catalog.load(ROBOT), PATH, rate=rate).motion.t.size
        rounds = max(round(seconds * rate / samples), 1)
        self.sent = rounds * samples
        self.samples: dict[str, list[Usage]] = defaultdict(list)
        self._work: dict[int, Usage] = {}
        self._listener = HealthListener(cell.node)
        sure = {'reliable_inputs': True}
        cell.start('recorder', out=str(bag), split_duration=SPLIT, **sure)
        cell.start('live_diagnosis', **sure)
        cell.start('deviation_markers', **sure)
        cell.start('deviation_analyzer', wait_for_subscribers=1, **sure)
        cell.start('forward_kinematics_twin', wait_for_subscribers=2, **sure)
        cell.start('error_injector', effects=EFFECTS, seed=1, wait_for_subscribers=2, **sure)
        cell.start(
            'trajectory_generator',
            rate=rate,
            repeat=rounds,
            path=PATH,
            robot=ROBOT,
            wait_for_subscribers=4,
            **sure,
        )
        node = cell.node
        cell.wait(lambda: node.count_publishers('/diagnostics') == len(cell.processes), 'all')

    def run(self, every: float, tell: Callable[[str], None]) -> None:
        """Let the cell work to the end of the motion; look at its processes now and then."""
        heard = self._listener.values
        self._cell.wait(lambda: int(heard.get(BEGUN, {}).get('received', 0)) > 0, 'the motion')
        begin = time.monotonic()
        self._listener.clear()
        due = every
        while due <= self.sent / self._rate:
            end = begin + due
            self._cell.wait(lambda: time.monotonic() >= end, 'the next look', every + 60.0)  # noqa: B023
            self._look(time.monotonic() - begin)
            if round(due / every) % 12 == 0:
                tell(self._line(due))
            due += every
        self._reported = {name: list(entries) for name, entries in self._listener.told.items()}
        end = time.monotonic() + COMPLETE
        self._cell.wait(
            lambda: self._least() >= self.sent or time.monotonic() > end,
            'the rest',
            2.0 * COMPLETE,
        )
        quiet = time.monotonic() + 3.0
        self._cell.wait(lambda: time.monotonic() > quiet, 'the last word on health')

    def _least(self) -> int:
        """Return how many messages came through where fewest did."""
        return min(
            int(values['received'])
            for name, values in self._listener.values.items()
            if name.partition(': ')[2] in COUNTED
        )

    def _look(self, t: float) -> None:
        for process in self._cell.processes:
            usage = Usage(t, rss_bytes(process.pid), cpu_ns(process.pid))
            self.samples[process.name].append(usage)
            for child in children(process.pid):
                with suppress(OSError):  # it has just ended
                    self._work[child] = Usage(t, rss_bytes(child), cpu_ns(child))

    def _line(self, t: float) -> str:
        now = ' '.join(f'{name}:{s[-1].rss / MIB:.0f}' for name, s in self.samples.items())
        return f'{t / 60.0:5.1f} min, MiB {now}'

    def usage(self, warm: float) -> dict[str, dict[str, float]]:
        out = {}
        for name, samples in self.samples.items():
            t, rss, cpu = np.array(samples, dtype=np.float64).T
            late = t > warm * t[-1]
            slope = np.polyfit(t[late], rss[late], 1)[0] if late.sum() > 2 else 0.0
            out[name] = {
                'cpu_share': round(float((cpu[-1] - cpu[0]) / (t[-1] - t[0])) * 1e-9, 4),
                'rss_mib': round(float(rss[-1]) / MIB, 1),
                'rss_first_mib': round(float(rss[late][0]) / MIB, 1),
                'rss_slope_mib_per_h': round(float(slope) * 3600.0 / MIB, 2),
            }
        spent = sum(usage.cpu for usage in self._work.values())
        span = next(iter(self.samples.values()))[-1].t
        out['live_diagnosis workers'] = {
            'cpu_share': round(spent * 1e-9 / span, 4),
            'runs': len(self._work),
            'rss_mib': round(max((u.rss for u in self._work.values()), default=0) / MIB, 1),
            'rss_slope_mib_per_h': 0.0,
        }
        return out

    def health(self) -> dict[str, Any]:
        out: dict[str, Any] = {}
        for name, values in sorted(self._listener.values.items()):
            said = [text for level, text in self._reported.get(name, []) if level != 'ok']
            row: dict[str, int] = {}
            row |= {key: int(values[key]) for key in ('received', 'refused') if key in values}
            if name.partition(': ')[2] in COUNTED:
                row['missing'] = self.sent - row['received']
            out[name] = {**row, 'not_ok': len(said), 'worst': sorted(set(said))[:5]}
        return out


def losses(bag: Path, sent: int) -> dict[str, Any]:
    """Return how many messages of each topic the bag holds and lacks of those that were sent."""
    try:
        with BagReader(bag) as reader:
            counts = {topic: count for topic, (_, count) in reader.topics.items()}
    except TwinError as error:
        return {'reason': str(error)}
    return {
        topic: {'messages': count, **({'missing': sent - count} if topic in EACH else {})}
        for topic, count in counts.items()
    }


def verdict(result: dict[str, Any], flat: float) -> bool:
    """Tell whether no node lost or refused anything and every node's memory is flat."""
    inputs = result['health'].values()
    return (
        all(result['recorded'].get(topic, {}).get('missing') == 0 for topic in EACH)
        and all(node['rss_slope_mib_per_h'] <= flat for node in result['nodes'].values())
        and all(row.get('refused', 0) == row.get('missing', 0) == 0 for row in inputs)
    )


EVERY = 5.0
"""Seconds between two looks at the processes."""
WARM = 0.2
"""Part of the run that is left out of the slope of the memory: buffers fill, caches grow."""
FLAT = 20.0
"""Largest slope of a node's memory [MiB/h] that passes."""
EFFECTS = """
- {effect: backlash, joint: shoulder_pan_joint, width: 8e-4}
- {effect: joint_offset, joint: elbow_joint, offset: 3e-4}
- {effect: measurement_noise, sigma: 2e-5}
"""


def run(args: Given, tell: Callable[[str], None]) -> dict[str, Any]:
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: args.cores])
    with TemporaryDirectory() as folder:
        bag = Path(folder) / 'bag'
        with Cell(Path(folder) / 'cell') as cell:
            soak = Soak(cell, bag, args.rate, args.minutes * 60.0)
            soak.run(EVERY, tell)
            health, nodes = soak.health(), soak.usage(WARM)
            recorder = cell.processes[0]
            recorder.interrupt()
            recorder.end(COMPLETE)
            lost = losses(bag, soak.sent)
    result = {
        'minutes': round(soak.sent / args.rate / 60.0, 2),
        'rate_hz': args.rate,
        'sent': soak.sent,
        'cores': args.cores,
        'nodes': nodes,
        'health': health,
        'recorded': lost,
        'cpu_share_total': round(sum(node['cpu_share'] for node in nodes.values()), 3),
    }
    return {'passed': verdict(result, FLAT), **result}


def table(result: dict[str, Any]) -> str:
    """Return a row for each node; what it missed is over all its inputs."""

    def missed(node: str) -> int:
        return sum(
            row.get('missing', 0)
            for name, row in result['health'].items()
            if name.partition(': ')[0].lstrip('/') == node
        )

    columns: dict[str, Callable[[Any], object]] = {
        'node': lambda row: row[0].replace('_', ' '),
        'share of a core': shown(1, 'cpu_share', by='{:.0f} %', times=100.0),
        'memory': shown(1, 'rss_mib', by='{:.0f} MiB'),
        'its slope': shown(1, 'rss_slope_mib_per_h', by='{:+.1f} MiB/h'),
        'messages missed': lambda row: missed(row[0]),
    }
    return tabled(columns, result['nodes'].items())
