# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Change the points of a robot program so that the real tool goes where the program meant.

Reads the program in the language of its maker and writes the same program with other coordinates,
a page (report.html) and correction.json to the directory. Without --model it comes back as it was.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from weld_twin_nodes.cli.options import add_output, add_robot, output, robot_of
from weld_twin_nodes.cli.program_options import add_program_options, context_of, quantity, start_of

if TYPE_CHECKING:
    from weld_twin_msgs_py.programs import Context, Program

RESULT, PAGE = 'correction.json', 'report.html'
LARGEST = ('2mm', '1deg')
"""How far a point may be moved unless told: more is no inaccuracy of an arm, but a mistake."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('program', metavar='PROGRAM', help='program; a .dat is found beside it')
    add_robot(parser)
    parser.add_argument('--model', metavar='FILE', help='diagnosis.json, or an effects file')
    add_output(parser, 'where results go')
    parser.add_argument(
        '--controller', default='', metavar='L', help='language, where the file does not tell it'
    )
    parser.add_argument(
        '--max-correction',
        nargs=2,
        default=LARGEST,
        metavar=('LENGTH', 'ANGLE'),
        help='how far a point may be moved (default: 2mm 1deg)',
    )
    parser.add_argument(
        '--tolerance',
        metavar='LENGTH',
        help='of the tool, such as 0.3mm: also say how probably it is kept all along the seams',
    )
    parser.add_argument(
        '--noise',
        default='0.03mm',
        metavar='LENGTH',
        help='of a coordinate of your instrument, for what to measure more (default: 0.03mm)',
    )
    parser.add_argument(
        '--start',
        metavar='A,A,...',
        help='joints before the first move, in degrees (mm for sliding ones)',
    )
    parser.add_argument(
        '--temperature', type=float, metavar='DEGC', help='of the arm when the program runs'
    )
    parser.add_argument(
        '--setup', type=int, default=1, metavar='N', help='which recording of the diagnosis'
    )
    add_program_options(parser)


def run(args: argparse.Namespace) -> int:
    """Read, correct, write; say what is expected."""
    from weld_twin_msgs_py.programs import read_program
    from weld_twin_msgs_py.programs.languages import language_of
    from weld_twin_msgs_py.programs.source import read_source

    robot = robot_of(args)
    robot.refuse_positioner('a corrected program')
    language = language_of(read_source(args.program), args.program, args.controller)
    context = context_of(args, robot, language)
    program = read_program(args.program, context, language)
    if not args.model:
        with output(args, RESULT) as place:
            entry = {'schema': 'weld_twin/correction/1', 'program': program.sources[0].name}
            _write_texts(place, program, [source.text for source in program.sources])
            _write_entry(place, entry | {'language': language, 'model': None})
        print(
            f'{args.out}: {len(program.steps)} moves in {language}, unchanged; no model was given'
        )
        return 0
    return _corrected(args, context, program)


def _corrected(args: argparse.Namespace, context: Context, program: Program) -> int:
    from weld_twin_core.twin.program_correction import Caps
    from weld_twin_msgs_py.files.diagnosis_model import read_diagnosis
    from weld_twin_msgs_py.files.input_files import hashed
    from weld_twin_msgs_py.files.whole_files import write_text
    from weld_twin_nodes.offline.correcting import (
        corrected_program,
        correction_entry,
        not_told,
        program_model,
        way,
    )
    from weld_twin_nodes.offline.told_twin import other_readings
    from weld_twin_nodes.offline.tolerances import tolerance_entry

    from ...report.correction_page import correction_page, headline, tolerance_told

    length, angle = args.max_correction
    caps = Caps(
        quantity(length, ('mm', 'm', 'um'), '--max-correction'),
        quantity(angle, ('deg', 'rad'), '--max-correction'),
    )
    robot = context.robot
    model = program_model(robot, args.model, args.temperature, args.setup - 1)
    content = read_diagnosis(args.model) if Path(args.model).suffix.lower() == '.json' else {}
    made = corrected_program(
        program, context, model, caps, start_of(args, robot), other_readings(content)
    )
    entry = correction_entry(made, robot, caps) | {'way': way(made, model)}
    entry['notes'] += not_told(content)
    if args.tolerance:
        size, noise = (
            quantity(text, ('mm', 'm', 'um'), option)
            for text, option in ((args.tolerance, '--tolerance'), (args.noise, '--noise'))
        )
        entry['tolerance'] = tolerance_entry(made, model, size, noise)
    inputs = [hashed('program', args.program), hashed('model', args.model)]
    entry['inputs'] = [item.as_dict() for item in inputs]
    with output(args, RESULT) as place:
        _write_texts(place, program, made.texts)
        write_text(place / PAGE, correction_page(entry, inputs))
        _write_entry(place, entry)
    print(f'{Path(args.out) / program.sources[0].name}: {headline(entry)}')
    for sentence in tolerance_told(entry):
        print(sentence)
    _tell(entry)
    print(f'report: {Path(args.out) / PAGE}')
    return 0


def _tell(entry: dict[str, Any]) -> None:
    """Print what was left, where the model knows nothing, and what else is to be known."""
    for left in entry['left']:
        print(f'left as it was: {left["why"]}')
    outside = [move['where'] for move in entry['moves'] if move['outside']]
    if outside:
        print(f'{len(outside)} moves lie outside what the model knows, the first at {outside[0]}')
    for note in entry['notes']:
        print(f'note: {note}')


def _write_texts(place: Path, program: Program, texts: Sequence[str]) -> None:
    for source, text in zip(program.sources, texts, strict=True):
        (place / source.name).write_bytes(text.encode('latin-1'))


def _write_entry(place: Path, entry: dict[str, object]) -> None:
    from weld_twin_msgs_py.files.whole_files import write_text

    write_text(place / RESULT, json.dumps(entry, indent=1, allow_nan=False) + '\n')
