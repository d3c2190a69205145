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
from struct import unpack_from
from typing import Any

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from weld_twin_msgs_py.messages.cdr_read import HEADER
from weld_twin_msgs_py.messages.topics import JOINT_STATES, TWIN_POSE
from weld_twin_nodes.harness.process import own_domain
from weld_twin_nodes.live.run_node import executor

from ..building.message_packages import messages_importable
from .usage import cpu_ns

SETTLE = 0.15
"""Seconds to wait for what is still under way after a turn."""


USUAL = {JOINT_STATES.name: 'given', TWIN_POSE.name: 'answer'}
"""Where contenders are asked and answer."""


class Contender:
    """A process that answers; its latency [ns], turn by turn, and its CPU time."""

    def __init__(
        self,
        name: str,
        module: str,
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
            module,
            '--ros-args',
            *parameters,
            *(w for old, new in remaps.items() for w in ('-r', f'{old}:={ends.get(new, new)}')),
            '-r',
            f'__node:={name}',
        ]
        self.turns: list[list[int]] = []
        self.cpu = self.sent = 0

    def start(self) -> subprocess.Popen[bytes]:
        """Start the process."""
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
        """Take over the samples of another."""
        self.turns += other.turns
        self.cpu += other.cpu
        self.sent += other.sent

    def clear(self) -> None:
        """Forget the samples."""
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
        """Start the contenders and what feeds them."""
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

    def _helper(self, module: str, out: int | None) -> subprocess.Popen[str]:
        """Return a module beside this one that runs until its standard input is closed."""
        words = [sys.executable, '-m', f'{__package__}.{module}']
        process = subprocess.Popen(words, text=True, stdin=subprocess.PIPE, stdout=out, bufsize=1)
        assert process.stdin is not None
        self._stack.callback(process.wait)
        self._stack.callback(process.stdin.close)
        return process

    def __exit__(self, *_: object) -> None:
        """End all processes."""
        self._stack.close()

    def turn(self, contender: Contender, rate: float, seconds: float) -> None:
        """Let one contender answer for some time."""
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
