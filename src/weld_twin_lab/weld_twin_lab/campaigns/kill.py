# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A recorder is fed numbered messages and killed; what it leaves is compared with them."""

from __future__ import annotations

import os
import signal
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from multiprocessing import get_context
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.bags import BagReader, recover
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import JOINT_STATES, MEASURED_POSE
from weld_twin_nodes.cli.given import Given
from weld_twin_nodes.harness import Cell

STEP = 0.002
"""Seconds between two joint states."""
EVERY = 5
"""Joint states to a pose."""
FIRST = 1_000_000_000
"""Stamp of the message number 0 [ns]."""
NOTHING = 'holds no whole message'
"""Of a recording killed before anything reached the disk; what is missing of it is counted."""
JOINTS = tuple(f'joint_{k}' for k in range(1, 7))
"""Names in every joint state."""
TOPICS = (JOINT_STATES.name, MEASURED_POSE.name)


@dataclass(frozen=True)
class Trial:
    storage: str
    moment: float
    """After the first message [s]; then it is killed, or told to end if ``closing``."""
    closing: bool
    split_mb: float
    """Size of a file of the bag [MB]; 0 is without limit."""
    wait: float
    """From being told to end until the kill [s]."""


@dataclass
class _Sent:
    """When each message of the topics was sent [s], by number."""

    times: dict[str, list[float]] = field(default_factory=lambda: {name: [] for name in TOPICS})

    def before(self, moment: float) -> int:
        return sum(int(np.searchsorted(times, moment)) for times in self.times.values())

    def missing(self, topic: str, received: int, moment: float) -> float:
        """Return what time of a topic is missing of what was sent by then [s]."""
        times = self.times[topic]
        last = int(np.searchsorted(times, moment)) - 1
        if received > last:
            return 0.0
        return times[last] - (times[received - 1] if received else times[0] - STEP)


def try_once(trial: Trial) -> dict[str, Any]:
    """Return what was sent, what was recovered, and what is wrong with it, if anything."""
    with tempfile.TemporaryDirectory(prefix='weld_twin_kill_') as place:
        out = Path(place) / 'bag'
        with Cell(Path(place) / 'cell') as cell, _recorder(cell, trial, out) as recorder:
            sent, moment = _feed_and_kill(cell, trial, recorder)
        row = {
            **{key: _rounded(value) for key, value in asdict(trial).items()},
            'sent': sent.before(moment),
            'recovered': 0,
            'missing_s': 0.0,
            'opened': '',
            'fault': '',
        }
        try:
            row['opened'], kept = _left(out)
        except TwinError as error:
            sentence = str(error).replace(place, '')
            row['opened' if NOTHING in sentence else 'fault'] = sentence
            kept = {}
        for topic in sent.times:
            numbers = kept.get(topic, [])
            if numbers != list(range(len(numbers))):
                row['fault'] = f'{topic} is not what was sent from the first message on'
            missing = sent.missing(topic, len(numbers), moment)
            row['missing_s'] = max(row['missing_s'], _rounded(missing))
            row['recovered'] += len(numbers)
        return row


def _rounded(value: Any) -> Any:
    return round(value, 3) if isinstance(value, float) else value


@contextmanager
def _recorder(cell: Cell, trial: Trial, out: Path) -> Iterator[BaseProcess]:
    """Yield a running recorder, forked off a process that has imported it already."""
    context = get_context('forkserver')
    context.set_forkserver_preload(['weld_twin_nodes.live.recorder'])
    parameters = {
        'out': str(out),
        'storage': trial.storage,
        'split_size': trial.split_mb,
        'reliable_inputs': 'true',
    }
    process = context.Process(target=_record, args=(cell.domain, parameters))
    process.start()
    try:
        yield process
    finally:
        process.kill()
        process.join()


def _record(domain: int, parameters: dict[str, Any]) -> None:
    from weld_twin_nodes.live.recorder import main

    os.environ.update(ROS_DOMAIN_ID=str(domain), ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST')
    words = ['--ros-args', '--log-level', 'error', '-r', f'__node:={_name(os.getpid())}']
    for name, value in parameters.items():
        words += ['-p', f'{name}:={value}']
    raise SystemExit(main(words))


def _name(pid: int) -> str:
    """Return a name no other recorder in reach has, so that none answers in its place."""
    return f'recorder_{pid}'


def _feed_and_kill(cell: Cell, trial: Trial, recorder: BaseProcess) -> tuple[_Sent, float]:
    """Return what was sent, and the moment of the kill, or of being told to end [s]."""
    sent = _Sent()
    joints, poses = cell.publisher(JOINT_STATES), cell.publisher(MEASURED_POSE)
    assert recorder.pid is not None
    cell.trigger(f'/{_name(recorder.pid)}/counts')
    make = cell.messages
    begin = time.monotonic()
    number = 0
    while time.monotonic() < begin + trial.moment:
        angles = np.full(len(JOINTS), number * 1e-4)
        _send(sent, JOINT_STATES.name, joints, make.joint_state(FIRST + number, JOINTS, angles))
        if number % EVERY == 0:
            pose = make.pose(FIRST + number // EVERY, np.zeros(3), np.eye(3))
            _send(sent, MEASURED_POSE.name, poses, pose)
        number += 1
        time.sleep(max(0.0, begin + number * STEP - time.monotonic()))
    moment = time.monotonic()
    if trial.closing:
        os.kill(recorder.pid, signal.SIGINT)
        time.sleep(trial.wait)
    with suppress(ProcessLookupError):  # it may have been quicker
        os.kill(recorder.pid, signal.SIGKILL)
    recorder.join()
    return sent, moment


def _send(sent: _Sent, topic: str, publisher: Any, message: Any) -> None:
    publisher.publish(message)
    sent.times[topic].append(time.monotonic())


def _left(out: Path) -> tuple[str, dict[str, list[int]]]:
    """Return how the bag was opened, and the numbers of the messages by topic."""
    how = 'by itself'
    if not out.exists():
        recover(out)
        how = 'recover'
    numbers: dict[str, list[int]] = {name: [] for name in TOPICS}
    with BagReader(out) as bag:
        for topic, _, _, message in bag.messages(list(numbers)):
            numbers[topic].append(from_messages.stamp_ns(message) - FIRST)
    return how, numbers


ALLOWED = 1.0
"""Seconds of messages that a kill may cost."""
STORAGES = ('mcap', 'sqlite3')


def run(args: Given, tell: Callable[[str], None]) -> dict[str, Any]:
    rng = np.random.default_rng(args.seed)
    rows: list[dict[str, Any]] = []
    for k in range(args.times):
        trial = Trial(
            storage=STORAGES[k % 2],
            moment=float(rng.uniform(0.0, args.longest)),
            closing=bool(rng.random() < 0.2),
            split_mb=float(rng.choice([0.0, 0.1, 0.2])),
            wait=float(rng.uniform(0.0, 0.1)),
        )
        rows.append(try_once(trial))
        if rows[-1]['fault'] or (k + 1) % 10 == 0:
            worst = max(row['missing_s'] for row in rows)
            faults = sum(bool(row['fault']) for row in rows)
            tell(f'{k + 1} kills, {faults} faults {rows[-1]["fault"]}, at most {worst:.3f} s lost')
    return {**_summary(rows), 'kills': rows}


def _summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    def share(chosen: list[dict[str, Any]]) -> dict[str, Any]:
        missing = [row['missing_s'] for row in chosen] or [0.0]
        return {
            'kills': len(chosen),
            'faults': sum(bool(row['fault']) for row in chosen),
            'missing_s': {'median': _rounded(float(np.median(missing))), 'max': max(missing)},
            'sent': sum(row['sent'] for row in chosen),
            'recovered': sum(row['recovered'] for row in chosen),
        }

    groups = {kind: share([row for row in rows if row['storage'] == kind]) for kind in STORAGES}
    whole = share(rows)
    passed = whole['faults'] == 0 and whole['missing_s']['max'] <= ALLOWED
    return {'passed': passed, 'allowed_s': ALLOWED, 'all': whole, **groups}


def table(result: dict[str, Any]) -> str:
    head = ('storage', 'kills', 'gaps, repeats, broken bags', 'missing, median', 'missing, worst')
    rows = []
    for name in STORAGES:
        row = result[name]
        missing = (f'{row["missing_s"][key]:.2f} s' for key in ('median', 'max'))
        rows.append((name, row['kills'], row['faults'], *missing))
    return markdown.table(head, *rows)
