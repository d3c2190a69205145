# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Plan a measurement: how many postures, which, and how sure one will be.

Before anybody measures: for the errors that arms of this kind usually have. With --model: after a
diagnosis, for what it left open, in a --region or in the whole reach. With --out, the directory gets
the stations, a table to fill in, and with --controller a robot program.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ..options import add_force, add_robot, output, robot_of

if TYPE_CHECKING:
    from weld_twin_core.arm.robot import Robot
    from weld_twin_core.arrays import Array
    from weld_twin_msgs_py.programs import Context

    from ...offline.measurement_plan import Planned

SHOWN = 8
"""Rows of the table on the terminal."""
SUFFIXES = {
    'urscript': '.script',
    'krl': '.src',
    'rapid': '.mod',
    'inform': '.jbi',
    'fanuc-ls': '.ls',
    'joint-trajectory': '.yaml',
    'csv': '.csv',
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    from ..program_options import add_program_options

    add_robot(parser)
    add = parser.add_argument
    add('--tolerance', type=float, required=True, metavar='MM', help='of the tool, such as 0.3')
    add('--minutes', type=float, metavar='M', help='there is time for')
    add('--postures', type=int, metavar='N', help='so many, in place of as many as are needed')
    add(
        '--noise',
        type=float,
        default=0.03,
        metavar='MM',
        help='standard deviation of a measured coordinate: about 0.03 with a tracker or a measuring '
        'arm, 0.1 with cameras, 0.1 to 0.2 with a pin (default: 0.03)',
    )
    add(
        '--seconds',
        type=float,
        default=10.0,
        metavar='S',
        help='that one station takes, the way to it apart (default: 10)',
    )
    add(
        '--spread',
        type=float,
        default=75.0,
        metavar='DEG',
        help='every joint turns so far to either side of the posture of a usual seam '
        '(default: 75)',
    )
    add('--model', metavar='FILE', help='diagnosis.json: plan what to measure on top of it')
    add(
        '--region',
        metavar='R',
        help='where the tool is to be sure, with --model: a box X,Y,Z:X,Y,Z (corners in the base frame, '
        'mm), a program, or a bag (default: the whole reach)',
    )
    add('--controller', metavar='NAME', help=f'also write a program: {", ".join(SUFFIXES)}')
    add('--trigger', type=int, default=1, metavar='N', help='output that tells the instrument')
    add('--out', metavar='DIR', help='directory for the files')
    add_force(parser)
    add_program_options(parser)


def run(args: argparse.Namespace) -> int:
    """Print how many stations and how sure; write the files."""
    from weld_twin_core.errors import DataError

    from ...offline.measurement_plan import SURE

    if args.controller is not None and args.controller not in SUFFIXES:
        known = ', '.join(SUFFIXES)
        raise DataError(
            f'--controller: there is no language {args.controller!r}; known are {known}'
        )
    if args.controller and not args.out:
        raise DataError('--controller writes a program; say with --out where')
    if args.minutes is None and args.postures is None:
        raise DataError('say with --minutes for how long there is time, or how many --postures')
    minutes = 1.0 if args.minutes is None else args.minutes
    if not (0.0 < args.seconds <= 3600.0 and 0.0 < minutes <= 10_000.0):
        raise DataError('--minutes and --seconds must be above zero')
    if args.region and not args.model:
        raise DataError('--region says where a fitted model is to be sure; give it with --model')
    robot = robot_of(args)
    plan = _more(args, robot, minutes) if args.model else _first(args, robot)
    _print_table(plan, args.tolerance)
    if args.postures is not None and plan.within[-1] < SURE:
        print(
            f'{args.postures} poses keep {args.tolerance:g} mm at {plan.within[-1]:.0%} of '
            'postures; more of them, less noise or a smaller --spread help'
        )
    if args.out:
        _write(args, robot, plan)
    return 0


def _first(args: argparse.Namespace, robot: Robot) -> Planned:
    """Return the plan of a first measurement."""
    from math import radians

    from weld_twin_core.diagnosis.predicting.planned import plan_stations

    from ...offline.measurement_plan import planned

    given = (args.tolerance * 1e-3, args.noise * 1e-3, radians(args.spread))
    return planned(
        robot,
        lambda count: plan_stations(robot, count, *given),
        args.minutes,
        args.seconds,
        args.postures,
    )


def _more(args: argparse.Namespace, robot: Robot, minutes: float) -> Planned:
    """Return the plan of what to measure on top of a diagnosis, and say how sure it is so far."""
    from math import radians

    from weld_twin_core.diagnosis.predicting.planned import Wanted, plan_more
    from weld_twin_core.effects.setup_motion import of_the_robot
    from weld_twin_core.errors import DataError
    from weld_twin_core.twin.twin import Twin
    from weld_twin_msgs_py.files.diagnosis_model import load_model
    from weld_twin_msgs_py.files.posterior_entry import read_posterior

    from ...offline.measurement_plan import planned
    from ...offline.region import anywhere

    posterior, fitted = read_posterior(robot, args.model), load_model(robot, args.model)
    if posterior is None:
        raise DataError(
            f"the diagnosis '{args.model}' does not say how sure it is; diagnose again"
        )
    twin = Twin(fitted.robot, of_the_robot(fitted.effects))
    postures = _in_region(args, robot) if args.region else anywhere(robot, radians(args.spread))
    wanted = Wanted(args.tolerance * 1e-3, args.noise * 1e-3)
    plan = planned(
        robot,
        lambda count: plan_more(posterior, twin, postures, count, wanted),
        None if args.postures else minutes,
        args.seconds,
        args.postures,
        least=1,
        offered=len(postures[1]),
    )
    where = f"in the region '{args.region}'" if args.region else 'elsewhere in its reach'
    print(
        f'so far the corrected robot may be off by {plan.sigma[0] * 1e3:.2g} mm {where} '
        '(one standard deviation)'
    )
    return plan


def _in_region(args: argparse.Namespace, robot: Robot) -> tuple[Array, Array]:
    """Return the postures of --region."""
    from weld_twin_msgs_py.programs.languages import language_of
    from weld_twin_msgs_py.programs.source import read_source

    from ...offline.region import region
    from ..program_options import context_of

    language = ''
    if Path(args.region).is_file():
        language = language_of(read_source(args.region), args.region, args.controller or '')
    context = context_of(args, robot, language or args.controller or 'csv')
    return region(robot, args.region, context, language)


def _print_table(plan: Planned, tolerance: float) -> None:
    print(f'poses  minutes  usual error left  within {tolerance:g} mm')
    most = len(plan.minutes) - 1
    count = len(plan.q)
    steps = {0, 8, 16, 24, 40, 60, 80, 120, count, most}
    for k in sorted(step for step in steps if step <= most):
        print(
            f'{k:5d}  {plan.minutes[k]:7.1f}  {plan.sigma[k] * 1e3:13.3f} mm  '
            f'{plan.within[k]:8.0%}'
        )
    if plan.needed is None:
        print(
            f'all {most} poses that fit into the time keep {tolerance:g} mm at '
            f'{plan.within[-1]:.0%} of postures; more time, less noise or a smaller --spread help'
        )
    else:
        print(f'{count} poses, {plan.minutes[count]:.0f} minutes: base and tool are found along')


def _write(args: argparse.Namespace, robot: Robot, plan: Planned) -> None:
    import numpy as np

    from ...offline.measurement_plan import STATIONS, TABLE, write_plan
    from ..program_options import context_of

    # Without a controller the table counts as the model does, which this one's language does too.
    context = context_of(args, robot, args.controller or 'csv')
    with output(args, TABLE) as folder:
        write_plan(folder, context, args.controller, plan)
        if args.controller:
            _write_program(args, context, folder)
    print(f'stations: {Path(args.out) / STATIONS}')
    print(f'table to fill in: {Path(args.out) / TABLE}')
    if not np.array_equal(context.controller.mix, np.eye(robot.n)):
        print('J3 counts from the ground there: import the table with --coupled 3+2')


def _write_program(args: argparse.Namespace, context: Context, folder: Path) -> None:
    from weld_twin_msgs_py.files.whole_files import write_text
    from weld_twin_msgs_py.programs.writing import sheet

    from ...offline.exporting import SLOW, Speeds, export
    from ...offline.measurement_plan import STATIONS

    name = f'measure{SUFFIXES[args.controller]}'
    made, text, notes = export(
        str(folder / STATIONS),
        context,
        args.controller,
        'measure',
        Speeds(dwell=args.seconds),
        args.trigger,
    )
    write_text(folder / name, text)
    told = f"It runs at most {SLOW[0]:.0%} of the joints' speed. That is for the first run."
    guide = folder / f'{name}.md'
    write_text(guide, sheet(made, args.controller, name, told, notes))
    print(f'program: {Path(args.out) / name}, how to load it: {Path(args.out) / guide.name}')
