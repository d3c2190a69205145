# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Offline twin: a bag with everything the live nodes would publish along a seam."""

from __future__ import annotations

import argparse

from ..options import add_bag_output, add_robot, robot_of, twin_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add_robot(parser)
    parser.add_argument('--effects', metavar='E.yaml', default='', help='effects to inject')
    parser.add_argument(
        '--model',
        metavar='FILE',
        default='',
        help='effects that the twin knows: an effects file or diagnosis.json',
    )
    parser.add_argument(
        '--allow-implausible',
        action='store_true',
        help='take values of effects that no machine comes near, for a study of extremes',
    )
    _add_motion(parser)
    add_bag_output(parser)


def _add_motion(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        '--path',
        metavar='P',
        default='line',
        help='path file, or a bundled seam: line, arc, circle, polyline, spline, weave',
    )
    parser.add_argument(
        '--profile',
        default='smooth',
        help='time law: constant, trapezoid, s-curve, smooth, aggressive (default: smooth)',
    )
    parser.add_argument(
        '--speed',
        type=float,
        default=0.0,
        metavar='M/S',
        help='travel speed (default: as fast as profile and joints allow)',
    )
    parser.add_argument(
        '--rate', type=float, default=125.0, metavar='HZ', help='samples a second (default: 125)'
    )
    parser.add_argument(
        '--seed', type=int, default=0, help='seed of the measurement noise (default: 0)'
    )
    parser.add_argument(
        '--start-stamp',
        type=int,
        default=1_000_000_000,
        metavar='NS',
        help='stamp of the first sample [ns]; 0 would mean unset (default: 1 s)',
    )


def run(args: argparse.Namespace) -> int:
    """Write the bag and print the deviation."""
    from weld_twin_core.errors import DataError

    from ...offline.seam_motion import plan_motion, stamps
    from ...offline.simulated_bag import write_simulation
    from ...offline.simulation import Simulation

    if args.start_stamp <= 0 or args.seed < 0:
        raise DataError('--start-stamp must be positive and --seed not negative')
    robot = robot_of(args)
    real, model = (
        twin_of(robot, path, implausible=args.allow_implausible)
        for path in (args.effects, args.model)
    )
    plan = plan_motion(robot, args.path, args.profile, args.rate, args.speed)
    simulation = Simulation(
        real,
        model,
        plan.motion,
        stamps(plan.motion.t, args.start_stamp),
        args.seed,
        plan.length,
    )
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
