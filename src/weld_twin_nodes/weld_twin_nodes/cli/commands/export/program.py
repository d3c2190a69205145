# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Write a seam or an experiment as a robot program.

The experiment is the next_experiment.yaml of a diagnosis, or any path file. Beside the program goes
a sheet that says how to load it, and how to record joints and poses.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ...options import add_file_output, add_robot, output_file, robot_of
from ...parsing import Adder
from ...program_options import (
    add_program_options,
    add_trigger,
    check_program,
    context_of,
    quantity,
)

EXAMPLE = 'weld-twin export program spline --robot ur5 --controller urscript --out seam.script'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add = Adder(parser)
    add('path', 'PATH', 'path file, experiment, or a bundled seam such as line')
    add_robot(parser)
    text = 'urscript, krl, rapid, inform, fanuc-ls, joint-trajectory or csv'
    add('--controller', 'NAME', text, required=True)
    add_file_output(parser, 'program to write', required=True)
    text = 'after the first run: joints at most half speed, tool 250 mm/s, not a tenth and 50 mm/s'
    add('--full-speed', text)
    add('--speed', 'V', 'of a seam, such as 8mm/s; left out, its own', default='')
    text = 'stay at each station (default: {default})'
    add('--dwell', 'S', text, type=float, default=2.0)
    add_trigger(parser)
    add_program_options(parser)


def run(args: argparse.Namespace) -> int:
    """Write program and sheet."""
    from weld_twin_core.errors import DataError

    from ....offline.exporting import FAST, SLOW, Speeds, write_program

    check_program(args)
    if not 0.0 <= args.dwell <= 600.0:
        raise DataError('--dwell must be 0 to 600 s')
    context = context_of(args, robot_of(args), args.controller)
    speed = quantity(args.speed.removesuffix('/s'), ('mm', 'm'), '--speed') if args.speed else 0.0
    how = Speeds(*(FAST if args.full_speed else SLOW), args.dwell)
    more = {
        'trigger': args.trigger,
        'seam_speed': speed,
        'faster': '; --full-speed writes it faster',
    }
    with output_file(args) as made:
        lines = write_program(
            made, Path(args.out), args.path, context, args.controller, how, **more
        )
    print('\n'.join(lines))
    return 0
