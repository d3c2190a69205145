# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Write the model of a diagnosis as other software loads it."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ...options import add_file_output, add_robot, given_urdf, output_file, robot_of
from ...parsing import Adder

EXAMPLE = 'weld-twin export model found/diagnosis.json --robot ur5 --format offsets'
_FORMATS = ('yaml', 'urdf', 'offsets', 'effects', 'left-over')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add = Adder(parser)
    add('model', 'MODEL', 'diagnosis.json')
    add_robot(parser)
    text = (
        'yaml, urdf: the corrected robot; offsets: a CSV, a row a joint; effects: all, for the '
        'nominal robot; left-over: those that a corrected robot cannot hold (default: yaml)'
    )
    add('--format', text, choices=_FORMATS, default='yaml')
    add_file_output(parser, 'file to write (default: print it)')


def run(args: argparse.Namespace) -> int:
    """Write one file, or print it."""
    from functools import partial
    from tempfile import TemporaryDirectory

    from weld_twin_msgs_py.files.diagnosis_model import read_model
    from weld_twin_msgs_py.files.posterior_entry import read_posterior

    from ....offline.exports import FORMATS, write_given_urdf
    from ....offline.where_it_holds import where_it_holds

    robot = robot_of(args)
    model, posterior = read_model(robot, args.model), read_posterior(robot, args.model)
    notes = [] if posterior is None else where_it_holds(posterior)
    name, write = FORMATS[args.format]
    given = given_urdf(args)
    if given is not None and args.format == 'urdf':
        write = partial(write_given_urdf, given=given)
    if args.out is None:
        with TemporaryDirectory() as scratch:
            write(Path(scratch) / name, model, notes)
            sys.stdout.write((Path(scratch) / name).read_text(encoding='utf-8'))
        return 0
    with output_file(args) as path:
        write(path, model, notes)
    return 0
