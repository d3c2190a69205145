# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The steps of the demo: live nodes recorded, what was recorded analysed and diagnosed, handed over."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_core.effects import Effect, effects_from_list
from weld_twin_core.errors import DataError, TwinError
from weld_twin_core.metrics.deviation import DeviationMetrics, deviation, deviation_metrics
from weld_twin_core.motion.planned_motion import Plan
from weld_twin_core.motion.seam_frame import seam_components
from weld_twin_core.recording import Measurements, Recording
from weld_twin_core.sensitivity import default_tolerances, local_sensitivity, study_of_plan
from weld_twin_core.twin.poses import Poses
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.bags import bag_info, read_recording
from weld_twin_msgs_py.files.input_files import hashed
from weld_twin_msgs_py.files.whole_files import write_json, write_text
from weld_twin_msgs_py.files.yaml_file import yaml_text
from weld_twin_msgs_py.messages.topics import (
    ACTUAL_JOINT_STATES,
    DEVIATION,
    JOINT_STATES,
    MEASURED_POSE,
    TWIN_POSE,
)
from weld_twin_nodes.harness import Cell, Tap
from weld_twin_nodes.offline.prediction import write_numbers
from weld_twin_nodes.wording.verdict import verdict

from ..report.diagnosis_files import PAGE, write_results

Progress = Callable[[float], None]
"""Tells how much of a step is done, 0 to 1."""


@dataclass
class Job:
    """The example, and what is known of it so far."""

    folder: Path  # where results go
    robot: Robot
    effects: tuple[Effect, ...]  # what is wrong with the robot; the twin does not know
    seam: str  # kind of the bundled seam
    rate: float  # [1/s], of the joint states
    seed: int  # of the measurement noise
    plan: Plan = field(init=False)  # from the first step on
    bag: Path = field(init=False)  # from the second step on
    recording: Recording = field(init=False)  # the bag read again, from the third step on
    deviation: Array = field(init=False)
    """Shape (M, 3) [m]: measured minus twin in the world frame."""
    seam_deviation: Array = field(init=False)
    """Shape (M, 3) [m]: the same along, across and normal to the seam."""
    metrics: DeviationMetrics = field(init=False)
    lines: list[str] = field(default_factory=list)  # what to tell the user at the end


class Step(NamedTuple):
    """A step: what it says it does, and the function that does it."""

    title: str
    run: Callable[[Job, Progress], None]


NOISE = 2e-5
"""Standard deviation of a measured coordinate [m], as the live injector has it."""
STEPS = 12
"""About as many things does a diagnosis of a short bag report."""


OPEN = (
    {'effect': 'backlash', 'joint': 'shoulder_pan_joint', 'width': 8e-4},
    {'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': -3e-4},
)
"""Errors of another robot on the same seam: what the elbow has, its zero or play that the load takes
up, moves the tool alike there."""


def find_causes(job: Job, progress: Progress) -> None:
    """Write the diagnosis, its page and the corrected model, and say the verdict."""
    result = _diagnosed(job, job.recording, progress)
    folder = job.folder / 'diagnosis'
    folder.mkdir()
    write_results(folder, result, [hashed('recording', job.bag)])
    job.lines += ['', *verdict(result), f'diagnosis/{PAGE} has the whole answer']


def leave_open(job: Job, progress: Progress) -> None:
    """Diagnose another robot, of which one seam does not tell everything, and say so."""
    commanded = job.recording.with_measured(None)
    real = Twin(job.robot, effects_from_list(list(OPEN), job.robot)).poses(commanded)
    noise = np.random.default_rng(job.seed).normal(scale=NOISE, size=real.position.shape)
    seen = Measurements(commanded.joints.t, real.position + noise, real.rotation)
    result = _diagnosed(job, commanded.with_measured(seen), progress)
    folder = job.folder / 'open'
    folder.mkdir()
    write_results(folder, result, [])
    job.lines += [
        '',
        'Another robot on the same seam:',
        *verdict(result),
        f'open/{PAGE} says more',
    ]


def _diagnosed(job: Job, recording: Recording, progress: Progress) -> Diagnosis:
    lines: list[str] = []

    def tell(text: str) -> None:
        lines.append(text)
        progress(min(len(lines) / STEPS, 0.99))

    return diagnose([recording], job.robot, progress=tell)


LIMIT = 120.0
"""Seconds the run may stand still on a slow machine."""
EACH = (JOINT_STATES, ACTUAL_JOINT_STATES, MEASURED_POSE, TWIN_POSE, DEVIATION)
"""Topics with one message for each joint state."""


def run_live(job: Job, progress: Progress) -> None:
    """Run the motion through the nodes, at the speed they keep up with, and record it."""
    job.bag = job.folder / 'bag'
    samples = job.plan.motion.t.size
    try:
        with Cell() as cell:
            deviations = _start(cell, job)

            def complete() -> bool:
                progress(len(deviations) / samples)
                return len(deviations) == samples

            cell.wait(
                complete,
                lambda: f'the deviations: {len(deviations)} of {samples} are here',
                limit=LIMIT,
                progress=lambda: len(deviations),
            )
            cell.wait_recorded({topic.name: samples for topic in EACH})
            recorder = cell.processes[0]
            recorder.interrupt()
            if recorder.end() != 0:
                raise TwinError(f'the recorder failed: {recorder.log}')
    except TimeoutError as error:
        raise TwinError(str(error)) from None
    lacking = bag_info(job.bag).incomplete
    if lacking:
        raise TwinError(f'the recording is not complete: {"; ".join(lacking)}')


def _start(cell: Cell, job: Job) -> Tap:
    """
    Start the nodes; what listens comes before what speaks, and each waits for the next.

    Deviations go to the recorder, the harness, and the generator, which sends as fast as they come.
    """
    common = {'robot': job.robot.name, 'reliable_inputs': True}
    cell.start('recorder', out=str(job.bag), reliable_inputs=True)
    cell.start('deviation_analyzer', path_length=job.plan.length, wait_for_subscribers=3, **common)
    cell.start('forward_kinematics_twin', wait_for_subscribers=2, **common)
    effects = yaml_text([effect.to_mapping() for effect in job.effects])
    cell.start('error_injector', effects=effects, seed=job.seed, wait_for_subscribers=2, **common)
    deviations = cell.collect(DEVIATION.name)
    cell.start(
        'trajectory_generator',
        robot=job.robot.name,
        path=job.seam,
        rate=job.rate,
        playback=0.0,
        follow=DEVIATION.name,
        wait_for_subscribers=3,
        meet_within=LIMIT,
        exit_when_done=True,
    )
    return deviations


def analyse(job: Job, _: object) -> None:
    """Fill in the recording, its deviations from the nominal twin, and their metrics."""
    job.recording = read_recording(job.bag, job.robot)
    measured = job.recording.measured
    if measured is None:
        raise DataError(f"bag '{job.bag}' holds no measurements")
    expected = Twin(job.robot).poses(job.recording, measured.t)
    actual = expected if measured.rotation is None else Poses(measured.position, measured.rotation)
    job.deviation = measured.position - expected.position
    # The plan's stamps are those of the joint states, so each measurement finds its place on
    # the seam by time.
    place = np.searchsorted(job.plan.motion.t, measured.t - 1e-9).clip(max=len(job.plan.s) - 1)
    tangent, normal = job.plan.seam.tangent[place], job.plan.seam.normal[place]
    job.seam_deviation = seam_components(job.deviation, tangent, normal)
    job.metrics = deviation_metrics(
        actual,
        expected,
        t=measured.t,
        path_length_m=job.plan.length,
        tangent=tangent,
        normal=normal,
    )


FAMILIES = ('joint_offset', 'link_length', 'link_twist', 'backlash', 'base_pose')
NAMED = 3
"""Parameters that the demo names."""


def rank(job: Job, _: object) -> None:
    """Write ``sensitivity.json`` and name the parameters that move the tool most."""
    study = study_of_plan(job.robot, job.plan)
    result = local_sensitivity(study, default_tolerances(job.robot, FAMILIES)).as_dict()
    write_json(job.folder / 'sensitivity.json', result)
    leaders = ', '.join(
        f'{row["name"]} {row["contribution_m"] * 1e3:.2f} mm'
        for row in result['parameters'][:NAMED]
    )
    job.lines.append(f'matters   at typical tolerances {leaders}')


MARK = 'summary.txt'
COLUMNS = 't_s,dx_m,dy_m,dz_m,along_m,across_m,normal_m,d_m'
"""Measured minus twin, in the robot's base frame and along the seam; ``d_m`` is its length."""


def write_table(job: Job, _: object) -> None:
    """Write ``deviation.csv`` and ``summary.txt``."""
    measured = job.recording.measured
    assert measured is not None
    columns = [measured.t, job.deviation, job.seam_deviation, deviation(job.deviation)]
    write_numbers(job.folder / 'deviation.csv', COLUMNS, columns)
    job.lines = _summary(job) + job.lines
    write_text(job.folder / MARK, '\n'.join(job.lines) + '\n')


def _summary(job: Job) -> list[str]:
    m = job.metrics
    injected = ', '.join(_described(effect.to_mapping()) for effect in job.effects)

    def mm(value: float | None) -> str:
        return 'unknown' if value is None else f'{value * 1e3:8.4f} mm'

    return [
        f'robot     {job.robot.name}, seam of {job.plan.length:.3f} m in '
        f'{job.plan.report.duration:.1f} s, {m.samples} poses measured',
        f'injected  {injected}',
        f'RMS       {mm(m.rms_m)}     along   {mm(m.along_rms_m)}',
        f'mean      {mm(m.mean_m)}     across  {mm(m.across_rms_m)}',
        f'95 %      {mm(m.p95_m)}     normal  {mm(m.normal_rms_m)}',
        f'max       {mm(m.max_m)}     D_norm  {m.d_norm:.3e}   D_cum {m.d_cum_m:.4f} m',
    ]


def _described(entry: dict[str, object]) -> str:
    name, joint = entry.pop('effect'), entry.pop('joint', None)
    values = ', '.join(f'{key} {value:g}' for key, value in entry.items())
    return f'{name} of {joint} ({values})' if joint else f'{name} ({values})'


SHOWN = 0.1
"""Part of the seam's extent that the largest magnified deviation takes."""
COLOURS = {'along': '#1b7837', 'across': '#762a83', 'normal': '#e08214'}


def draw(job: Job, _: object) -> None:
    """Write ``seam.png``."""
    import matplotlib

    matplotlib.use('Agg')
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 7.6), layout='constrained', dpi=120)
    top, bottom = figure.subplots(2, 1, height_ratios=(1.5, 1.0))
    _seam(top, job)
    _course(bottom, job)
    figure.savefig(job.folder / 'seam.png')


def _seam(axes: Any, job: Job) -> None:
    """Draw the seam in its plane: to the right the way from start to end."""
    measured = job.recording.measured
    assert measured is not None
    nominal = measured.position - job.deviation
    plane = _plane(nominal, job.plan.seam.normal[0])
    flat, off = (nominal - nominal[0]) @ plane, job.deviation @ plane
    factor = _round(SHOWN * np.ptp(flat, axis=0).max() / np.linalg.norm(off, axis=1).max())
    shown = flat + factor * off
    axes.plot(*flat.T * 1e3, color='black', lw=1.2, label='seam, as the twin has it')
    size = deviation(job.deviation) * 1e3
    marks = axes.scatter(
        *shown.T * 1e3,
        c=size,
        cmap='viridis',
        s=7,
        zorder=3,
        label=f'measured, deviation magnified {factor:g} times',
    )
    for k in np.linspace(0, len(flat) - 1, 40).astype(int):
        axes.plot(*np.stack([flat[k], shown[k]]).T * 1e3, color='0.6', lw=0.6, zorder=1)
    axes.annotate('start', flat[0] * 1e3, xytext=(0, -14), textcoords='offset points', ha='center')
    axes.set(aspect='equal', xlabel='from start to end [mm]', ylabel='to the left [mm]')
    axes.margins(0.06, 0.18)
    axes.figure.colorbar(marks, ax=axes, label='deviation D [mm]', pad=0.01)
    axes.legend(loc='upper right', frameon=False, markerscale=2.0)
    axes.set_title(f'{job.robot.name}: the seam seen from above the work', loc='left')


def _course(axes: Any, job: Job) -> None:
    measured = job.recording.measured
    assert measured is not None
    way = np.interp(measured.t, job.plan.motion.t, job.plan.s) * 1e3
    for column, (name, colour) in zip(job.seam_deviation.T, COLOURS.items(), strict=True):
        axes.plot(way, column * 1e3, color=colour, lw=1.0, label=name)
    axes.plot(way, deviation(job.deviation) * 1e3, color='black', lw=1.2, label='D')
    axes.axhline(0.0, color='0.7', lw=0.6, zorder=0)
    axes.set(xlabel='way along the seam [mm]', ylabel='deviation [mm]', xlim=(0.0, way.max()))
    axes.legend(ncols=4, loc='upper center', frameon=False)
    axes.margins(y=0.25)
    rms, d_norm = job.metrics.rms_m * 1e3, job.metrics.d_norm
    axes.set_title(f'RMS {rms:.3f} mm, D_norm {d_norm:.2e}', loc='left')


def _plane(points: Array, normal: Array) -> Array:
    """Return two unit vectors as columns, shape (3, 2): from start to end, and to its left."""
    along = points[-1] - points[0]
    if np.linalg.norm(along) < 1e-6:
        along = points[len(points) // 2] - points[0]
    along = along - (along @ normal) * normal
    along = along / np.linalg.norm(along)
    return np.column_stack([along, np.cross(normal, along)])


def _round(factor: float) -> float:
    """Return 1, 2 or 5 times a power of ten, not above a factor."""
    power = 10.0 ** np.floor(np.log10(factor))
    return float(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= factor))
