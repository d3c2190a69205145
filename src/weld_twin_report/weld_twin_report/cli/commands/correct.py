# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Correct a robot program, or the joint commands of a bag."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from weld_twin_core.errors import DataError
from weld_twin_core.twin.program_correction import Caps
from weld_twin_msgs_py.bags import provenance
from weld_twin_msgs_py.files.input_files import InputFile
from weld_twin_msgs_py.files.whole_files import read_json
from weld_twin_msgs_py.programs import Context, Program, read_program
from weld_twin_msgs_py.programs.languages import corrected_twice, language_of, programs_beside
from weld_twin_msgs_py.programs.source import read_source
from weld_twin_nodes.cli.given import Given, inputs_of, quantity, refuse_changed, say_doubts
from weld_twin_nodes.cli.options import PROGRAM, TOPICS
from weld_twin_nodes.cli.parsing import names_of
from weld_twin_nodes.offline.given_twin import (
    changed_robot,
    diagnosis_of,
    other_readings,
    since_recorded,
)

from . import OF_PROGRAM

RESULT = 'correction.json'
CAPS = '--max-correction'
NOISE = '0.03mm'
"""Of a measured coordinate unless given: a tracker or a measuring arm."""
LARGEST = ('2mm', '1deg')
"""How far a point may be moved unless given: more is no inaccuracy of an arm, but a mistake."""
BAGS = ('.mcap', '.db3')
_Inputs = Sequence[InputFile]


def run(given: Given) -> int:
    """Correct a bag or a program; say what is expected."""
    what = Path(given.program)
    if what.is_dir() or what.suffix.lower() in BAGS:
        of_program = (*names_of(OF_PROGRAM, PROGRAM), 'force')
        given.refuse(of_program, f"is of a program; '{given.program}' is a bag")
        return _corrected_bag(given)
    given.refuse(names_of(TOPICS), f"is of a bag; '{given.program}' is none")
    removed = _another(Path(given.out), what)
    if removed and not given.force:
        raise DataError(
            f"'{given.out}' holds the correction of {removed}, which would be removed; give "
            f'{what.name} a folder of its own'
        )
    if given.model:
        content = _correction_in(what.resolve().parent)
        moves = content.get('moves', ())
        some = any(move.get('moved_m') or move.get('turned_rad') for move in moves)
        if some and content.get('program') == what.name:
            raise corrected_twice(what.name, f"'{RESULT}' beside it says so")
    inputs = inputs_of(program=given.program, model=given.model)
    robot = given.load_robot()
    language = language_of(read_source(given.program), given.program, given.controller)
    context = given.program_context(robot, language, given.model)
    context = context._replace(beside=programs_beside(given.program, language))
    program = read_program(given.program, context, language)
    if given.model:
        _by_model(given, context, program, inputs)
    else:
        entry: dict[str, Any] = {'schema': 'weld_twin/correction/1', 'language': language}
        entry |= {'program': program.sources[0].name, 'model': None}
        texts = {source.name: source.text.encode('latin-1') for source in program.sources}
        given.write_results(RESULT, '', entry, texts.items())
        print(
            f'{given.out}: {len(program.steps)} moves in {language}, unchanged; no model was given'
        )
    if removed:
        print(f"note: the correction of {removed} was removed from '{given.out}'")
    return 0


def _correction_in(folder: Path) -> dict[str, Any]:
    try:
        return read_json(folder / RESULT)
    except DataError:
        return {}


def _another(out: Path, program: Path) -> str:
    """Return whose correction a folder holds, if another's: its file would go with its promise."""
    there = str(_correction_in(out).get('program', program.name))
    return '' if there == program.name else there


def _corrected_bag(given: Given) -> int:
    """Write the commands and say what they gain by the model, and where it knows too little."""
    from weld_twin_nodes.offline import prediction

    if not given.model:
        raise DataError('say with --model by which effects the commands are corrected')
    if prediction.COMPENSATED in provenance(given.program):
        raise DataError(
            f"the commands of '{given.program}' were corrected already, and would be corrected "
            'twice; give the bag as it was before'
        )
    robot = given.load_robot()
    robot.refuse_positioner('a compensated motion')
    recording = given.read_bag(given.program, robot)
    made = prediction.compensated(robot, given.model, recording, given.setup - 1)
    # What a posterior leaves open lies on both sides of zero.
    doubted = made.model.twin.effects if made.model.posterior is None else ()
    say_doubts(robot, doubted, given.model, given.robot)
    if made.remark:
        print(f'note: {made.remark}')
    robot.check_positions(made.result.motion.q)
    prediction.write_compensated(given.out, made, recording, storage=given.storage)
    before, after = made.result.rms
    print(
        f'{given.out}: by the model the tool is {before * 1e3:.4f} mm RMS off with the nominal '
        f'commands and {after * 1e3:.4f} mm with these\n'
        'this is what the effects in the model do on these commands; the gap of a diagnosis also '
        'holds noise and whatever it left unexplained'
    )
    if worst := prediction.farthest_sentence(made, recording):
        print(worst)
    for sentence in prediction.trust_sentences(made):
        print(sentence)
    if leap := prediction.leap_sentence(robot, made, recording):
        print(f'note: {leap}')
    if made.result.left_out:
        names = ', '.join(effect.name for effect in made.result.left_out)
        print(f'joint commands cannot mend {names}')
    return 0


def _by_model(given: Given, context: Context, program: Program, inputs: _Inputs) -> None:
    from weld_twin_nodes.offline import correcting

    from ...report.correction_page import correction_page, headline, tolerance_sentences

    robot = context.robot
    length, angle = given.max_correction or LARGEST
    caps = Caps(_length(length, CAPS), quantity(angle, ('deg', 'rad'), CAPS))
    model = correcting.program_model(robot, given.model, given.temperature, given.setup - 1)
    if model.posterior is None:  # what a posterior leaves open lies on both sides of zero
        say_doubts(robot, model.effects, given.model)
    content = diagnosis_of(given.model)
    made = correcting.corrected_program(
        program, context, model, caps, given.read_start(context), other_readings(content)
    )
    entry = correcting.correction_entry(made, robot, caps) | {'way': correcting.way(made, model)}
    entry['notes'] += correcting.other_causes(content) + changed_robot(content, given.robot)
    entry['notes'] += since_recorded(content, model.effects)
    if given.tolerance:
        tolerance = _length(given.tolerance, '--tolerance')
        noise = _length(given.noise or NOISE, '--noise')
        entry['tolerance'] = correcting.tolerance_entry(made, model, tolerance, noise)
    refuse_changed(inputs)
    entry['inputs'] = [item.as_dict() for item in inputs]
    names = (source.name for source in program.sources)
    texts = zip(names, (text.encode('latin-1') for text in made.texts), strict=True)
    given.write_results(RESULT, correction_page(entry, inputs), entry, texts)
    print(f'{Path(given.out) / program.sources[0].name}: {headline(entry)}')
    for sentence in tolerance_sentences(entry):
        print(sentence)
    for remaining in entry['left']:
        print(f'left as it was: {remaining["why"]}')
    outside = [move['where'] for move in entry['moves'] if move['outside']]
    if outside:
        print(f'{len(outside)} moves lie outside what the model knows, the first at {outside[0]}')
    for note in entry['notes']:
        print(f'note: {note}')
    given.say_page()


def _length(text: str, option: str) -> float:
    return quantity(text, ('mm', 'm', 'um'), option)
