# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A bag of a seam, or of the twin of a recording."""

from pathlib import Path

from weld_twin_core.errors import DataError

from ..given import Given, say_doubts, twin_of
from ..options import TOPICS
from ..parsing import names_of
from . import OF_RECORDING, OF_SEAM

SEAM = {
    'path': 'line',
    'profile': 'smooth',
    'rate': 125.0,
    'speed': 0.0,
    'seed': 0,
    'start_stamp': 1_000_000_000,
}
"""What is simulated of a seam unless given; a stamp [ns] of 0 would mean unset."""


def run(given: Given) -> int:
    """Write the bag of a seam, or of a recording."""
    if given.bag:
        given.refuse(names_of(OF_SEAM), 'is of a seam; leave it or BAG out')
        return _predict(given)
    given.refuse(names_of(OF_RECORDING, TOPICS), 'is of a recording; give a BAG')
    unset = {name: usual for name, usual in SEAM.items() if getattr(given, name) in (None, '')}
    vars(given).update(unset)
    return _simulate(given)


def _simulate(given: Given) -> int:
    from ...offline.exporting import without_limits
    from ...offline.seam_motion import plan_motion, stamps
    from ...offline.simulation import Simulation, write_simulation

    if given.start_stamp <= 0 or given.seed < 0:
        raise DataError('--start-stamp must be positive and --seed not negative')
    robot = given.load_robot()
    real, model = (
        twin_of(robot, path, implausible=given.allow_implausible)
        for path in (given.effects, given.model)
    )
    plan = plan_motion(robot, given.path, given.profile, given.rate, given.speed)
    begin = stamps(plan.motion.t, given.start_stamp)
    simulation = Simulation(real, model, plan.motion, begin, given.seed, plan.length)
    made = {'path': given.path, 'profile': given.profile, 'rate_hz': given.rate}
    metrics = write_simulation(given.out, simulation, storage=given.storage, provenance=made)
    print(*(f'note: {note}\n' for note in without_limits(robot)), sep='', end='')
    if plan.report.slowed > 1.0:
        print(f'slowed down {plan.report.slowed:.2f} times, to stay within the joint limits')
    print(
        f'{given.out}: {plan.motion.t.size} joint states in {plan.report.duration:.1f} s along '
        f'{plan.length:.3f} m; deviation RMS {metrics["RMS"] * 1e3:.4f} mm, '
        f'max {metrics["max"] * 1e3:.4f} mm, D_norm {metrics["D_norm"]:.3g}'
    )
    return 0


def _predict(given: Given) -> int:
    from ...offline import prediction

    if not given.model:
        raise DataError('say with --model which effects the twin of a recording has')
    if given.table and Path(given.table).exists():
        raise DataError(
            f"'{given.table}' exists already and is not overwritten; give another name"
        )
    robot = given.load_robot()
    # Two clocks may be what the diagnosis mended.
    recording = given.read_bag(given.bag, robot, one_clock=False)
    if given.temperature is not None:
        recording = recording.at_temperature(given.temperature)
    model = prediction.predictor(robot, given.model, given.bag, recording, given.setup)
    recording = prediction.on_one_clock(recording if model.source is None else model.source)
    if model.remark:
        print(f'note: {model.remark}')
    say_doubts(model.twin.robot, model.twin.effects, given.model, given.robot)
    got = prediction.write_prediction(
        given.out, model, recording, storage=given.storage, provenance={'model': given.model}
    )
    if given.table:
        prediction.write_prediction_table(given.table, model, recording)
    line = f'{given.out}: {recording.joints.t.size} poses with {len(model.twin.effects)} effects'
    if got.rms_m is not None:
        line += f'; measured minus twin RMS {got.rms_m * 1e3:.4f} mm'
    print('\n'.join([line, *prediction.sureness_sentences(model, got)]))
    return 0
