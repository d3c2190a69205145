# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The claims on many robots and seams: what `weld-twin sensitivity --claims` measures and writes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from weld_twin_core import __version__
from weld_twin_core.arm.robot import Robot
from weld_twin_core.motion.paths import default_seam
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.files.csv_text import csv_text
from weld_twin_msgs_py.files.whole_files import write_json, write_text
from weld_twin_msgs_py.robots import load_robot
from weld_twin_nodes.offline.task_pool import Runner, Task
from weld_twin_report.sensitivity_report.study_files import CLAIMS

from . import measure_case
from .judgement import CaseName, judge

ROBOTS = (
    'ur5',
    'ur10',
    'kuka_kr6_r900',
    'abb_irb120',
    'abb_irb1600',
    'fanuc_m10ia',
    'franka_panda',
)
"""One of each kind of build: the verdicts of `docs/claims.md` were measured on them."""
SEAMS = ('line', 'arc', 'polyline')


def claims_on(names: Sequence[str], seed: int) -> Callable[[Runner, Path], dict[str, Any]]:
    """Return what measures the claims on robots, left out one of each build, and writes them."""
    robots = [load_robot(name) for name in names or ROBOTS]

    def measured(runner: Runner, place: Path) -> dict[str, Any]:
        result = _run(runner, robots, SEAMS, seed)
        _write(place, result)
        return result

    return measured


def claim_case(robot: Robot, seam: str, seed: int) -> dict[str, float]:
    """Return the measurements of a robot on a bundled seam that decide the claims."""
    return measure_case(robot, default_seam(robot, seam), seed)


def _run(
    runner: Runner, robots: Sequence[Robot], seams: Sequence[str], seed: int
) -> dict[str, Any]:
    """Return the claims with their verdicts, and what was measured on every case."""
    names = [CaseName(robot.name, seam) for robot in robots for seam in seams]
    tasks = [
        Task(claim_case, (robot, seam, seed), f'claims: {robot.name}, {seam}')
        for robot in robots
        for seam in seams
    ]
    result = dict(zip(names, runner.run(tasks), strict=True))
    return {
        'schema': 'weld_twin/claims/1',
        'seed': seed,
        'robots': [robot.name for robot in robots],
        'seams': list(seams),
        'claims': [claim.as_dict() for claim in judge(result)],
        'cases': [{**name._asdict(), **measured} for name, measured in result.items()],
    }


def _write(place: Path, result: dict[str, Any]) -> None:
    """Write the claims table in every form, and the measurements behind it."""
    write_text(place / 'claims.csv', _claims_csv(result), overwrite=True)
    write_text(place / 'claims-cases.csv', _cases_csv(result), overwrite=True)
    write_text(place / 'claims.md', _claims_markdown(result), overwrite=True)
    write_json(place / CLAIMS, {**result, 'version': __version__}, overwrite=True)


def _claims_csv(result: dict[str, Any]) -> str:
    """Return the table with a row for every claim."""
    keys = ('claim', 'statement', 'where', 'verdict', 'held', 'cases', 'reason')
    return csv_text(keys, ([claim[key] for key in keys] for claim in result['claims']))


def _cases_csv(result: dict[str, Any]) -> str:
    """Return every measurement of every case."""
    keys = list(result['cases'][0])
    return csv_text(keys, ([case.get(key, '') for key in keys] for case in result['cases']))


def _claims_markdown(result: dict[str, Any]) -> str:
    """Return the table for reading."""
    rows = [('Claim', 'In the paper', 'Holds as written', 'Verdict', 'Why, as measured')]
    for c in result['claims']:
        share = f'{c["held"]} of {c["cases"]}'
        rows.append((c['statement'], c['where'], share, f'**{c["verdict"]}**', c['reason']))
    return (
        f'Measured on {len(result["robots"])} robots ({", ".join(result["robots"])}) and '
        f'{len(result["seams"])} seams ({", ".join(result["seams"])}) each.\n\n'
        # The bars of a norm would end a cell.
        + markdown.table(*([cell.replace('|', '‖') for cell in row] for row in rows))
    )
