# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The claims table: every case a task, the verdicts as JSON, CSV and Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from weld_twin_core.arm.robot import Robot
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.files.csv_text import csv_text
from weld_twin_nodes.offline.task_pool import Runner, Task

from .work import claim_case

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


def run_claims(
    runner: Runner, robots: Sequence[Robot], seams: Sequence[str] = SEAMS, seed: int = 0
) -> dict[str, Any]:
    """Return the claims with their verdicts, and what was measured on every case."""
    from weld_twin_core.sensitivity.claims import CaseName, judge

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


def claims_csv(result: dict[str, Any]) -> str:
    """Return the table with a row for every claim."""
    keys = ('claim', 'statement', 'where', 'verdict', 'held', 'cases', 'reason')
    return csv_text(keys, ([claim[key] for key in keys] for claim in result['claims']))


def cases_csv(result: dict[str, Any]) -> str:
    """Return every measurement of every case."""
    keys = list(result['cases'][0])
    return csv_text(keys, ([case.get(key, '') for key in keys] for case in result['cases']))


def claims_markdown(result: dict[str, Any]) -> str:
    """Return the table for reading."""
    rows = [('Claim', 'In the paper', 'Holds as written', 'Verdict', 'Why, as measured')]
    for c in result['claims']:
        held = f'{c["held"]} of {c["cases"]}'
        rows.append((c['statement'], c['where'], held, f'**{c["verdict"]}**', c['reason']))
    return (
        f'Measured on {len(result["robots"])} robots ({", ".join(result["robots"])}) and '
        f'{len(result["seams"])} seams ({", ".join(result["seams"])}) each.\n\n'
        # The bars of a norm would end a cell.
        + markdown.table(*([cell.replace('|', '‖') for cell in row] for row in rows))
    )
