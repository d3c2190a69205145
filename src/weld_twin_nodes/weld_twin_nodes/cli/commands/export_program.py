# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Write a seam or an experiment as a program that a robot controller runs, slow at first.

The experiment is the next_experiment.yaml of a diagnosis, or any path file. Beside the program goes
a sheet that says how to load it, and how to record joints and poses.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..options import add_file_output, add_robot, output_file, robot_of
from ..program_options import add_program_options, context_of, quantity


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        'path', metavar='PATH', help='path file, experiment, or a bundled seam such as line'
    )
    add_robot(parser)
    parser.add_argument(
        '--controller',
        required=True,
        metavar='NAME',
        help='urscript, krl, rapid, inform, fanuc-ls, joint-trajectory or csv',
    )
    add_file_output(parser, 'program to write', required=True)
    parser.add_argument(
        '--full-speed',
        action='store_true',
        help='after the first run: joints up to half their speed, tool up to 250 mm/s; left out, '
        'a tenth and 50 mm/s',
    )
    parser.add_argument(
        '--speed', default='', metavar='V', help='of a seam, such as 8mm/s; left out, its own'
    )
    parser.add_argument(
        '--dwell', type=float, default=2.0, metavar='S', help='stay at each station (default: 2)'
    )
    parser.add_argument(
        '--trigger',
        type=int,
        default=1,
        metavar='N',
        help='digital output that tells the instrument when to measure (default: 1)',
    )
    add_program_options(parser)


def run(args: argparse.Namespace) -> int:
    """Write program and sheet."""
    with output_file(args) as made:
        lines = write_program(args, made, Path(args.out))
    print('\n'.join(lines))
    return 0


def _guide(program: Path) -> Path:
    """Return where the sheet of a program goes: beside it."""
    return program.with_name(f'{program.name}.md')


def write_program(args: argparse.Namespace, out: Path, told_as: Path) -> list[str]:
    """
    Write program and sheet, and return what to tell.

    Parameters
    ----------
    args : Namespace
        Of this command.
    out : Path
        Program to write.
    told_as : Path
        Where it will be found.

    """
    from weld_twin_msgs_py.files.whole_files import write_text
    from weld_twin_msgs_py.programs.writing import sheet

    from ...offline.exporting import FAST, SLOW, Speeds, export

    _check(args)
    context = context_of(args, robot_of(args), args.controller)
    share, tool = FAST if args.full_speed else SLOW
    speed = quantity(args.speed.removesuffix('/s'), ('mm', 'm'), '--speed') if args.speed else 0.0
    made, text, notes = export(
        args.path,
        context,
        args.controller,
        out.stem,
        Speeds(share, tool, args.dwell),
        args.trigger,
        speed,
    )
    fast = f"at most {share:.0%} of the joints' speed and {tool * 1e3:g} mm/s"
    told = f'It runs {fast}.'
    if not args.full_speed:
        told += ' That is for the first run; --full-speed writes it faster.'
    write_text(out, text)
    write_text(_guide(out), sheet(made, args.controller, out.name, told, notes))
    return [
        f'{told_as}: {len(made.moves)} moves in {args.controller}, {fast}',
        *(f'note: {note}' for note in notes),
        f'how to load it and to record: {_guide(told_as)}',
    ]


def _check(args: argparse.Namespace) -> None:
    """Refuse options that no program can be written with."""
    from weld_twin_core.errors import DataError
    from weld_twin_msgs_py.programs.writing import WRITERS

    if args.controller not in WRITERS:
        known = ', '.join(WRITERS)
        raise DataError(
            f'--controller: there is no language {args.controller!r}; known are {known}'
        )
    if not (0.0 <= args.dwell <= 600.0 and 0 <= args.trigger <= 9999):
        raise DataError('--dwell must be 0 to 600 s, and --trigger the number of an output')
