# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joint state in to twin pose out, beside a bare relay that copies the message.

Relay and twin take turns of a second on one machine in one run, so that the ratios hold on a busy
machine too. One twin takes its base from `/tf` and goes on listening to an arm's frames there.
Times are from the call that sends the joint state to the call that receives the answer. A second
part lets the twin answer with and without a live diagnosis under way. A third lets a compensator
answer to poses, beside a relay that copies those.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from copy import copy
from typing import Any

from weld_twin_msgs_py.files import markdown

from ..study import options

RATES = (125.0, 500.0, 1000.0)
"""Rates [Hz] of joint states: common controllers, and twice the fastest of them."""
LIMIT = 1.25
"""Largest ratio of the twin to the relay that passes."""
WANTED = {'twin': 1.10, 'compensator': 1.5}
"""Ratios of p50 and p99 to the relay that are wanted of each."""
POSES = 500.0
"""Poses a second for the compensator."""
TWIN = 'weld_twin_nodes.live.forward_kinematics_twin'
ON_TF = tuple(
    word
    for setting in ('measuring_frame:=world', 'base_frame:=base_link', 'base_from_tf:=true')
    for word in ('-p', setting)
)
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


OPTIONS = options(
    """
--turns N    turns of each, at each rate [default: 20]
--seconds S  length of a turn [default: 1]
""",
    out='',
)


def run(args: argparse.Namespace, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return latency and CPU time of each contender at each rate, and the ratios."""
    from weld_twin_msgs_py.messages.topics import JOINT_STATES, TWIN_POSE

    from .compensating.pose_race import race as pose_race
    from .live.latency_race import Contender, Race

    relay = f'{__package__}.live.relay'
    joints, pose = JOINT_STATES.message_class(), TWIN_POSE.message_class()
    contenders = (
        Contender('relay', relay, joints, ()),
        Contender('raw_relay', relay, joints, ('-p', 'raw:=true')),
        Contender('bare', relay, pose, ('-p', 'bare:=true')),
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


def _at(
    race: Any, rate: float, args: argparse.Namespace, tell: Callable[[str], None]
) -> dict[str, Any]:
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
    race: Any, twin: Any, args: argparse.Namespace, tell: Callable[[str], None]
) -> dict[str, Any]:
    """Return the twin's figures at 500 Hz with and without a diagnosis in its own process."""
    from weld_twin_nodes.live.diagnosis_worker import Worker

    job, worker = _job(), Worker()
    samples: dict[str, dict[str, float]] = {}
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
    for name, contender in both.items():
        samples[name] = contender.result()
        tell(f'   500 Hz  twin {name:7} {samples[name]}')
    return samples


def _job() -> Any:
    """Return a diagnosis of a minute of a cell, which takes longer than a turn."""
    import numpy as np

    from weld_twin_core.arm import catalog
    from weld_twin_core.recording import JointMotion, Measurements, Recording
    from weld_twin_core.twin.twin import Twin
    from weld_twin_nodes.live.diagnosis_worker import Job

    robot = catalog.load('ur5')
    t = np.arange(0.0, 60.0, 0.002)
    q = 0.5 * np.sin(np.outer(t, 0.9 + 0.3 * np.arange(6)))
    motion = JointMotion(t, q + [0, -1.2, 1.4, -1, -1.5, 0])
    poses = Twin(robot, ()).poses(Recording('minute', motion))
    measured = Measurements(t, poses.position + 1e-3 * np.sin(3.0 * q[:, :3]), poses.rotation)
    return Job(Recording('minute', motion, measured), robot)


def table(result: dict[str, Any]) -> str:
    """Return a row for each rate: latency in ms, CPU time in us."""

    def ms(row: dict[str, float]) -> str:
        return f'{row["p50_us"] / 1e3:.2f} / {row["p99_us"] / 1e3:.2f}'

    def ratio(row: dict[str, float]) -> str:
        return f'{row["p50_us"]:.2f} / {row["p99_us"]:.2f}'

    head = (
        *('Hz', 'relay p50 / p99', 'raw relay', 'rclpy alone', 'twin', 'twin / relay'),
        *('twin on /tf / relay', 'CPU relay / twin', 'ratio'),
    )
    rows = (
        (
            f'{row["rate_hz"]:g}',
            *(ms(row[name]) for name in ('relay', 'raw_relay', 'bare', 'twin')),
            *(ratio(row[name]) for name in ('ratio', 'ratio_tf')),
            f'{row["relay"]["cpu_us"]:.0f} / {row["twin"]["cpu_us"]:.0f}',
            f'{row["ratio"]["cpu_us"]:.2f}',
        )
        for row in result['rates']
    )
    return markdown.table(head, *rows) + '\n\n' + pose_table(result['poses'])


def pose_table(poses: dict[str, Any]) -> str:
    """Return a row for the relay of poses, one for the compensator, and one of their ratios."""
    keys = ('p50_us', 'p99_us')
    rows = [
        (
            name,
            *(f'{poses[name][key] / 1e3:.2f} ms' for key in keys),
            f'{poses[name]["cpu_us"]:.0f} us',
        )
        for name in ('relay', 'compensator')
    ]
    rows.append(('ratio', *(f'{poses["ratio"][key]:.2f}' for key in keys), ''))
    return markdown.table((f'{poses["rate_hz"]:g} poses a second', 'p50', 'p99', 'CPU'), *rows)
