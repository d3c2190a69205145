# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The nodes of a cell, with keys or without, among others who have none or the wrong ones."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.bags import BagReader
from weld_twin_msgs_py.messages.from_messages import stamp_ns
from weld_twin_msgs_py.messages.topics import JOINT_STATES
from weld_twin_nodes.harness.ros_domain import own_domain
from weld_twin_nodes.live.all_nodes import MODULES
from weld_twin_nodes.live.policy import HEAD, TAIL, policy

from .middleware import FETCH
from .party import MARKS

SECONDS = 6.0
"""How long everybody speaks and listens."""
STARTED = 8.0
"""Seconds the nodes have to start."""
ENDED = 30.0
"""Seconds a process has to end."""
DRIVER, UNSECURED, OTHER = range(3)
"""Marks of the driver that belongs to the cell, of one without keys, and of one with keys for
something else."""
NODES = tuple(name for name in MODULES if name not in ('recorder', 'contact_marker'))
WORDS = {'trajectory_generator': ['-p', 'source:=joint_trajectory']}
"""Parameters of nodes: the generator waits for a motion, so that all joint states are a driver's."""
PARTY = """\
    <enclave path="/weld_twin/party">
      <profiles>
        <profile ns="/" node="party">
          <topics publish="ALLOW">
            <topic>joint_states</topic>
            <topic>/parameter_events</topic>
            <topic>/rosout</topic>
          </topics>
        </profile>
      </profiles>
    </enclave>
"""
"""What the driver may do."""


def keystore(folder: Path) -> Path:
    """
    Return a keystore with an enclave for every node and for the driver.

    Raises
    ------
    TwinError
        `ros2 security` is not here, or fails.

    """
    if shutil.which('ros2') is None:
        raise TwinError(
            f'the command ros2 with sros2 is not here, so that no keys can be made; {FETCH}'
        )
    file, keys = folder / 'policy.xml', folder / 'keys'
    file.write_text(HEAD + PARTY + policy().removeprefix(HEAD).removesuffix(TAIL) + TAIL)
    _ros2('create_keystore', str(keys))
    for name in (*NODES, 'recorder', 'party'):
        enclave = f'/weld_twin/{name}'
        _ros2('create_enclave', str(keys), enclave)
        _ros2('create_permission', str(keys), enclave, str(file))
    return keys


def _ros2(*words: str) -> None:
    done = subprocess.run(
        ['ros2', 'security', *words], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise TwinError(f'ros2 security {words[0]} failed: {(done.stderr or done.stdout)[-600:]}')


def played(folder: Path, keys: Path | None) -> dict[str, Any]:
    """
    Return what was recorded of each driver and heard by a listener without keys.

    Parameters
    ----------
    folder : Path
    keys : Path, optional
        Keystore under which the cell is enforced; left out, nobody has keys.

    Raises
    ------
    TwinError
        A node does not run; the message has what it said.

    """
    locked = {} if keys is None else _locked(keys)
    bag = folder / 'bag'
    with own_domain():
        cell = [_node(name, WORDS.get(name, []), locked, folder) for name in NODES]
        cell.append(_node('recorder', ['-p', f'out:={bag}'], locked, folder))
        try:
            time.sleep(STARTED)
            _refuse_dead(cell, folder)
            heard = _spoken(locked)
            alive = [process.poll() is None for process in cell]
        finally:
            codes = _stopped(cell)
    return {'heard': heard, 'recorded': _recorded(bag), 'alive': all(alive), 'codes': codes}


def _spoken(locked: Mapping[str, str]) -> int:
    """Let all of them speak and listen; return what the listener without keys heard."""
    parties = [
        _party('say', DRIVER, 'party', locked),
        _party('say', UNSECURED, '', {}),
        _party('say', OTHER, 'deviation_markers', locked),
        _party('hear', UNSECURED, '', {}),
    ]
    said = [party.communicate(timeout=SECONDS + ENDED)[0] for party in parties]
    return int(said[-1].strip() or 0)


def _locked(keys: Path) -> dict[str, str]:
    return {
        'ROS_SECURITY_KEYSTORE': str(keys),
        'ROS_SECURITY_ENABLE': 'true',
        'ROS_SECURITY_STRATEGY': 'Enforce',
    }


def _node(
    name: str, words: list[str], locked: Mapping[str, str], folder: Path
) -> subprocess.Popen[bytes]:
    enclave = ['--enclave', f'/weld_twin/{name}'] if locked else []
    command = [sys.executable, '-m', MODULES[name], '--ros-args', *enclave, *words]
    with (folder / f'{name}.log').open('wb') as log:
        return subprocess.Popen(command, env={**os.environ, **locked}, stdout=log, stderr=log)


def _party(way: str, mark: int, enclave: str, locked: Mapping[str, str]) -> subprocess.Popen[str]:
    words = ['--ros-args', '--enclave', f'/weld_twin/{enclave}'] if locked and enclave else []
    module = f'{__package__}.party'
    return subprocess.Popen(
        [sys.executable, '-m', module, way, f'{SECONDS:g}', str(mark), *words],
        env={**os.environ, **locked},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )


def _refuse_dead(cell: list[subprocess.Popen[bytes]], folder: Path) -> None:
    for name, process in zip((*NODES, 'recorder'), cell, strict=True):
        if process.poll() is not None:
            log = (folder / f'{name}.log').read_text(errors='replace')
            raise TwinError(f'{name} does not run: {log.strip()[-600:]}')


def _stopped(cell: list[subprocess.Popen[bytes]]) -> list[int]:
    for process in cell:
        process.send_signal(signal.SIGINT)
    return [process.wait(ENDED) for process in cell]


def _recorded(bag: Path) -> list[int]:
    """Return the joint states in a bag of the driver, of one without keys, and of the other."""
    counts = [0, 0, 0]
    with BagReader(bag) as reader:
        for message in reader.messages([JOINT_STATES.name]):
            counts[stamp_ns(message.message) % MARKS] += 1
    return counts
