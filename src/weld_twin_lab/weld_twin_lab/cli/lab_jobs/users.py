# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Let one user, and then many at once, drop a recording on a server; and drop every malicious file.

What one user waits is held against the command, what many wait against the same work done in turn.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

RESULT = 'users.json'
MISSED = 1
"""Exit code where somebody waited too long, or a malicious file was taken."""
ONE, MANY = 1.5, 1.2
"""Times the command that one user may wait, and times the serial work that many may."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('bag', metavar='BAG', help='the recording that is dropped')
    parser.add_argument('--robot', required=True, metavar='R', help='a bundled robot')
    parser.add_argument('--out', required=True, metavar='DIR', help='directory for users.json')
    parser.add_argument('--users', type=int, default=20, metavar='N')


def run(args: argparse.Namespace) -> int:
    """Measure, write the result, print it."""
    from weld_twin_msgs_py.files.whole_files import write_text

    from ...fleet.users import Visitor, at_once, server

    bag = Path(args.bag)
    files = sorted(bag.iterdir()) if bag.is_dir() else [bag]
    with tempfile.TemporaryDirectory(prefix='users-') as place:
        command = _command(bag, args.robot, Path(place))
        with server(Path(place) / 'served') as root:
            visitor = Visitor(root)
            ones = []
            for _ in range(3):  # the first also waits for the worker to start
                began = time.perf_counter()
                _, address, _ = visitor.drop(files, robot=args.robot)
                visitor.wait(address)
                ones.append(time.perf_counter() - began)
            many = at_once(root, files, args.users, robot=args.robot)
            malicious = _malicious(root, Path(place))
    one = sorted(ones)[1]
    result = {
        'command_s': command,
        'one_user_s': ones,
        'one_user_times_command': one / command,
        **many,
        'times_serial_work': many['seconds'] / (args.users * one),
        'malicious': malicious,
    }
    text = json.dumps(result, indent=1)
    Path(args.out).mkdir(parents=True, exist_ok=True)
    write_text(Path(args.out) / RESULT, text + '\n', overwrite=True)
    print(text)
    fine = one <= ONE * command and result['times_serial_work'] <= MANY
    refused = all(said.startswith('refused') for said in malicious.values())
    return 0 if fine and refused and many['sheets'] == args.users else MISSED


def _command(bag: Path, robot: str, place: Path) -> float:
    """Return how long the command takes, the median of three [s]."""
    took = []
    for k in range(3):
        began = time.perf_counter()
        words = ['diagnose', str(bag), '--robot', robot, '--out', str(place / f'found{k}')]
        subprocess.run(
            [sys.executable, '-m', 'weld_twin_nodes', *words], check=True, capture_output=True
        )
        took.append(time.perf_counter() - began)
    return sorted(took)[1]


def _malicious(root: str, place: Path) -> dict[str, str]:
    """Return what became of every malicious file of the campaign that the server might take."""
    from ...campaigns.fuzzing.malicious import harms
    from ...fleet.users import Visitor

    out = {}
    for number, (name, (make, _)) in enumerate(harms().items()):
        folder = place / f'harm{number}'
        folder.mkdir()
        made = make(folder)
        found = sorted(made.iterdir()) if made.is_dir() else [made]
        files = [file for file in found if file.is_file()]
        # A device is no file, and no browser sends it.
        out[name] = _dropped(Visitor(root), files) if files else 'refused by the browser'
    return out


def _dropped(visitor: Any, files: Sequence[Path]) -> str:
    """Return 'refused' and why, or that it was taken."""
    own = [
        file
        for file in files
        if file.suffix in ('.urdf', '.yaml') and file.name != 'metadata.yaml'
    ]
    robot = own[0].name if own else 'ur5'
    if own:  # a robot file comes with a recording
        table = own[0].with_name('stations.csv')
        table.write_text('J1,X,Y,Z\n' + '0.1,0.1,0.2,0.3\n' * 30, encoding='utf-8')
        files = [*files, table]
    status, address, text = visitor.drop(files, robot=robot)
    if status != 200:
        return f'refused at the door: {status}'
    _, _, text = visitor.wait(address)
    return 'taken' if '<iframe' in text else 'refused by the reader'
