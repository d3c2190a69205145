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

from . import analysis
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


def plan_seam(job: analysis.Job, _: object) -> None:
    job.plan = plan_motion(job.robot, job.seam, 'smooth', job.rate)


STEPS = (
    analysis.Step('plan the seam', plan_seam),
    analysis.Step('weld it with five live nodes and record', analysis.run_live),
    analysis.Step('compare the bag with the twin', analysis.analyse),
    analysis.Step('rank what matters on this seam', analysis.rank),
    analysis.Step('draw the seam', analysis.draw),
    analysis.Step('find what the twin does not know', analysis.find_causes),
    analysis.Step('do the same where one seam cannot tell', analysis.leave_open),
    analysis.Step('write the table', analysis.write_table),
)
CLOSED_LOOP = (
    *STEPS[:-1],
    analysis.Step('weld it again with the loop closed', close_loop),
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
    with new_directory(out, mark=analysis.MARK, force=force) as folder:
        job = analysis.Job(folder, robot, effects_from_list(effects, robot), SEAM, RATE, SEED)
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
