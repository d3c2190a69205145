# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A corrected model, a robot program, a policy, a schema.

'weld-twin export found/diagnosis.json' alone writes the model.
"""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path

from weld_twin_core.errors import DataError

from ..file_options import PROGRAM, TRIGGER, check_program, context_of, quantity
from ..options import (
    ROBOT,
    file_output,
    given_urdf,
    output_file,
    pair,
    robot_of,
    write_or_print,
)
from . import job, jobs

USUAL = 'model'
"""The job that is meant where none is named."""
EXAMPLE = 'weld-twin export found/diagnosis.json --robot ur5 --format urdf --out better.urdf'
OUT = file_output('file to write (default: print it)')
MODEL = """
--format {yaml,urdf,offsets,effects,left-over}  yaml, urdf: the corrected robot; offsets: a CSV, a
                         row a joint; effects: all, for the nominal robot; left-over: those that a
                         corrected robot cannot hold [default: yaml]
"""
SEAM = """
--full-speed             after the first run: joints at most half speed, tool 250 mm/s, not a tenth
                         and 50 mm/s
--speed V                of a seam, such as 8mm/s; left out, its own
--dwell S                stay at each station [default: 2]
"""
POLICY = """
--namespace NS           namespace of the nodes
--remap FROM:=TO         a name the nodes have and the one they get; may be given again
--nodes NODE ...         nodes it is for (default: all)
"""


@job(
    'weld-twin export model found/diagnosis.json --robot ur5 --format offsets',
    'MODEL                    diagnosis.json',
    ROBOT,
    MODEL,
    OUT,
)
def model(args: argparse.Namespace) -> int:
    """Write the model of a diagnosis as other software loads it."""
    from tempfile import TemporaryDirectory

    from weld_twin_msgs_py.files.diagnosis_model import read_model
    from weld_twin_msgs_py.files.posterior_entry import read_posterior

    from ...offline.exports import FORMATS, where_it_holds, write_given_urdf

    robot = robot_of(args)
    model, posterior = read_model(robot, args.model), read_posterior(robot, args.model)
    notes = [] if posterior is None else where_it_holds(posterior)
    name, write = FORMATS[args.format]
    given = given_urdf(args)
    if given is not None and args.format == 'urdf':
        write = partial(write_given_urdf, given=given)
    if args.out:
        with output_file(args) as path:
            write(path, model, notes)
        return 0
    with TemporaryDirectory() as scratch:
        write(Path(scratch) / name, model, notes)
        return write_or_print(args, (Path(scratch) / name).read_text(encoding='utf-8'))


@job(
    'weld-twin export program spline --robot ur5 --controller urscript --out seam.script',
    'PATH                     path file, experiment, or a bundled seam such as line',
    ROBOT,
    """
--controller NAME, required  urscript, krl, rapid, inform, fanuc-ls, joint-trajectory or csv
""",
    file_output('program to write'),
    SEAM,
    TRIGGER,
    PROGRAM,
)
def program(args: argparse.Namespace) -> int:
    """Write a seam or an experiment as a robot program.

    The experiment is the next_experiment.yaml of a diagnosis, or any path file. Beside the program
    goes a sheet that says how to load it, and how to record joints and poses.
    """
    from ...offline.exporting import FAST, SLOW, Speeds, write_program

    check_program(args)
    if not 0.0 <= args.dwell <= 600.0:
        raise DataError('--dwell must be 0 to 600 s')
    context = context_of(args, robot_of(args), args.controller)
    speed = quantity(args.speed.removesuffix('/s'), ('mm', 'm'), '--speed') if args.speed else 0.0
    how = Speeds(*(FAST if args.full_speed else SLOW), args.dwell)
    write = partial(write_program, faster='; --full-speed writes it faster')
    with output_file(args) as made:
        lines = write(
            *(made, Path(args.out), args.path, context, args.controller, how),
            trigger=args.trigger,
            seam_speed=speed,
        )
    print('\n'.join(lines))
    return 0


@job(
    'weld-twin export policy --namespace left --remap joint_states:=/cell/states --out left.xml',
    POLICY,
    OUT,
)
def policy(args: argparse.Namespace) -> int:
    """Write the security policy of the nodes, for SROS2.

    Each node may publish, hear, answer and ask what it does, and nothing else. Give the namespace
    and the remaps that the nodes are started with.
    """
    from ...live.policy import policy

    remaps = dict(pair(text, '--remap', 'FROM:=TO', ':=') for text in args.remap)
    nodes = ', '.join(args.nodes) or 'all nodes'
    text = policy(args.namespace, remaps, args.nodes)
    return write_or_print(args, text, f'{args.out}: policy for {nodes}')


@job(
    'weld-twin export schema robot --out robot.schema.json',
    'KIND                     robot, effects, seam or artefact',
    OUT,
)
def schema(args: argparse.Namespace) -> int:
    """The JSON Schema of a robot, effects, seam or artefact file."""
    import json

    from weld_twin_msgs_py.files.schemas import NAMES, schema

    if args.kind not in NAMES:
        raise DataError(f'there is no schema {args.kind!r}; there are {", ".join(NAMES)}')
    return write_or_print(args, json.dumps(schema(args.kind), indent=1) + '\n')


JOBS = jobs(model, program, policy, schema)
