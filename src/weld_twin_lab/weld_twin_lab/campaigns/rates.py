# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Robots at full rate, each in a namespace with nodes and a recorder of its own.

Two robots at 500 Hz beside each other, and one at 1 kHz; each has a tracker at 60 Hz. A robot passes
when its bag has every joint state, every measured pose and a twin pose for every joint state.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from weld_twin_msgs_py.files import markdown

from ..study import option, options

POSE_RATE = 60.0
"""Poses a second of a tracker."""
LISTENERS = 2
"""Who takes joint states, twin and recorder, and poses, analyzer and recorder."""
PATIENCE = 120.0
"""Seconds that a driver may take beyond its motion."""


class RateCase(NamedTuple):
    """Robots that run at once: model by namespace; joint states a second of each."""

    robots: dict[str, str]
    rate: float


CASES = (
    RateCase({'left': 'ur5', 'right': 'ur10'}, 500.0),
    RateCase({'arm': 'ur5'}, 1000.0),
)


add_arguments = options(
    option('--seconds', 60.0, None, 'length of each case'),
    out='',
)


def run(args: argparse.Namespace, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return what each bag holds and lacks."""
    rows: list[dict[str, Any]] = []
    for case in CASES:
        with tempfile.TemporaryDirectory() as folder:
            for row in _case(case, args.seconds, Path(folder)):
                rows.append(row)
                tell(f'{"ok  " if row["passed"] else "FAIL"} {row}')
    return {
        'passed': all(row['passed'] for row in rows),
        'seconds_each': args.seconds,
        'rows': rows,
    }


def _case(case: RateCase, seconds: float, folder: Path) -> list[dict[str, Any]]:
    """Run the robots of a case beside each other; return a row for each."""
    from weld_twin_nodes.harness import Cell
    from weld_twin_nodes.live.all_nodes import MODULES

    with Cell(folder / 'cell') as cell:
        for space, robot in case.robots.items():
            for node in ('forward_kinematics_twin', 'deviation_analyzer', 'recorder'):
                own = f'out:={folder / space}' if node == 'recorder' else f'robot:={robot}'
                words = ['-r', f'__ns:=/{space}', '-p', own, '-p', 'reliable_inputs:=true']
                cell.start([sys.executable, '-m', MODULES[node], '--ros-args', *words])
        drivers = {
            space: subprocess.Popen(
                [sys.executable, '-m', f'{__package__}.live.driver', space, robot]
                + [f'{number:g}' for number in (case.rate, POSE_RATE, seconds, LISTENERS)],
                stdout=subprocess.PIPE,
                text=True,
            )
            for space, robot in case.robots.items()
        }
        said = {
            space: each.communicate(timeout=seconds + PATIENCE)[0]
            for space, each in drivers.items()
        }
    return [_row(case, space, said[space], folder / space) for space in case.robots]


def _row(case: RateCase, space: str, said: str, bag: Path) -> dict[str, Any]:
    """Return what a bag lacks of what a driver sent."""
    from weld_twin_core.errors import TwinError
    from weld_twin_msgs_py.bags import BagReader
    from weld_twin_msgs_py.messages.from_messages import stamp_ns

    sent = json.loads(said or '{}')
    row: dict[str, Any] = {'robot': space, 'rate_hz': case.rate, 'beside': len(case.robots) - 1}
    wanted = {
        'joint_states': sent.get('joint_states', 0),
        'measured/tool_pose': sent.get('poses', 0),
        'twin/tool_pose': sent.get('joint_states', 0),
    }
    row['sent'] = sent
    try:
        with BagReader(bag) as reader:
            stamps: dict[str, set[int]] = {topic: set() for topic in wanted}
            for topic, _, _, message in reader.messages([f'/{space}/{name}' for name in wanted]):
                stamps[topic.removeprefix(f'/{space}/')].add(stamp_ns(message))
    except TwinError as error:
        return {**row, 'passed': False, 'reason': str(error)}
    row['missing'] = {name: count - len(stamps[name]) for name, count in wanted.items()}
    row['passed'] = bool(sent.get('acknowledged')) and not any(row['missing'].values())
    return row


def table(result: dict[str, Any]) -> str:
    """Return a row for each robot."""
    return markdown.table(
        (
            'robot',
            'joint states a second',
            'robots beside',
            'sent',
            'missing in the bag',
            'passed',
        ),
        *(
            (
                row['robot'],
                f'{row["rate_hz"]:g}',
                row['beside'],
                ' / '.join(f'{row["sent"].get(k, 0):,}' for k in ('joint_states', 'poses')),
                ', '.join(f'{name} {count}' for name, count in row.get('missing', {}).items()),
                'yes' if row['passed'] else 'no',
            )
            for row in result['rows']
        ),
    )
