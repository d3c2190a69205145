# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The fields of the forms: each is an option of a command, under a title that somebody understands."""

import re
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.programs.languages import LANGUAGES

from ..report.controllers import BRANDS

IMPORT, DIAGNOSE, CORRECT = 'import', 'diagnose', 'correct'
LONGEST = 2000
"""Characters of a field."""
Check = Callable[[str], str]
"""Returns what the command is given, or raises a ValueError."""


class Field(NamedTuple):
    title: str
    hint: str = ''
    check: Check | None = None  # not needed for choices
    choices: tuple[tuple[str, str], ...] = ()
    """Value and text; empty where anything may be written."""
    option: str = ''  # of the commands; empty where it is called as the field
    lines: bool = False  # whether every line is given by itself
    commands: tuple[str, ...] = ()  # those that take it


def _between(low: float, high: float, unit: str = '') -> Check:
    def check(text: str) -> str:
        value = float(text.replace(',', '.').removesuffix(unit))
        if not low < value < high:
            raise ValueError
        return f'{value:g}'

    return check


def _kept(right: Callable[[str], object]) -> Check:
    def check(text: str) -> str:
        if not right(text):
            raise ValueError
        return text

    return check


def _signs(text: str) -> str:
    parts = re.split(r'[,;\s]+', text)
    if not all(re.fullmatch(r'[+-]?1?', part) and part for part in parts):
        raise ValueError
    return ','.join('-1' if part.startswith('-') else '1' for part in parts)


def _numbers(text: str) -> str:
    return ','.join(f'{float(part):g}' for part in re.split(r'[,;\s]+', text))


def _frames(text: str) -> str:
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    if not all(line.isprintable() and '=' in line for line in lines):
        raise ValueError
    return '\n'.join(lines)


_millimetres, _degrees, _celsius = (
    _between(0, 1000, 'mm'),
    _between(0, 360, 'deg'),
    _between(-100, 200),
)
# A region may be a file for the command line; here it is a box alone.
_corner = r'-?\d+(\.\d+)?(,-?\d+(\.\d+)?){2}'
_box = _kept(re.compile(f'{_corner}:{_corner}').fullmatch)
_coupled, _name = _kept(re.compile(r'\d+[+-]\d+').fullmatch), _kept(str.isprintable)
_AS_TABLE = ('', 'as the table says')
_FRAMES = (
    ('', 'nothing: base and tool are known'),
    ('base', 'where the instrument stood (base)'),
    ('tool', 'where the reflector sits (tool)'),
    ('base,tool', 'neither of the two (base and tool)'),
)
_LANGUAGES = ((name, f'{one.maker} ({name})') for name, one in LANGUAGES.items())
_OF_DIAGNOSES = {
    'align': Field('What is not known?', choices=_FRAMES),
    'tolerance': Field('Tolerance', 'largest deviation allowed, in mm, such as 0.5', _millimetres),
    'region': Field(
        'Where it matters',
        'a box in the base frame in mm, its lower and its upper corner: 300,-200,100:600,200,400',
        _box,
    ),
    'uncertainty': Field(
        'Uncertainty of the instrument',
        'standard uncertainty in mm, from its certificate',
        _millimetres,
    ),
    'controller': Field(
        'Controller', choices=(('', 'as the name of the robot tells'), *BRANDS.items())
    ),
}
_OF_TABLES = {
    'length_unit': Field('Lengths of a table', choices=(_AS_TABLE, ('mm', 'mm'), ('m', 'm'))),
    'angle_unit': Field(
        'Angles of a table', choices=(_AS_TABLE, ('deg', 'degrees'), ('rad', 'radians'))
    ),
    'joint_signs': Field(
        'Signs of the joints of a table',
        'such as 1,-1,-1,1,-1,1, where the controller counts the other way',
        _signs,
    ),
    'joint_offsets': Field(
        'Offsets of the joints of a table',
        'added to each, in degrees, such as 0,-90,90,0,0,0',
        _numbers,
    ),
    'coupled': Field(
        'Coupled joints of a table', '3+2 where joint 3 counts from the ground', _coupled
    ),
}
_OF_CHAINS = {
    'base_link': Field('First link', "of the arm's chain in a URDF", _name),
    'tip_link': Field('Last link', 'of it', _name),
}
_OF_FLANGES = {'flange_link': Field('Flange', 'the link of a URDF where tools begin', _name)}
_OF_PROGRAMS = {
    'language': Field(
        'Language of the program',
        choices=(('', 'as the file tells'), *_LANGUAGES),
        option='controller',
    ),
    'tool': Field(
        'Tools that the program only names',
        'one a line: NAME=X,Y,Z,... as the controller shows them',
        _frames,
        lines=True,
    ),
    'base': Field('Bases that the program only names', 'the same', _frames, lines=True),
    'start': Field(
        'Joints before the first move', 'in degrees, such as 0,-90,90,0,90,0', _numbers
    ),
    'temperature': Field(
        'Temperature of the arm', 'in degrees Celsius, when the program runs', _celsius
    ),
    'pulses_per_degree': Field('Pulses per degree', 'of every axis of a Yaskawa arm', _numbers),
    'external': Field('External axes', 'which joint each is, such as E1=rail,E2=-tilt', _name),
    'on_positioner': Field(
        'Bases on the positioner', 'names of bases that go along with it, or none', _name
    ),
    'world': Field('Where the track begins', 'X,Y,Z,... in the world of the controller', _numbers),
    'max_length': Field('Farthest that a point may be moved', 'in mm; empty: 2 mm', _millimetres),
    'max_angle': Field('Most that a point may be turned', 'in degrees; empty: 1 degree', _degrees),
}
FIELDS = {
    name: field._replace(commands=commands)
    for fields, commands in (
        (_OF_DIAGNOSES, (DIAGNOSE,)),
        (_OF_TABLES, (IMPORT,)),
        (_OF_CHAINS, (IMPORT, DIAGNOSE, CORRECT)),
        (_OF_FLANGES, (DIAGNOSE, CORRECT)),
        (_OF_PROGRAMS, (CORRECT,)),
    )
    for name, field in fields.items()
}
"""By their names, in the order in which they are shown."""
LARGEST = {'max_length': ('2', 'mm'), 'max_angle': ('1', 'deg')}
"""The two fields that are one option, `--max-correction`, and what they are unless given."""
ELSEWHERE = {
    'robot': 'Robot',
    'out': 'the place of results',
    'at': 'Recorded',
    'cell': 'Cell',
    'apply': 'Correct it and go on',
    'model': 'Diagnosis',
    'max-correction': f'{FIELDS["max_length"].title} / {FIELDS["max_angle"].title}',
}
"""Options that are fields of another kind, or buttons, and how they are called here."""
COLUMNS = 'the first line of the table'
"""What stands in the place of options that name columns."""


def given(form: Mapping[str, str], commands: Iterable[str]) -> dict[str, str]:
    """Return the fields of a form that some commands take, checked."""
    wanted, out = set(commands), {}
    for name, field in FIELDS.items():
        text = form.get(name, '').strip()
        if not text or not wanted.intersection(field.commands):
            continue
        try:
            if len(text) > LONGEST:
                raise ValueError
            out[name] = _chosen(field, text) if field.check is None else field.check(text)
        except ValueError:
            hint = f'; it is {field.hint}' if field.hint else ''
            raise DataError(f'“{field.title}” cannot be {text[:60]!r}{hint}') from None
    return out


def _chosen(field: Field, text: str) -> str:
    if text not in dict(field.choices):
        raise ValueError
    return text


def words(options: Mapping[str, str], command: str) -> list[str]:
    """Return the words of a command for the fields that it takes."""
    out = []
    for name, field in FIELDS.items():
        if name in options and command in field.commands and name not in LARGEST:
            option = (field.option or name).replace('_', '-')
            values = options[name].splitlines() if field.lines else [options[name]]
            out += [f'--{option}={value}' for value in values]
    if command == CORRECT and options.keys() & LARGEST.keys():
        sizes = [options.get(name, size) + unit for name, (size, unit) in LARGEST.items()]
        out += ['--max-correction', *sizes]
    return out


def sentence(text: str, command: str = '') -> str:
    """
    Return what a command says as somebody without a command line reads it.

    ``command``: the one that says it, where two fields are called alike.
    """
    titles = {
        (field.option or name).replace('_', '-'): field.title
        for name, field in FIELDS.items()
        if (CORRECT in field.commands if command == CORRECT else field.commands != (CORRECT,))
    }
    titles = {**titles, **ELSEWHERE}

    def title(result: re.Match[str]) -> str:
        name = result[1]
        if name.endswith(('-columns', '-column')):
            return COLUMNS
        return f'“{titles[name]}”' if name in titles else 'a setting of the command line'

    # What is quoted is a whole command line; it can only be typed where the server is.
    command = r"'weld-twin ((?:bag |export |history )?[a-z-]+)[^']*'"
    text = re.sub(command, r'the command “\1” where the server runs', text)
    text = re.sub(r'\bweld-twin ([a-z-]+)', r'“\1”', text)
    text = re.sub(r'(?<![\w-])--([a-z]+(?:-[a-z]+)*)', title, text)
    return text[:1].upper() + text[1:]
