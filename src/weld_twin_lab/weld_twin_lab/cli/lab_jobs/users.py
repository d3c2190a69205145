# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Let one user, and then many at once, drop a recording on a server; and drop every malicious file.

The recording lasts 60 s and is made by the plant, if none is given. What one user waits is held
against the command, what many wait against the same work done in turn. With --hostile, as many wait
once more while somebody holds so many connections in bad faith, from the same address. The machine
must be quiet.
"""

from __future__ import annotations

import argparse
import html
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Any

from ...study import Study, option, options, study

if TYPE_CHECKING:
    from ...fleet.users import Visitor

LONGEST = 120
"""Signs of a refusal in the table."""
ONE, MANY = 1.5, 1.2
"""Times the command that one user may wait, and times the serial work that many may."""
BESIDE = 2.0
"""Times what they wait in peace that users may wait beside hostile connections, in the median and the
one who waits longest."""


add_arguments = options(
    option('bag', None, 'BAG', 'the recording that is dropped', nargs='?'),
    option('--robot', '', 'R', 'its robot, a bundled one'),
    option('--users', 20, 'N', 'who wait at once (default: 20)'),
    option('--hostile', 200, 'N', 'connections in bad faith; 0: none'),
    out='directory for the results',
)


@study
def run(study: Study) -> bool:
    """Measure, write the results, print the table."""
    from weld_twin_core.errors import DataError

    from ...fleet.run_pages import users_page

    args = study.args
    if args.bag and not args.robot:
        raise DataError('--robot names the robot of the recording')
    with tempfile.TemporaryDirectory(prefix='users-') as place:
        result = _measured(args, Path(place))
    study.write('users', result, users_page(result))
    fine = result['one_user_times_command'] <= ONE and result['times_serial_work'] <= MANY
    refused = all(said.startswith('refused') for said in result['malicious'].values())
    beside = result.get('hostile')
    held = beside is None or (beside['times'] <= BESIDE and beside['sheets'] == args.users)
    return fine and refused and held and result['sheets'] == args.users


def _measured(args: argparse.Namespace, place: Path) -> dict[str, Any]:
    from ...fleet.made_list import make_one
    from ...fleet.users import Visitor, at_once, server

    if args.bag:
        bag, robot, align = Path(args.bag), args.robot, ''
        files = sorted(bag.iterdir()) if bag.is_dir() else [bag]
    else:
        bag, own = make_one(place)
        files, robot, align = [*sorted(bag.iterdir()), own], str(own), 'base'
    fields = {'robot': Path(robot).name, 'align': align}
    command = _command(bag, robot, align, place)
    with server(place / 'served') as root:
        somebody = partial(Visitor, root)
        ones = [_one(somebody(), files, fields) for _ in range(3)]  # the first starts the worker
        one = sorted(ones)[1]
        many = at_once([somebody() for _ in range(args.users)], files, **fields)
        beside = _beside(root, somebody, files, fields, args, many) if args.hostile else None
        malicious = _malicious(somebody, place)
    return {
        'options': f' {args.bag} --robot {args.robot}' * bool(args.bag),
        'recording': str(args.bag or 'a recording of 60 s, moving, made by the plant'),
        'command_s': command,
        'one_user_s': one,
        'one_user_all_s': ones,
        'one_user_times_command': one / command,
        **many,
        'times_serial_work': many['seconds'] / (args.users * one),
        **({'hostile': beside} if beside else {}),
        'malicious': malicious,
    }


def _beside(
    root: str,
    somebody: Callable[[], Visitor],
    files: Sequence[Path],
    fields: dict[str, str],
    args: argparse.Namespace,
    peace: dict[str, Any],
) -> dict[str, Any]:
    """Return how long users wait beside hostile connections, and how that compares."""
    import numpy as np

    from ...fleet.hostile import WAYS, hostile
    from ...fleet.users import at_once

    with hostile(root, args.hostile) as told:
        found = at_once([somebody() for _ in range(args.users)], files, **fields)
    times = [
        float(measure(found['waits_s']) / measure(peace['waits_s']))
        for measure in (np.median, np.max)
    ]
    return {
        **found,
        **told,
        'connections': args.hostile,
        'ways': list(WAYS),
        'times': max(times),
        'times_median': times[0],
    }


def _one(visitor: Visitor, files: Sequence[Path], fields: dict[str, str]) -> float:
    """Return how long one user takes from drop to sheet [s]."""
    from ...fleet.users import wait

    began = time.perf_counter()
    _, address, _ = visitor.drop(files, **fields)
    wait(visitor, address)
    return time.perf_counter() - began


def _command(bag: Path, robot: str, align: str, place: Path) -> float:
    """Return how long the command takes, the median of three [s]."""
    took = []
    for k in range(3):
        began = time.perf_counter()
        words = ['diagnose', str(bag), '--robot', robot, '--out', str(place / f'found{k}')]
        words += ['--align', align] if align else []
        subprocess.run(
            [sys.executable, '-m', 'weld_twin_nodes', *words], check=True, capture_output=True
        )
        took.append(time.perf_counter() - began)
    return sorted(took)[1]


def _malicious(somebody: Callable[[], Visitor], place: Path) -> dict[str, str]:
    """Return what became of every malicious file of the campaign that the server might take."""
    from ...campaigns.fuzzing.malicious import harms

    out = {}
    for number, (name, (make, _)) in enumerate(harms().items()):
        folder = place / f'harm{number}'
        folder.mkdir()
        made = make(folder)
        found = sorted(made.iterdir()) if made.is_dir() else [made]
        files = [file for file in found if file.is_file()]
        # A device is no file, and no browser sends it.
        out[name] = _dropped(somebody(), files) if files else 'refused by the browser'
    return out


def _dropped(visitor: Visitor, files: Sequence[Path]) -> str:
    """Return 'refused' and why, or that it was taken."""
    from ...fleet.users import wait

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
        return f'refused at the door: {_said(text)}'
    text = wait(visitor, address)
    return 'taken' if '<iframe' in text else f'refused by the reader: {_said(text)}'


def _said(text: str) -> str:
    """Return what a page says is wrong, shortened."""
    told = re.search(r'role="alert">(.*?)</p>', text, re.DOTALL)
    return shorten(html.unescape(told[1]), LONGEST, placeholder=' ...') if told else ''
