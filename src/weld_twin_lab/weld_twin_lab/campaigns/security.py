# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The nodes of a cell, with keys or without, among others who have none or the wrong ones."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.bags import BagReader
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.messages.from_messages import stamp_ns
from weld_twin_msgs_py.messages.topics import DIAGNOSIS, JOINT_STATES
from weld_twin_nodes.cli.given import Given
from weld_twin_nodes.harness.process import own_domain
from weld_twin_nodes.live.policy import HEAD, TAIL, enclave, policy
from weld_twin_nodes.live.settings import MODULES

from . import party
from .secured import keystore, secured_middleware

SECONDS = 6.0
"""How long everybody speaks and listens."""
STARTED = 15.0
"""Seconds the nodes have to start."""
ENDED = 90.0
"""Seconds a process has to end."""
WORDS = {
    'trajectory_generator': ['-p', 'source:=joint_trajectory'],
    'live_diagnosis': ['-p', 'least:=1.0', '-p', 'every:=1.0'],
}
"""Parameters of nodes: the generator waits for a motion, so that all joint states are a driver's."""
OTHER = 'deviation_markers'
"""A node whose keys somebody else uses: it may neither send joint states nor hear the twin's poses."""
PARTIES = (
    'the driver',
    'one without keys',
    "one with another node's keys",
    'one of another authority',
)
"""Who speaks and listens beside the nodes; the marks of their stamps are their places here."""
PARTY = f"""\
    <enclave path="{enclave(party.NAME)}">
      <profiles>
        <profile ns="/" node="{party.NAME}">
          <topics publish="ALLOW">
            <topic>joint_states</topic>
            <topic>/parameter_events</topic>
            <topic>/rosout</topic>
          </topics>
          <topics subscribe="ALLOW">
            <topic>twin/tool_pose</topic>
          </topics>
        </profile>
      </profiles>
    </enclave>
"""
"""What the driver may do."""


def locks(folder: Path) -> list[dict[str, str]]:
    """Return the environment of each party, the nodes' own first; raises TwinError without keys."""
    file = folder / 'policy.xml'
    file.write_text(HEAD + PARTY + policy().removeprefix(HEAD).removesuffix(TAIL) + TAIL)
    everybody = [enclave(name) for name in (*MODULES, party.NAME)]
    own = _locked(keystore(folder / 'keys', file, everybody), party.NAME)
    foreign = keystore(folder / 'foreign', file, [enclave(party.NAME)])
    return [
        own,
        {},
        own | {'ROS_SECURITY_ENCLAVE_OVERRIDE': enclave(OTHER)},
        _locked(foreign, party.NAME),
    ]


def _locked(store: Path, name: str) -> dict[str, str]:
    return {
        'ROS_SECURITY_KEYSTORE': str(store),
        'ROS_SECURITY_ENABLE': 'true',
        'ROS_SECURITY_STRATEGY': 'Enforce',
        'ROS_SECURITY_ENCLAVE_OVERRIDE': enclave(name),
    }


def played(folder: Path, locked: list[dict[str, str]]) -> dict[str, Any]:
    """Return what each party, in its environment, heard, what was recorded of it, and of the nodes."""
    bag = folder / 'bag'
    words = {**WORDS, 'recorder': ['-p', f'out:={bag}']}
    cell = {name: _node(name, words.get(name, []), locked[0], folder) for name in MODULES}
    try:
        time.sleep(STARTED)
        _refuse_dead(cell, folder)
        heard = _heard(locked, folder)
        alive = [process.poll() is None for process in cell.values()]
    finally:
        codes = _stopped(cell)
    recorded, topics = _recorded(bag)
    heard_of = {'heard': heard, 'recorded': recorded, 'topics': topics}
    return {'alive': all(alive), **heard_of, 'codes': codes}


def _heard(locked: list[dict[str, str]], folder: Path) -> list[int]:
    """Let all parties speak and listen; return how many poses each of them heard."""
    speaking = []
    for mark, own in enumerate(locked):
        with (folder / f'party{mark}.log').open('wb') as log:
            command = [sys.executable, '-m', party.__name__, f'{SECONDS:g}', str(mark)]
            environment = {**os.environ, **own}
            speaking.append(
                subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=log)
            )
    said = [each.communicate(timeout=SECONDS + ENDED)[0] for each in speaking]
    return [int(text.strip() or 0) for text in said]


def _node(
    name: str, words: list[str], locked: Mapping[str, str], folder: Path
) -> subprocess.Popen[bytes]:
    """Start a node as the launch files do; its own enclave is an argument."""
    environment = {**os.environ, **locked}
    environment.pop('ROS_SECURITY_ENCLAVE_OVERRIDE', None)
    own = ('--ros-args', '--enclave', enclave(name))
    command = [sys.executable, '-m', MODULES[name], *own, *words]
    with (folder / f'{name}.log').open('wb') as log:
        return subprocess.Popen(command, env=environment, stdout=log, stderr=log)


def _refuse_dead(cell: Mapping[str, subprocess.Popen[bytes]], folder: Path) -> None:
    for name, process in cell.items():
        if process.poll() is not None:
            log = (folder / f'{name}.log').read_text(errors='replace')
            raise TwinError(f'{name} does not run: {log.strip()[-600:]}')


def _stopped(cell: Mapping[str, subprocess.Popen[bytes]]) -> list[int]:
    for process in cell.values():
        process.send_signal(signal.SIGINT)
    return [process.wait(ENDED) for process in cell.values()]


def _recorded(bag: Path) -> tuple[list[int], dict[str, int]]:
    marks: Counter[int] = Counter()
    with BagReader(bag) as reader:
        topics = Counter(topic for topic, *_ in reader.raw(list(reader.topics)))
        for message in reader.messages([JOINT_STATES.name]):
            marks[stamp_ns(message.message) % party.MARKS] += 1
    return [marks[mark] for mark in range(len(PARTIES))], dict(sorted(topics.items()))


WAYS = ('open', 'enforced')


def run(args: Given, tell: Callable[[str], None]) -> dict[str, Any]:
    with TemporaryDirectory() as folder:
        result = _tried(args, Path(folder), tell)
    return {'passed': verdict(result), **result}


def _tried(args: Given, folder: Path, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return what came of each way, as far as it could be tried, and why not further."""
    result: dict[str, Any] = {'reason': '', 'parties': list(PARTIES)}
    with ExitStack() as stack:
        for way in WAYS:
            place = folder / way
            place.mkdir()
            try:
                if args.source and way == WAYS[0]:
                    work = Path(args.work) if args.work else folder / 'built'
                    stack.enter_context(secured_middleware(Path(args.source), work))
                result['middleware'] = os.environ.get('RMW_IMPLEMENTATION', '')
                with own_domain():  # keys are for one domain
                    locked = locks(place) if way == 'enforced' else [{} for _ in PARTIES]
                    result[way] = played(place, locked)
            except TwinError as error:
                result['reason'] = f'{way}: {error}'
                break
            tell(f'{way}: {result[way]}')
    return result


def verdict(result: dict[str, Any]) -> bool:
    """
    Return whether strangers get through without keys, and nobody but the driver with them.

    All nodes must have run, and ended with code 0.
    What the nodes made of the driver's joint states without keys, they make with keys too; but for a
    verdict, which may be there in time in the one trial and not in the other.
    """
    if any(way not in result for way in WAYS):
        return False
    if any(not result[way]['alive'] or any(result[way]['codes']) for way in WAYS):
        return False
    free, locked = result['open'], result['enforced']
    shown = all(count > 0 for count in (*free['heard'], *free['recorded']))
    through = locked['heard'][0] > 0 and locked['recorded'][0] > 0
    kept_out = not any((*locked['heard'][1:], *locked['recorded'][1:]))
    made = set(free['topics']) - {DIAGNOSIS.name}
    return bool(shown and through and kept_out and made <= set(locked['topics']))


def table(result: dict[str, Any]) -> str:
    head = ('keys', 'who', "twin's poses it heard", 'joint states of it that were recorded')
    rows, more = [], []
    for way in WAYS:
        if way in result:
            own, ran = result[way], 'yes' if result[way]['alive'] else 'no'
            each = zip(result['parties'], own['heard'], own['recorded'], strict=True)
            rows += [(way, *row) for row in each]
            more.append(f'{way}: all nodes ran: {ran}; topics recorded: {len(own["topics"])}')
    remarks = '\n'.join([*more, *filter(None, [result['reason']])])
    return f'{markdown.table(head, *rows)}\n{remarks}\n'
