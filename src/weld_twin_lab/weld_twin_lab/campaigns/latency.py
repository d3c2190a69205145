# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Contenders in processes of their own take turns at one beat; their latency and CPU time."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from copy import copy
from pathlib import Path
from struct import unpack_from
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from weld_twin_core.arm import catalog
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.files.yaml_file import yaml_text
from weld_twin_msgs_py.messages.cdr import HEADER, JointStateEncoder
from weld_twin_msgs_py.messages.topics import JOINT_STATES, POSE_OUT, TWIN_POSE
from weld_twin_nodes.cli.given import Given
from weld_twin_nodes.harness.process import own_domain
from weld_twin_nodes.live.diagnosis_worker import Job, Worker
from weld_twin_nodes.live.run_node import executor

from ..study import shown, tabled
from . import partners
from .message_packages import messages_importable
from .partners import BEAT, ROBOT
from .party import REST
from .soak import cpu_ns

SETTLE = 0.15
"""Seconds to wait for what is still under way after a turn."""


USUAL = {JOINT_STATES.name: 'given', TWIN_POSE.name: 'answer'}
"""Where contenders are asked and answer."""


class Contender:
    """A process that answers; its latency [ns], turn by turn, and its CPU time."""

    def __init__(
        self,
        name: str,
        words: Sequence[str],
        kind: Any,
        parameters: Sequence[str],
        remaps: Mapping[str, str] = USUAL,
    ) -> None:
        self.name, self.kind = name, kind
        self.given, self.answer = f'/race/{name}/in', f'/race/{name}/out'
        ends = {'given': self.given, 'answer': self.answer}
        self._command = [
            sys.executable,
            '-m',
            *words,
            '--ros-args',
            *parameters,
            *(w for old, new in remaps.items() for w in ('-r', f'{old}:={ends.get(new, new)}')),
            '-r',
            f'__node:={name}',
        ]
        self.turns: list[list[int]] = []
        self.cpu = self.sent = 0

    def start(self) -> subprocess.Popen[bytes]:
        self.process = subprocess.Popen(self._command, stderr=subprocess.DEVNULL)
        return self.process

    def hear(self, data: bytes) -> None:
        """Take an answer, whose stamp is when the question was sent."""
        now = time.monotonic_ns()
        if not self.turns:  # late, of a turn that does not count
            return
        sec, nanosec = unpack_from('<iI', data, HEADER)
        self.turns[-1].append(now - sec * 1_000_000_000 - nanosec)

    def result(self) -> dict[str, float]:
        """
        Return percentiles [us], the CPU time of one message [us] and what was lost.

        ``p50_us`` and ``p99_us`` are the medians of the turns' own percentiles, so that a turn
        which somebody else's work disturbed does not decide; ``p99_all_us`` is of all samples.
        """
        turns = [np.percentile(turn, [50, 99]) / 1e3 for turn in self.turns if turn]
        p50, p99 = np.median(turns, axis=0)
        pooled = np.concatenate(self.turns)
        return {
            'p50_us': round(float(p50), 1),
            'p99_us': round(float(p99), 1),
            'p99_all_us': round(float(np.percentile(pooled, 99)) / 1e3, 1),
            'cpu_us': round(self.cpu / self.sent / 1e3, 1),
            'sent': self.sent,
            'lost': self.sent - pooled.size,
        }

    def add(self, other: Contender) -> None:
        self.turns += other.turns
        self.cpu += other.cpu
        self.sent += other.sent

    def clear(self) -> None:
        self.turns = []
        self.cpu = self.sent = 0


class Race:
    """A context manager in which contenders answer."""

    def __init__(self, contenders: Sequence[Contender], *, poses: bool = False) -> None:
        self.contenders = contenders
        self._poses = poses
        self.meanwhile: Callable[[], None] = lambda: None
        self._stack = ExitStack()

    def __enter__(self) -> Race:
        self._stack.enter_context(messages_importable())
        self._stack.enter_context(own_domain())
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        self._stack.callback(rclpy.try_shutdown)
        self._runner = executor()
        node = self.node = Node('finish')
        self._runner.add_node(node)
        deep = QoSProfile(depth=10_000, reliability=ReliabilityPolicy.RELIABLE)
        for contender in self.contenders:
            process = contender.start()
            self._stack.callback(process.wait)
            self._stack.callback(process.terminate)
            node.create_subscription(
                contender.kind, contender.answer, contender.hear, deep, raw=True
            )
        self._helper('frames', None)
        self._pulse = self._helper('pulse', subprocess.PIPE)
        return self

    def _helper(self, name: str, out: int | None) -> subprocess.Popen[str]:
        """Return one of the partners that runs until its standard input is closed."""
        words = [sys.executable, '-m', partners.__name__, name]
        process = subprocess.Popen(words, text=True, stdin=subprocess.PIPE, stdout=out, bufsize=1)
        assert process.stdin is not None
        self._stack.callback(process.wait)
        self._stack.callback(process.stdin.close)
        return process

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def turn(self, contender: Contender, rate: float, seconds: float) -> None:
        assert self._pulse.stdin is not None
        assert self._pulse.stdout is not None
        count = max(round(rate * seconds), 1)
        contender.turns.append([])
        before = cpu_ns(contender.process.pid)
        self._pulse.stdin.write(f'{contender.given} {rate} {count} {int(self._poses)}\n')
        future: Future = Future()
        done = self._pulse.stdout.readline
        threading.Thread(target=lambda: future.set_result(done())).start()
        while not future.done():
            self.meanwhile()
            self._runner.spin_until_future_complete(future, timeout_sec=0.05)
        end = time.monotonic() + SETTLE
        while time.monotonic() < end:
            self._runner.spin_until_future_complete(Future(), timeout_sec=SETTLE / 5)
        contender.cpu += cpu_ns(contender.process.pid) - before
        contender.sent += count


ARM = '/race/arm'
"""Where the arm's joint states are told."""
CAUSES = (
    {'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': 4e-4},
    {'effect': 'link_twist', 'joint': 'elbow_joint', 'dalpha': 4e-4},
    {
        'effect': 'transmission_ripple',
        'joint': 'shoulder_pan_joint',
        'amplitude': 2e-4,
        'order': 2.0,
        'phase': 0.3,
    },
    {'effect': 'joint_compliance', 'joint': 'shoulder_lift_joint', 'compliance': 4e-6},
)
"""What the model holds: constants, a gear's error and a spring."""


def pose_race(turns: int, rate: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return the latency of each contender [us], the ratios, and what was lost."""
    with TemporaryDirectory() as place:
        model = Path(place) / 'effects.yaml'
        model.write_text(yaml_text(list(CAUSES)))
        kind = POSE_OUT.message_class()
        relay = Contender('relay', RELAY, kind, _words('poses:=true'))
        own = Contender(
            'compensator',
            ('weld_twin_nodes.live.compensator',),
            kind,
            _words(f'robot:={ROBOT}', f'model:={model}', 'apply:=true', 'managed:=false'),
            {'~/pose_in': 'given', '~/pose_out': 'answer', JOINT_STATES.name: ARM},
        )
        with Race((relay, own), poses=True) as both:
            both.meanwhile = _arm(both)
            # A turn goes there and back, so that the next one begins where this one ended.
            for contender in (own, relay, own):
                both.turn(contender, rate, BEAT)
            for contender in (own, relay):
                contender.clear()
            for k in range(turns):
                for contender in (own, relay) if k % 2 else (relay, own):
                    both.turn(contender, rate, BEAT)
    out = {each.name: each.result() for each in (relay, own)}
    for name, row in out.items():
        tell(f'{rate:.0f} poses/s  {name:12} {row}')
    ratio = {
        key: round(out['compensator'][key] / out['relay'][key], 3) for key in ('p50_us', 'p99_us')
    }
    tell(f'compensator / relay {ratio}')
    return {**out, 'rate_hz': rate, 'ratio': ratio, 'lost': out['compensator']['lost']}


def _words(*settings: str) -> tuple[str, ...]:
    return tuple(word for setting in settings for word in ('-p', setting))


def _arm(both: Race) -> Callable[[], None]:
    """Return what tells, again and again, where the arm stands."""
    encode = JointStateEncoder(catalog.load(ROBOT).joint_names)
    publisher = both.node.create_publisher(
        JOINT_STATES.message_class(), ARM, JOINT_STATES.offered.to_rclpy()
    )
    clock = both.node.get_clock()
    return lambda: publisher.publish(encode(clock.now().nanoseconds, REST))


RELAY = (partners.__name__, 'relay')
RATES = (125.0, 500.0, 1000.0)
"""Rates [Hz] of joint states: common controllers, and twice the fastest of them."""
LIMIT = 1.25
"""Largest ratio of the twin to the relay that passes."""
WANTED = {'twin': 1.10, 'compensator': 1.5}
"""Ratios of p50 and p99 to the relay that are wanted of each."""
POSES = 500.0
"""Poses a second for the compensator."""
TWIN = ('weld_twin_nodes.live.forward_kinematics_twin',)
ON_TF = _words('measuring_frame:=world', 'base_frame:=base_link', 'base_from_tf:=true')
"""Parameters of a twin that takes its base from `/tf`."""
COMPARED = ('p50_us', 'p99_us', 'cpu_us')
RATIOS = (
    ('ratio', 'twin', 'relay'),
    ('ratio_bare', 'twin', 'bare'),
    ('ratio_tf', 'twin_tf', 'relay'),
    ('ratio_tf_raw', 'twin_tf', 'raw_relay'),
)
"""Names of the ratios that are kept, each of one contender to another."""
JUDGED = (*(('ratio', key) for key in COMPARED), ('ratio_tf', 'p50_us'), ('ratio_tf', 'p99_us'))
"""
Ratios that must be within the limit, without and with frames on `/tf`. Reading the frames takes
processor time that the relay has no like of, so that only the latency counts there.
"""


def run(args: Given, tell: Callable[[str], None]) -> dict[str, Any]:
    joints, pose = JOINT_STATES.message_class(), TWIN_POSE.message_class()
    contenders = (
        Contender('relay', RELAY, joints, ()),
        Contender('raw_relay', RELAY, joints, _words('raw:=true')),
        Contender('bare', RELAY, pose, _words('bare:=true')),
        Contender('twin', TWIN, pose, ()),
        Contender('twin_tf', TWIN, pose, ON_TF),
    )
    with Race(contenders) as race:
        for contender in contenders:
            race.turn(contender, 500.0, 1.0)
        rates = [_at(race, rate, args, tell) for rate in RATES]
        beside = _beside_diagnosis(race, contenders[3], args, tell)
    poses = pose_race(args.turns, POSES, tell)
    worst = max(row[which][key] for row in rates for which, key in JUDGED)
    lost = sum(row['twin']['lost'] for row in rates) + poses['lost']
    ratios = {
        'twin': max(row['ratio'][key] for row in rates for key in ('p50_us', 'p99_us')),
        'compensator': max(poses['ratio'].values()),
    }
    return {
        'passed': worst <= LIMIT and not lost,
        'reached': {name: ratio <= WANTED[name] for name, ratio in ratios.items()},
        'poses': poses,
        'limit': LIMIT,
        'worst_ratio': worst,
        'turns': args.turns,
        'turn_s': args.seconds,
        'rates': rates,
        'beside_live_diagnosis': beside,
    }


def _at(race: Any, rate: float, args: Given, tell: Callable[[str], None]) -> dict[str, Any]:
    for contender in race.contenders:
        contender.clear()
    for k in range(args.turns):
        for i in range(len(race.contenders)):
            race.turn(race.contenders[(i + k) % len(race.contenders)], rate, args.seconds)
    row: dict[str, Any] = {'rate_hz': rate}
    for contender in race.contenders:
        row[contender.name] = contender.result()
        tell(f'{rate:6.0f} Hz  {contender.name:10} {row[contender.name]}')
    for key, who, name in RATIOS:
        row[key] = {k: round(row[who][k] / row[name][k], 3) for k in COMPARED}
    tell(f'{rate:6.0f} Hz  twin / relay {row["ratio"]}, with TF {row["ratio_tf"]}')
    return row


def _beside_diagnosis(
    race: Any, twin: Any, args: Given, tell: Callable[[str], None]
) -> dict[str, Any]:
    """Return the twin's figures at 500 Hz with and without a diagnosis in its own process."""
    job, worker = _job(), Worker()
    both = {'alone': copy(twin), 'beside': copy(twin)}
    for contender in both.values():
        contender.clear()
    for _ in range(args.turns):
        for name, contender in both.items():
            if name == 'beside':
                worker.start(job)
            twin.clear()
            race.turn(twin, 500.0, args.seconds)
            contender.add(twin)
            worker.stop()
    samples = {name: contender.result() for name, contender in both.items()}
    for name, figures in samples.items():
        tell(f'   500 Hz  twin {name:7} {figures}')
    return samples


def _job() -> Job:
    """Return a diagnosis of a minute of a cell, which takes longer than a turn."""
    robot = catalog.load('ur5')
    t = np.arange(0.0, 60.0, 0.002)
    q = 0.5 * np.sin(np.outer(t, 0.9 + 0.3 * np.arange(6)))
    motion = JointMotion(t, q + [0, -1.2, 1.4, -1, -1.5, 0])
    poses = Twin(robot, ()).poses(Recording('minute', motion))
    measured = Measurements(t, poses.position + 1e-3 * np.sin(3.0 * q[:, :3]), poses.rotation)
    return Job(Recording('minute', motion, measured), robot)


def table(result: dict[str, Any]) -> str:
    def ms(row: dict[str, float]) -> str:
        return f'{row["p50_us"] / 1e3:.2f} / {row["p99_us"] / 1e3:.2f}'

    def ratio(row: dict[str, float]) -> str:
        return f'{row["p50_us"]:.2f} / {row["p99_us"]:.2f}'

    columns: dict[str, Callable[[Any], object]] = {
        'Hz': shown('rate_hz', by='{:g}'),
        'relay p50 / p99': lambda row: ms(row['relay']),
        'raw relay': lambda row: ms(row['raw_relay']),
        'rclpy alone': lambda row: ms(row['bare']),
        'twin': lambda row: ms(row['twin']),
        'twin / relay': lambda row: ratio(row['ratio']),
        'twin on /tf / relay': lambda row: ratio(row['ratio_tf']),
        'CPU relay / twin': lambda row: (
            f'{row["relay"]["cpu_us"]:.0f} / {row["twin"]["cpu_us"]:.0f}'
        ),
        'ratio': shown('ratio', 'cpu_us', by='{:.2f}'),
    }
    return tabled(columns, result['rates']) + '\n\n' + pose_table(result['poses'])


def pose_table(poses: dict[str, Any]) -> str:
    head = (f'{poses["rate_hz"]:g} poses a second', 'p50', 'p99', 'CPU')
    rows = [
        (name, *(f'{own[key] / 1e3:.2f} ms' for key in COMPARED[:2]), f'{own["cpu_us"]:.0f} us')
        for name, own in poses.items()
        if name in ('relay', 'compensator')
    ]
    ratio = ('ratio', *(f'{poses["ratio"][key]:.2f}' for key in COMPARED[:2]), '')
    return markdown.table(head, *rows, ratio)
