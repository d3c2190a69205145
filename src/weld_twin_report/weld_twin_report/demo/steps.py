# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The steps of the demo in their order.

A step more is an entry of `STEPS`: a title and a function of the job, and of what tells progress.
"""

from functools import partial
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from weld_twin_core.arm import catalog
from weld_twin_core.effects import effects_from_list
from weld_twin_nodes.offline.output_directory import new_directory
from weld_twin_nodes.offline.seam_motion import plan_motion

from .analysis import (
    MARK,
    Job,
    Step,
    analyse,
    draw,
    find_causes,
    leave_open,
    rank,
    run_live,
    write_table,
)
from .closed_loop import close_loop

ROBOT = 'ur5'
SEAM = 'polyline'
RATE = 50.0
"""Hz of the joint states: enough for the seam, and the demo stays short."""
SEED = 1
"""Of the noise; any other does as well."""
EFFECTS = [
    {'effect': 'backlash', 'joint': 'shoulder_pan_joint', 'width': 8e-4},
    {'effect': 'joint_compliance', 'joint': 'shoulder_lift_joint', 'compliance': 8e-6},
    {'effect': 'measurement_noise', 'sigma': 2e-5},
]
"""What is wrong with the robot; one seam tells these from everything else."""
STILL_EFFECTS = [
    {'effect': 'link_twist', 'joint': 'elbow_joint', 'dalpha': 6e-4},
    *EFFECTS[1:],
]
"""The same without play, which poses cannot tell when to correct: they are all that a compensator takes
where no controller's action is installed."""


def plan_seam(job: Job, _: object) -> None:
    """Plan the seam as joint motion."""
    job.plan = plan_motion(job.robot, job.seam, 'smooth', job.rate)


STEPS = (
    Step('plan the seam', plan_seam),
    Step('weld it with five live nodes and record', run_live),
    Step('compare the bag with the twin', analyse),
    Step('rank what matters on this seam', rank),
    Step('draw the seam', draw),
    Step('find what the twin does not know', find_causes),
    Step('do the same where one seam cannot tell', leave_open),
    Step('write the table', write_table),
)
CLOSED_LOOP = (
    *STEPS[:-1],
    Step('weld it again with the loop closed', close_loop),
    STEPS[-1],
)
"""The same with the seam corrected by what was found."""


def run_demo(out: Path | str, *, closed_loop: bool = False, force: bool = False) -> None:
    """
    Run the steps into a directory that appears when all are done.

    ``closed_loop``: weld the seam again through the compensator, on an arm without play.
    """
    console = Console()
    robot = catalog.load(ROBOT)
    steps, effects = (CLOSED_LOOP, STILL_EFFECTS) if closed_loop else (STEPS, EFFECTS)
    with new_directory(out, mark=MARK, force=force) as folder:
        job = Job(folder, robot, effects_from_list(effects, robot), SEAM, RATE, SEED)
        columns = TextColumn('{task.description:<40}'), BarColumn(), TimeElapsedColumn()
        with Progress(*columns, console=console) as bars:
            for step in steps:
                bar = bars.add_task(step.title, total=1.0)
                step.run(job, partial(_advance, bars, bar))
                bars.update(bar, completed=1.0)
    for line in job.lines:
        console.print(line, highlight=False, markup=False, soft_wrap=True)
    console.print(f'results in {out}', highlight=False)


def _advance(bars: Progress, bar: TaskID, part: float) -> None:
    bars.update(bar, completed=part)
