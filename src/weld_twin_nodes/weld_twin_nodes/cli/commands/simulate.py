# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The twin offline: a bag of a seam, or of a recording.

Without a BAG: everything that the live nodes would publish along a seam. With a BAG and a --model: the
tool pose of the twin with these effects at every joint state, in the frame of the measurements: what
the instrument would read at each stamp.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from weld_twin_core.errors import DataError

from ..options import (
    BAG_OUTPUT,
    OF_TOPICS,
    ROBOT,
    TOPICS,
    refuse,
    robot_of,
    say_doubts,
    topics_of,
    twin_of,
)

EXAMPLE = (
    'weld-twin simulate --robot ur5 --effects bags/elbow_play.yaml --path spline --out my_bag'
)
SEAM = {
    'path': 'line',
    'profile': 'smooth',
    'rate': 125.0,
    'speed': 0.0,
    'seed': 0,
    'start_stamp': 1_000_000_000,
}
"""What is simulated of a seam unless told; a stamp [ns] of 0 would mean unset."""
OPTIONS = (
    '[BAG]                    recording with joint states; left out, a seam is simulated',
    ROBOT,
    '--model FILE             effects that the twin knows: diagnosis.json, or an effects file',
    BAG_OUTPUT,
    """
of a seam:
--effects E.yaml         effects to inject
--path P                 path file, or line, arc, circle, polyline, spline, weave (default: line)
--profile LAW            time law: constant, trapezoid, s-curve, smooth, aggressive (default: smooth)
--speed M/S              travel speed (default: as fast as profile and joints allow)
--rate HZ                samples a second (default: 125)
--seed N                 seed of the measurement noise (default: 0)
rare:
--start-stamp NANOS      stamp of the first sample (default: 1 s)
--allow-implausible      take values that no machine comes near, for a study of extremes
of a recording:
--temperature DEGC       of the arm, where the bag has none or another is meant
--table FILE.csv         also write the poses as a table, with standard deviations
rare:
--setup N                recording of the diagnosis whose set-up is meant, if the set-up moved between
                         them
""",
    TOPICS,
)


def run(args: argparse.Namespace) -> int:
    """Write the bag of a seam, or of a recording."""
    if args.bag:
        refuse(args, (*SEAM, 'effects', 'allow_implausible'), 'is of a seam; leave it or BAG out')
        return _predict(args)
    refuse(args, ('setup', 'temperature', 'table', *OF_TOPICS), 'is of a recording; give a BAG')
    for name, usual in SEAM.items():
        if getattr(args, name) in (None, ''):
            setattr(args, name, usual)
    return _simulate(args)


def _simulate(args: argparse.Namespace) -> int:
    from ...offline.seam_motion import plan_motion, stamps
    from ...offline.simulation import Simulation, write_simulation

    if args.start_stamp <= 0 or args.seed < 0:
        raise DataError('--start-stamp must be positive and --seed not negative')
    robot = robot_of(args)
    real, model = (
        twin_of(robot, path, implausible=args.allow_implausible)
        for path in (args.effects, args.model)
    )
    plan = plan_motion(robot, args.path, args.profile, args.rate, args.speed)
    begin = stamps(plan.motion.t, args.start_stamp)
    simulation = Simulation(real, model, plan.motion, begin, args.seed, plan.length)
    made = {'path': args.path, 'profile': args.profile, 'rate_hz': args.rate}
    metrics = write_simulation(args.out, simulation, storage=args.storage, provenance=made)
    if plan.report.slowed > 1.0:
        print(f'slowed down {plan.report.slowed:.2f} times, to stay within the joint limits')
    print(
        f'{args.out}: {plan.motion.t.size} joint states in {plan.report.duration:.1f} s along '
        f'{plan.length:.3f} m; deviation RMS {metrics["RMS"] * 1e3:.4f} mm, '
        f'max {metrics["max"] * 1e3:.4f} mm, D_norm {metrics["D_norm"]:.3g}'
    )
    return 0


def _predict(args: argparse.Namespace) -> int:
    from weld_twin_msgs_py.bags import read_recording

    from ...offline.prediction import (
        on_one_clock,
        predictor,
        sureness_sentences,
        write_prediction,
        write_prediction_table,
    )

    if not args.model:
        raise DataError('say with --model which effects the twin of a recording has')
    if args.table and Path(args.table).exists():
        raise DataError(f"'{args.table}' exists already and is not overwritten")
    robot = robot_of(args)
    # Two clocks may be what the diagnosis mended.
    recording = read_recording(args.bag, robot, topics_of(args), one_clock=False)
    if args.temperature is not None:
        recording = recording.at_temperature(args.temperature)
    model = predictor(robot, args.model, args.bag, recording, args.setup)
    recording = on_one_clock(recording if model.source is None else model.source)
    if model.remark:
        print(f'note: {model.remark}')
    say_doubts(model.twin, args.model)
    made = {'model': str(args.model)}
    got = write_prediction(args.out, model, recording, storage=args.storage, provenance=made)
    if args.table:
        write_prediction_table(args.table, model, recording)
    line = f'{args.out}: {recording.joints.t.size} poses with {len(model.twin.effects)} effects'
    if got.rms_m is not None:
        line += f'; measured minus twin RMS {got.rms_m * 1e3:.4f} mm'
    print(line)
    for sentence in sureness_sentences(model, got):
        print(sentence)
    return 0
