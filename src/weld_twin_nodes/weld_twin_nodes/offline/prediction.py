# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The twin with identified effects over a whole recording, and commands corrected by it."""

import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import quaternion_from_matrix
from weld_twin_core.arrays import Array
from weld_twin_core.errors import ModelError
from weld_twin_core.metrics.deviation import deviation
from weld_twin_core.motion.inverse.along_path import ILL_CONDITIONED, PathSolution
from weld_twin_core.recording import JointMotion, Recording
from weld_twin_core.twin.compensation import Compensation, beyond_limits, compensate
from weld_twin_core.twin.domain import as_seen
from weld_twin_core.twin.poses import Poses
from weld_twin_core.twin.posterior import (
    Posterior,
    expected_poses,
    largest_sigma,
    pose_covariances,
)
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.assembly.whole_recording import refuse_apart
from weld_twin_msgs_py.bags import write_recording
from weld_twin_msgs_py.files.diagnosis_model import (
    load_model,
    mended_source,
    one_base,
    read_model,
    timed,
)
from weld_twin_msgs_py.files.input_files import hashed
from weld_twin_msgs_py.files.posterior_entry import read_posterior
from weld_twin_msgs_py.files.whole_files import write_text

from .correcting import arm_model
from .given_twin import build_twin, diagnosis_of

BESIDE = 'prediction.json'
"""Beside the bag: the stretches outside what was recorded, and where a correction falls short."""


_ROUNDED = 5e-8
"""Length [m] that is 0.0000 mm."""
MOST = 3
"""Segments listed on the terminal; the others are in the file."""


class Segment(NamedTuple):
    """A stretch of a motion outside what was recorded [s from its first stamp], and why."""

    t_start: float
    t_end: float
    why: str


class Farthest(NamedTuple):
    """Where the tool stays farthest off by the model [s from the first stamp], and why."""

    t: float
    before_m: float
    after_m: float
    why: str  # empty where nothing is known to stand in the way


class Predictor(NamedTuple):
    """A twin and how sure it is."""

    twin: Twin
    posterior: Posterior | None = None
    """None for an effects file, or a diagnosis written without one."""
    setup: int = 0  # which base frame of the posterior, counted from 0
    source: Recording | None = None
    """The recording that it is for, mended as the diagnosis mended its own; None where nothing had
    to be."""
    remark: str = ''  # what is to be said of that, and of when it was recorded

    def expected(self, recording: Recording) -> tuple[Poses, Array] | None:
        """Return where all models allowed have the tool at every joint state, and how sure that is."""
        if self.posterior is None:
            return None
        return expected_poses(self.posterior, self.twin, recording, recording.joints.t, self.setup)

    def outside(self, recording: Recording) -> list[Segment]:
        """Return the stretches of a motion that lie outside what was recorded."""
        if self.posterior is None:
            return []
        t = recording.joints.t
        result = self.posterior.domain.outside(*as_seen(recording, t))
        t = t - t[0]
        return [Segment(float(t[a]), float(t[b]), why) for a, b, why in result]


class Written(NamedTuple):
    """What a prediction came to."""

    rms_m: float | None  # RMS of measured minus twin, where something was measured
    outside: Sequence[Segment]
    sigma_m: float | None  # median of the standard deviation of position in its worst direction


def predictor(
    robot: Robot,
    path: Path | str,  # diagnosis.json or an effects file
    # Where the diagnosis fitted a base frame per recording, its hash tells which is meant.
    bag: Path | str,
    # What the bag holds; its stamps tell whether the set-up's own motion applies.
    recording: Recording,
    setup: int | None = None,  # which recording's base frame, counted from 1; overrides the bag
) -> Predictor:
    """Return the twin of a model file for a bag, and how sure it is."""
    content = diagnosis_of(path)
    if 'model' not in content:
        return Predictor(build_twin(robot, path))
    model = read_model(robot, path)
    own = hashed('recording', bag).sha256
    known = [item['sha256'] for item in content.get('inputs') or () if item['use'] == 'recording']
    place = known.index(own) if own in known else None
    if setup is not None:
        load_model(robot, path, setup - 1)
        chosen = setup - 1
    elif place is not None and len(model.bases) > 1:
        chosen = place
    elif one_base(model):
        chosen = 0
    else:
        raise ModelError(
            f"diagnosis '{path}' has a base frame for each of its {len(model.bases)} recordings "
            f"and '{bag}' is none of them; choose one with --setup 1 to {len(model.bases)}"
        )
    # Clocks are apart by another time in every run. Where something was measured, that tells.
    clocks = place if place is not None else -1 if recording.measured is None else chosen
    source, notes = mended_source(model, robot, recording, clocks)
    twin, said = timed(path, model, chosen, source, same=place == chosen)
    remark = ' '.join([notes, *said]).strip()
    return Predictor(twin, read_posterior(robot, path), chosen, source, remark)


def on_one_clock(recording: Recording) -> Recording:
    """Return a recording whose measurements have some time in common with the joint states."""
    if recording.measured is not None and not recording.joints.static:
        refuse_apart(recording.joints, recording.measured)
    return recording


def write_prediction(
    path: Path | str,
    model: Predictor,
    recording: Recording,
    *,
    storage: str = 'mcap',
    provenance: Mapping[str, Any] | None = None,
) -> Written:
    """Write the recording with the twin's poses, covariance, deviations, and `BESIDE` it."""
    twin = model.twin
    poses = twin.poses(recording, recording.joints.t)
    expected, outside = model.expected(recording), model.outside(recording)
    deviation = _deviation(twin, recording)
    made = {'twin_effects': [effect.to_mapping() for effect in twin.effects]}
    write_recording(
        path,
        recording,
        twin.robot,
        twin=(poses.position, poses.rotation),
        expected=expected,
        deviation=deviation,
        storage=storage,
        provenance={**made, **(provenance or {})},
        beside=beside_bag(model, outside),
    )
    return Written(
        None if deviation is None else float(np.sqrt((deviation**2).sum(axis=1).mean())),
        outside,
        None if expected is None else float(np.median(largest_sigma(expected[1]))),
    )


def _deviation(twin: Twin, recording: Recording) -> Array | None:
    """Return measured minus twin in the base frame, shape (M, 3) [m]; None if none measured."""
    measured = recording.measured
    if measured is None or not measured.t.size:
        return None
    gap = measured.position - twin.poses(recording, measured.t).position
    return np.asarray(gap @ twin.robot.T_world_origin[:3, :3])


def beside_bag(
    model: Predictor, outside: Sequence[Segment], worst: Farthest | None = None
) -> dict[str, str]:
    """Return what lies in the bag's directory: stretches outside what was recorded, the worst place."""
    content: dict[str, Any] = {}
    if model.posterior is not None:
        content['outside'] = [segment._asdict() for segment in outside]
    if worst is not None:
        content['farthest'] = worst._asdict()
    return {BESIDE: json.dumps(content, indent=1) + '\n'} if content else {}


def sureness_sentences(model: Predictor, got: Written) -> list[str]:
    """Return in words how sure a prediction is, and where it knows nothing."""
    if model.posterior is None or got.sigma_m is None:
        return [
            'how sure the poses are is not known: the model has no posterior, only a '
            'diagnosis.json written by this version has'
        ]
    out = [
        f'the tool is where the models allowed have it within {got.sigma_m * 1e3:.3g} mm '
        '(one standard deviation in the worst direction, median)'
    ]
    if got.outside:
        last = '' if len(got.outside) <= MOST else f'; {len(got.outside) - MOST} more in {BESIDE}'
        parts = [f'{s.t_start:.2f} to {s.t_end:.2f} s: {s.why}' for s in got.outside[:MOST]]
        out.append('outside what was recorded, ' + '; '.join(parts) + last)
    return out


COMPENSATED = 'compensated_with'
"""Key of the provenance of commands that are corrected: by which effects."""
WHOLE = 0.999
"""Share of a correction that counts as all of it."""


class Compensated(NamedTuple):
    """Compensated commands with what the model knows of them."""

    result: Compensation
    model: Predictor
    outside: Sequence[Segment]  # of the nominal commands: where they leave what was recorded
    least: float
    """Smallest share of the correction that was applied anywhere, 1 for all of it everywhere."""
    motion: JointMotion  # the new commands, counted as the nominal ones came
    remark: str = ''
    """That the commands were read as the diagnosis mended its recordings, and are written as they
    came; empty where they are as recorded."""


def compensated(
    robot: Robot, path: Path | str, recording: Recording, setup: int = 0
) -> Compensated:
    """Return the commands for a set-up of a model file, less corrected where the model knows less."""
    arm = arm_model(robot, path, setup)
    twin, posterior = arm.twin(arm.robot.T_flange_tool, whole=True), arm.posterior
    model = Predictor(twin, posterior, setup)
    stored = read_model(robot, path) if 'model' in diagnosis_of(path) else None
    given, notes = recording, ''
    if stored is not None:
        # Its clocks are its own, and commands need none.
        recording, notes = mended_source(stored, robot, given, -1)
    nominal, real = Twin(twin.robot).poses(recording), twin.poses(recording)
    share = None
    if posterior is not None:
        about = pose_covariances(posterior, twin, recording, recording.joints.t, setup)
        share = posterior.domain.trust(
            recording.joints.q, real.position - nominal.position, about[:, :3, :3]
        )
    result = compensate(twin.robot, arm.effects, recording, trust=share)
    least = 1.0 if share is None else float(share.min())
    motion = result.motion
    if stored is not None and recording is not given:
        # They go to the same controller, so they are counted as they came.
        matrix, offset = stored.reading_map()
        back = np.linalg.inv(matrix).T
        qd = None if motion.qd is None else motion.qd @ back
        motion = replace(motion, q=(motion.q - offset) @ back, qd=qd)
    return Compensated(result, model, model.outside(recording), least, motion, notes)


def write_compensated(
    path: Path | str, made: Compensated, recording: Recording, *, storage: str = 'mcap'
) -> None:
    """Write the commands, where the model has the tool under them, and how sure it is."""
    twin = made.model.twin
    commands = replace(recording, joints=made.result.motion, measured=None)
    poses = twin.poses(commands, commands.joints.t)
    write_recording(
        path,
        replace(commands, joints=made.motion),
        twin.robot,
        twin=(poses.position, poses.rotation),
        expected=made.model.expected(commands),
        storage=storage,
        provenance={COMPENSATED: [effect.to_mapping() for effect in twin.effects]},
        beside=beside_bag(made.model, made.outside, farthest(made, recording)),
    )


def farthest(made: Compensated, recording: Recording) -> Farthest:
    """Return where corrected commands leave the tool farthest from where it is wanted."""
    before, after = (
        np.linalg.norm(off[:, :3], axis=1) for off in (made.result.before, made.result.after)
    )
    at, t = int(after.argmax()), recording.joints.t
    there = made.result.motion.q[at : at + 1]
    posture = PathSolution(made.model.twin.robot, np.zeros((0, 4, 4)), there, '')
    near = after[at] > _ROUNDED and posture.condition[0] > ILL_CONDITIONED
    why = 'near a singularity the joints cannot make all of the correction' if near else ''
    return Farthest(float(t[at] - t[0]), float(before[at]), float(after[at]), why)


def farthest_sentence(made: Compensated, recording: Recording) -> str:
    """Return how far off the tool stays at its worst, and why; empty where it is off nowhere."""
    worst = farthest(made, recording)
    if worst.after_m <= _ROUNDED:
        return ''
    return (
        f'farthest off it stays at {worst.t:.2f} s from the first stamp, {worst.after_m * 1e3:.4f} mm '
        f'and {worst.before_m * 1e3:.4f} mm before{"; " * bool(worst.why)}{worst.why}'
    )


def leap_sentence(robot: Robot, made: Compensated, recording: Recording) -> str:
    """Return where a correction leaps as no joint can, such as by play; empty where it does not."""
    joints = recording.joints
    shift, dt = made.motion.q - joints.q, np.diff(joints.t)
    leaps = {} if joints.static else beyond_limits(robot, shift, dt)
    if not leaps:
        return ''
    first = next(iter(leaps))
    return (
        f'at {joints.t[first]:.3f} s {leaps[first]}, and so at {len(leaps)} places in all; thin the '
        'commands out, or send them through the compensator, which spreads such a step'
    )


def trust_sentences(made: Compensated) -> list[str]:
    """Return in words where the commands lie outside what was recorded, and what was held back."""
    if made.model.posterior is None or not made.outside:
        return []
    worst = made.outside[0]
    out = [
        f'outside what was recorded at {len(made.outside)} stretch(es), the first '
        f'{worst.t_start:.2f} to {worst.t_end:.2f} s: {worst.why}'
    ]
    if made.least < WHOLE:
        out.append(
            f'there no more is corrected than the model knows: down to {made.least:.0%} of what '
            'it would say'
        )
    return out


COLUMNS = 't_s,x_m,y_m,z_m,dx_m,dy_m,dz_m,d_m'


def write_table(path: Path | str, recording: Recording, off: Array) -> None:
    """Write measured positions and their deviations, shape (M, 3) [m], as CSV."""
    measured = recording.measured
    assert measured is not None
    write_numbers(path, COLUMNS, [measured.t, measured.position, off, deviation(off)])


def write_numbers(path: Path | str, heads: str, columns: Sequence[Array]) -> None:
    """Write columns of numbers, of one or more each, under heads with commas between, as CSV."""
    text = io.StringIO()
    rows = np.column_stack(columns)
    np.savetxt(text, rows, delimiter=',', header=heads, comments='', fmt='%.9g')
    write_text(path, text.getvalue())


def draw(path: Path | str, recording: Recording, off: Array) -> None:
    """Draw where the stations are off and how often by how much."""
    import matplotlib

    matplotlib.use('Agg')
    from matplotlib.figure import Figure

    measured = recording.measured
    assert measured is not None
    size = deviation(off) * 1e3
    figure = Figure(figsize=(10.0, 4.6), layout='constrained', dpi=120)
    left, right = figure.subplots(1, 2, width_ratios=(1.3, 1.0))
    where, vector = measured.position[:, :2] * 1e3, off[:, :2] * 1e3
    arrows = left.quiver(*where.T, *vector.T, size, cmap='viridis', width=0.003)
    figure.colorbar(arrows, ax=left, label='deviation D [mm]', pad=0.01)
    left.set(aspect='equal', xlabel='x [mm]', ylabel='y [mm]')
    left.set_title(f'{recording.name}: measured minus twin, seen from above', loc='left')
    for name, column in zip('xyz', off.T * 1e3, strict=True):
        right.hist(column, bins=40, histtype='step', label=name)
    right.hist(size, bins=40, color='0.8', label='D', zorder=0)
    right.set(xlabel='deviation [mm]', ylabel='stations')
    right.set_title('base and tool frame not fitted', loc='left')
    right.legend(frameon=False)
    figure.savefig(path)


POSE = 't_s,x_m,y_m,z_m,qx,qy,qz,qw'
SIGMA = 'sigma_x_m,sigma_y_m,sigma_z_m,sigma_rx_rad,sigma_ry_rad,sigma_rz_rad,outside'


def write_prediction_table(path: Path | str, model: Predictor, recording: Recording) -> None:
    """
    Write the pose at every joint state as CSV.

    Where the model knows how sure it is, it is the one of all models allowed, and standard
    deviations along and about the world's axes follow, and whether the pose lies outside what was
    recorded (1) or not (0).
    """
    t = recording.joints.t
    expected = model.expected(recording)
    poses = model.twin.poses(recording, t) if expected is None else expected[0]
    columns = [t, poses.position, quaternion_from_matrix(poses.rotation)]
    head = POSE
    if expected is not None:
        flags = np.zeros(t.size)
        for start, end, _ in model.outside(recording):
            flags[(t - t[0] >= start) & (t - t[0] <= end)] = 1.0
        columns += [np.sqrt(expected[1][:, range(6), range(6)]), flags]
        head = f'{POSE},{SIGMA}'
    write_numbers(path, head, columns)
