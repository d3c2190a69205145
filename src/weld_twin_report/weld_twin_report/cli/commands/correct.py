# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Correct a robot program, or the joint commands of a bag.

A PROGRAM is read in the language of its maker; the same program with other coordinates, a page
(report.html) and correction.json go to the directory. Without --model it comes back as it was. Of a
BAG with nominal joint commands, a bag is written with those that put the real tool on the seam.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from weld_twin_core.errors import DataError
from weld_twin_nodes.cli.file_options import PROGRAM, context_of, quantity, start_of
from weld_twin_nodes.cli.options import (
    OF_TOPICS,
    ROBOT,
    STORAGE,
    TOPICS,
    folder_output,
    inputs_of,
    output,
    refuse,
    robot_of,
    say_doubts,
    topics_of,
)

if TYPE_CHECKING:
    from weld_twin_core.twin.program_correction import Caps
    from weld_twin_msgs_py.programs import Context, Program

EXAMPLE = 'weld-twin correct seam.script --robot ur5 --model found/diagnosis.json --out better'
RESULT, PAGE = 'correction.json', 'report.html'
NOISE = '0.03mm'
"""Of a measured coordinate unless told: a tracker or a measuring arm."""
LARGEST = ('2mm', '1deg')
"""How far a point may be moved unless told: more is no inaccuracy of an arm, but a mistake."""
OF_PROGRAMS = (
    *('controller', 'max_correction', 'start', 'temperature', 'setup', 'force', 'tool', 'base'),
    *('tolerance', 'noise'),
    *('pulses_per_degree', 'external', 'on_positioner', 'world'),
)
BAGS = ('.mcap', '.db3')


OPTIONS = (
    'PROGRAM|BAG  program (a .dat is found beside it), or a bag with the nominal joint commands',
    ROBOT,
    '--model FILE             diagnosis.json, or an effects file',
    folder_output('directory of results; of a bag, the bag to write'),
    """
of a program:
--controller L           language, where the file does not tell it
--max-correction LENGTH ANGLE  how far a point may be moved (default: 2mm 1deg)
--tolerance LENGTH       of the tool, such as 0.3mm: also say how probably it is kept all along the
                         seams
--start A,A,...          joints before the first move, in degrees (mm for sliding ones)
--temperature DEGC       of the arm when the program runs
rare:
--noise LENGTH           of a coordinate of your instrument, for what to measure more (default:
                         0.03mm)
--setup N                which recording of the diagnosis (default: 1)
""",
    PROGRAM,
    STORAGE,
    TOPICS,
)


def run(args: argparse.Namespace) -> int:
    """Correct a bag or a program; say what is expected."""
    what = Path(args.program)
    if what.is_dir() or what.suffix.lower() in BAGS:
        refuse(args, OF_PROGRAMS, f"is of a program; '{args.program}' is a bag")
        return _corrected_bag(args)
    refuse(args, OF_TOPICS, f"is of a bag; '{args.program}' is none")
    return _corrected_program(args)


def _corrected_bag(args: argparse.Namespace) -> int:
    """Write the commands and say what they gain by the model, and where it knows too little."""
    from weld_twin_msgs_py.bags import read_recording
    from weld_twin_nodes.offline.prediction import compensated, trust_sentences, write_compensated

    if not args.model:
        raise DataError('say with --model by which effects the commands are corrected')
    robot = robot_of(args)
    robot.refuse_positioner('a compensated motion')
    recording = read_recording(args.program, robot, topics_of(args))
    made = compensated(robot, args.model, recording)
    say_doubts(made.model.twin, args.model)
    if made.remark:
        print(f'note: {made.remark}')
    robot.check_positions(made.result.motion.q)
    write_compensated(args.out, made, recording, storage=args.storage)
    before, after = made.result.rms
    print(
        f'{args.out}: by the model the tool is {before * 1e3:.4f} mm RMS off with the nominal '
        f'commands and {after * 1e3:.4f} mm with these'
    )
    print(
        'this is what the effects in the model do on these commands; the gap of a diagnosis also '
        'holds noise and whatever it left unexplained'
    )
    for sentence in trust_sentences(made):
        print(sentence)
    if made.result.left_out:
        names = ', '.join(effect.name for effect in made.result.left_out)
        print(f'joint commands cannot mend {names}')
    return 0


def _corrected_program(args: argparse.Namespace) -> int:
    """Read, correct, write; say what is expected."""
    from weld_twin_msgs_py.files.whole_files import write_json
    from weld_twin_msgs_py.programs import read_program
    from weld_twin_msgs_py.programs.languages import language_of
    from weld_twin_msgs_py.programs.source import read_source

    robot = robot_of(args)
    language = language_of(read_source(args.program), args.program, args.controller)
    context = context_of(args, robot, language)
    program = read_program(args.program, context, language)
    if args.model:
        return _by_model(args, context, program)
    with output(args, RESULT) as place:
        entry = {'schema': 'weld_twin/correction/1', 'program': program.sources[0].name}
        _write_texts(place, program, [source.text for source in program.sources])
        write_json(place / RESULT, entry | {'language': language, 'model': None})
    print(f'{args.out}: {len(program.steps)} moves in {language}, unchanged; no model was given')
    return 0


def _by_model(args: argparse.Namespace, context: Context, program: Program) -> int:
    from weld_twin_msgs_py.files.whole_files import write_json, write_text
    from weld_twin_nodes.offline.correcting import (
        corrected_program,
        correction_entry,
        other_causes,
        program_model,
        tolerance_entry,
        way,
    )
    from weld_twin_nodes.offline.given_twin import diagnosis_of, other_readings

    from ...report.correction_page import correction_page, headline, tolerance_sentences

    robot, caps = context.robot, _caps(args)
    setup = 0 if args.setup is None else args.setup - 1
    model = program_model(robot, args.model, args.temperature, setup)
    content = diagnosis_of(args.model)
    made = corrected_program(
        program, context, model, caps, start_of(args, robot), other_readings(content)
    )
    entry = correction_entry(made, robot, caps) | {'way': way(made, model)}
    entry['notes'] += other_causes(content)
    if args.tolerance:
        tolerance = _length(args.tolerance, '--tolerance')
        noise = _length(args.noise or NOISE, '--noise')
        entry['tolerance'] = tolerance_entry(made, model, tolerance, noise)
    inputs = inputs_of(program=args.program, model=args.model)
    entry['inputs'] = [item.as_dict() for item in inputs]
    with output(args, RESULT) as place:
        _write_texts(place, program, made.texts)
        write_text(place / PAGE, correction_page(entry, inputs))
        write_json(place / RESULT, entry)
    print(f'{Path(args.out) / program.sources[0].name}: {headline(entry)}')
    print(*tolerance_sentences(entry), sep='\n', end='\n' if args.tolerance else '')
    _tell(entry)
    print(f'report: {Path(args.out) / PAGE}')
    return 0


def _caps(args: argparse.Namespace) -> Caps:
    from weld_twin_core.twin.program_correction import Caps

    option = '--max-correction'
    length, angle = args.max_correction or LARGEST
    return Caps(_length(length, option), quantity(angle, ('deg', 'rad'), option))


def _length(text: str, option: str) -> float:
    return quantity(text, ('mm', 'm', 'um'), option)


def _tell(entry: dict[str, Any]) -> None:
    """Print what was left, where the model knows nothing, and what else is to be known."""
    for remaining in entry['left']:
        print(f'left as it was: {remaining["why"]}')
    outside = [move['where'] for move in entry['moves'] if move['outside']]
    if outside:
        print(f'{len(outside)} moves lie outside what the model knows, the first at {outside[0]}')
    for note in entry['notes']:
        print(f'note: {note}')


def _write_texts(place: Path, program: Program, texts: Sequence[str]) -> None:
    for source, text in zip(program.sources, texts, strict=True):
        (place / source.name).write_bytes(text.encode('latin-1'))
